//! Coverage: how much of a motion resembles the training motion of a capture.
//!
//! A model knows the motions that it was trained on. [`Coverage`] holds every training frame of a
//! capture as pose and velocity: the heading layout of [`motion`](unic_core::motion), normalised.
//! For every frame of a motion it finds the nearest training frame. A frame is covered when this
//! distance is not above the capture's own measure: the 95th percentile of the distances of its
//! frames to the rest of it, where frames within half a second do not count.
//!
//! A distance shows *that* something is new. To show *what*, speeds, turning rates and the angles
//! and speeds of all joints are compared with their ranges in the capture.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use unic_eval::Coverage;
//! use unic_io::{Capture, MotionOptions, import_motion};
//!
//! let capture = Capture::open("captures/tshirt".as_ref())?;
//! let coverage = Coverage::of(&capture)?;
//! let options = MotionOptions { fps: Some(capture.manifest.fps), ..MotionOptions::default() };
//! let motion = import_motion("cartwheel.bvh".as_ref(), &capture.character, &options)?;
//! println!("{}", coverage.assess(&motion.clip));
//! # Ok(())
//! # }
//! ```

mod neighbours;
mod quantities;
mod report;
#[cfg(test)]
mod tests;
mod unit;

pub use report::{CoverageReport, Excess, KindShare, Place, Stretch};
pub use unit::Unit;

use crate::{
    error::{Error, Result},
    kinematics::ClipKinematics,
};
use neighbours::Frames;
use quantities::{Kind, Quantities, Ranges};
use rayon::prelude::*;
use unic_core::{
    character::Character,
    clip::Clip,
    motion::{MotionLayout, MotionSpec, VelocityScheme},
};
use unic_io::{Capture, GroundPlacement, MotionOptions, Split, UpAxis, import_motion};

/// Largest number of frames to compare with. Longer captures are thinned out evenly.
const MOST_FRAMES: usize = 30_000;

/// Number of frames of the capture from which the distance of covered frames is computed.
const SCALE_FRAMES: usize = 3_000;

/// Time around a frame in which other frames of its clip do not count as neighbours, seconds.
const OWN_SECONDS: f32 = 0.5;

/// Share of the capture's own distances that count as covered.
const SEEN_SHARE: f32 = 0.95;

/// Distance above which a capture is sparse: half of √2, the distance of two unrelated frames of a
/// capture.
const SPARSE: f32 = 0.7;

/// Largest gap between uncovered frames of one stretch, seconds.
const STRETCH_GAP: f32 = 0.3;

/// Largest number of stretches in a report.
const STRETCHES: usize = 5;

/// Training motion of a capture, prepared for comparisons.
#[derive(Clone, Debug)]
pub struct Coverage {
    spec: MotionSpec,
    character: Character,
    /// Name of each clip.
    names: Vec<String>,
    fps: f32,
    frames: Frames,
    /// Largest distance of a covered frame.
    seen: f32,
    ranges: Ranges,
    /// Seconds of each [`Kind`] of movement.
    kind_seconds: [f32; Kind::COUNT],
}

impl Coverage {
    /// Reads the training motion of a capture. The garments are not read.
    ///
    /// # Errors
    /// Clips that cannot be read, no clip of two frames or more, and contact joints that do not
    /// fit.
    pub fn of(capture: &Capture) -> Result<Self> {
        let clips = capture_clips(capture, Split::Train)?;
        if clips.iter().all(|clip| clip.len() < 2) {
            return Err(Error::NoTraining {
                capture: capture.manifest.name.clone(),
            });
        }
        let spec = MotionSpec::new(
            MotionLayout::Heading,
            VelocityScheme::Backward,
            capture.contact_joints,
            &capture.character,
        )?;
        Self::fit(spec, &capture.character, &clips)
    }

    /// Prepares clips of a character, which have one frame rate. `spec` has the heading layout.
    ///
    /// # Errors
    /// Motion vectors that are not finite.
    pub fn fit(spec: MotionSpec, character: &Character, clips: &[Clip]) -> Result<Self> {
        let skeleton = &character.skeleton;
        let kinematics: Vec<ClipKinematics> = (clips.par_iter())
            .map(|clip| ClipKinematics::new(&spec, skeleton, clip))
            .collect();
        let quantities = Quantities::of(skeleton);
        let mut ranges = Ranges::new(&quantities);
        let mut kind_seconds = [0.0; Kind::COUNT];
        for (clip, kinematics) in clips.iter().zip(&kinematics) {
            for frame in 0..clip.len() {
                let values = quantities.values(skeleton, clip, kinematics, frame);
                ranges.add(&values);
                let kinds = quantities.kinds(&values, kinematics, frame);
                kinds
                    .iter()
                    .for_each(|&k| kind_seconds[k as usize] += 1.0 / clip.fps);
            }
        }
        ranges.close();
        let frames = Frames::fit(skeleton.len(), &kinematics, MOST_FRAMES)?;
        let fps = clips.first().map_or(30.0, |clip| clip.fps);
        // Neighbours in time are always near and would make every frame look covered.
        let own = (OWN_SECONDS * fps).ceil() as usize;
        let seen = quantile(frames.own_distances(SCALE_FRAMES, own), SEEN_SHARE);
        Ok(Self {
            spec,
            character: character.clone(),
            names: clips.iter().map(|clip| clip.name.clone()).collect(),
            fps,
            frames,
            seen,
            ranges,
            kind_seconds,
        })
    }

    /// Returns the largest distance of a covered frame: root mean square over the elements of the
    /// normalised motion vector, in standard deviations of the training frames.
    pub fn seen_distance(&self) -> f32 {
        self.seen
    }

    /// Returns whether the capture's own frames are so far apart that the coverage of a motion
    /// means little. Captures of many different clips, each shown once, are like this.
    pub fn is_sparse(&self) -> bool {
        self.seen > SPARSE
    }

    /// Compares a motion of the same character with the capture.
    ///
    /// The motion should have the capture's frame rate, because velocities are differences of
    /// frames. Frames that are not finite are not covered.
    pub fn assess(&self, clip: &Clip) -> CoverageReport {
        let skeleton = &self.character.skeleton;
        let kinematics = ClipKinematics::new(&self.spec, skeleton, clip);
        let found = self.frames.nearest(&kinematics);
        let quantities = Quantities::of(skeleton);
        let values: Vec<Vec<f32>> = (0..clip.len())
            .map(|frame| quantities.values(skeleton, clip, &kinematics, frame))
            .collect();
        let covered = found.iter().filter(|n| n.distance <= self.seen).count();
        let distances: Vec<f32> = found.iter().map(|n| n.distance / self.seen).collect();
        let outside = self.ranges.outside(&quantities, &values, 0..clip.len(), clip.fps);
        let mut report = CoverageReport {
            clip: clip.name.clone(),
            seconds: clip.len() as f32 / clip.fps,
            covered_percent: 100.0 * covered as f32 / clip.len().max(1) as f32,
            median_distance: quantile(distances.clone(), 0.5),
            largest_distance: distances.iter().copied().fold(0.0, f32::max),
            worst: Vec::new(),
            outside,
            kinds: self.kinds(&quantities, &values, &kinematics, clip.fps),
        };
        for range in stretches(&distances, clip.fps) {
            // The farthest frame of a stretch represents it in the report.
            let peak = range
                .clone()
                .max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
            let peak = peak.unwrap_or(range.start);
            let nearest = found[peak];
            report.worst.push(Stretch {
                from_seconds: range.start as f32 / clip.fps,
                to_seconds: range.end as f32 / clip.fps,
                distance: distances[peak],
                nearest: Place {
                    clip: self.names.get(nearest.at.clip).cloned().unwrap_or_default(),
                    seconds: nearest.at.frame as f32 / self.fps,
                },
                reasons: self.ranges.outside(&quantities, &values, range, clip.fps),
            });
        }
        report
    }

    /// Returns the kinds of movement in a motion, with their time in the motion and in the capture.
    fn kinds(
        &self,
        quantities: &Quantities,
        values: &[Vec<f32>],
        kinematics: &ClipKinematics,
        fps: f32,
    ) -> Vec<KindShare> {
        let mut seconds = [0.0; Kind::COUNT];
        for (frame, values) in values.iter().enumerate() {
            let kinds = quantities.kinds(values, kinematics, frame);
            kinds.iter().for_each(|&k| seconds[k as usize] += 1.0 / fps);
        }
        (Kind::ALL.iter().zip(seconds).zip(self.kind_seconds))
            .filter(|((_, here), _)| *here > 0.0)
            .map(|((kind, here), seen)| KindShare {
                kind: kind.name().to_owned(),
                seconds: here,
                capture_seconds: seen,
            })
            .collect()
    }
}

/// Reads the motions of one split of a capture, without the garment.
///
/// # Errors
/// Clips that cannot be read.
pub fn capture_clips(capture: &Capture, split: Split) -> Result<Vec<Clip>> {
    // A capture is Y up and needs no correction of its place.
    let options = MotionOptions {
        up: UpAxis::Y,
        ground: GroundPlacement::Keep,
        ..MotionOptions::default()
    };
    let read = |name: &String| {
        let path = capture.root.join("clips").join(format!("{name}.npz"));
        Ok(import_motion(&path, &capture.character, &options)?.clip)
    };
    capture.clip_names(split).iter().map(read).collect()
}

/// Returns stretches of uncovered frames, given distances in units of the largest covered one. The
/// heaviest come first: the weight is the sum of the distances beyond 1.
fn stretches(distances: &[f32], fps: f32) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for frame in (0..distances.len()).filter(|&t| distances[t] > 1.0) {
        match found.last_mut() {
            Some(last) if (frame - last.end) as f32 <= STRETCH_GAP * fps => last.end = frame + 1,
            _ => found.push(frame..frame + 1),
        }
    }
    let weight = |range: &std::ops::Range<usize>| -> f32 {
        distances[range.clone()].iter().map(|d| (d - 1.0).max(0.0)).sum()
    };
    found.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    found.truncate(STRETCHES);
    found
}

/// Returns the value below which this share of the values lies.
///
/// Without values it returns the least positive number, so that nothing is covered.
fn quantile(mut values: Vec<f32>, share: f32) -> f32 {
    // Frames without a neighbour are infinitely far and sort last.
    values.sort_by(f32::total_cmp);
    let at = (share * values.len().saturating_sub(1) as f32).round() as usize;
    values.get(at).copied().unwrap_or(0.0).max(f32::MIN_POSITIVE)
}
