//! Free run over a whole clip, recorded for several measures.

use super::{runner::Runner, skinned_garment::SkinnedGarment};
use crate::{
    error::Result,
    measure::second_difference,
    metrics::{SquaredErrors, ratio},
};
use glam::Vec3;
use unic_core::{AnimatorState, Start};
use unic_io::CapturedClip;

/// Number of vertices whose displacements are recorded, spread over the mesh by their indices.
const VERTICES: usize = 200;
/// Distance between recorded states, seconds.
const MOMENT_S: f32 = 5.0;
/// Largest number of recorded states.
const MOST_MOMENTS: usize = 12;

/// Record of a free run from the true garment of frame 0 to the end of the clip.
pub(super) struct ClipRun {
    /// Clip with the true garment.
    pub(super) captured: CapturedClip,
    /// Errors of each frame.
    pub(super) errors: Vec<SquaredErrors>,
    /// Displacements of the recorded vertices in each frame, metres: predicted and true.
    pub(super) displacements: [Vec<Vec<Vec3>>; 2],
    /// RMS second difference over time, divided by that of the truth.
    pub(super) jitter_ratio: f64,
    /// Animator states with the frames after which they were recorded.
    pub(super) moments: Vec<(usize, AnimatorState)>,
}

impl ClipRun {
    /// Runs over a clip and records it.
    pub(super) fn record(runner: &mut Runner, captured: CapturedClip) -> Result<Self> {
        let (clip, garment) = (&captured.clip, &captured.garment);
        let vertices = spread(garment.vertex_count());
        let moment_frames = moment_frames(clip.len(), clip.fps);
        let mut skinned = SkinnedGarment::new(runner.capture);
        let (mut errors, mut displacements, mut moments) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let mut jitter = Jitter::default();
        let start = Start::Positions(garment.frame(0));
        runner.run(clip, 0..clip.len(), start, &mut |frame, animator| {
            let (predicted, truth) = (animator.garment().positions, garment.frame(frame));
            errors.push(SquaredErrors::between(predicted, truth));
            skinned.pose(&clip.poses[frame]);
            for (kept, world) in displacements.iter_mut().zip([predicted, truth]) {
                let of = |&vertex: &usize| skinned.displacement(vertex, world[vertex]);
                kept.push(vertices.iter().map(of).collect());
            }
            // Frame 0 is given and no prediction.
            if frame > 0 {
                jitter.add([predicted, truth]);
            }
            if moment_frames.contains(&frame) {
                moments.push((frame, animator.state().clone()));
            }
        })?;
        let jitter_ratio = ratio(jitter.squared);
        Ok(Self {
            captured,
            errors,
            displacements,
            jitter_ratio,
            moments,
        })
    }
}

/// Returns evenly spread vertex indices.
fn spread(vertices: usize) -> Vec<usize> {
    let count = vertices.min(VERTICES);
    (0..count).map(|k| k * vertices / count).collect()
}

/// Returns evenly spread frames with at least a second before and three seconds after each.
fn moment_frames(len: usize, fps: f32) -> Vec<usize> {
    let at = |seconds: f32| (seconds * fps).round() as usize;
    let (first, last) = (at(1.0), len.saturating_sub(at(3.0) + 1));
    if last < first {
        return Vec::new();
    }
    // Moments lie in the middles of equal parts of the usable time.
    let count = ((last - first) / at(MOMENT_S) + 1).min(MOST_MOMENTS);
    (0..count)
        .map(|k| first + (last - first) * (2 * k + 1) / (2 * count))
        .collect()
}

/// Sums of squared second differences of prediction and truth, from frame 3 on as in
/// [`crate::Metrics`].
#[derive(Default)]
struct Jitter {
    /// Last two frames of prediction and truth, the later first.
    before: [[Vec<Vec3>; 2]; 2],
    /// Sums of prediction and truth, m².
    squared: [f64; 2],
}

impl Jitter {
    /// Adds one frame of prediction and truth.
    fn add(&mut self, now: [&[Vec3]; 2]) {
        for ((before, now), squared) in self.before.iter_mut().zip(now).zip(&mut self.squared) {
            if before[1].len() == now.len() {
                *squared += second_difference(now, &before[0], &before[1]);
            }
            before.swap(0, 1);
            before[0].clear();
            before[0].extend_from_slice(now);
        }
    }
}
