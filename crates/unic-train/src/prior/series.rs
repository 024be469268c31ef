//! Clips as pairs of motion vectors and coefficients, and their mirror images.

use crate::{
    dataset::MotionVectors,
    mirror::{View, mirrored},
    recurrence::{Sequence, mirrored_surface},
};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use unic_core::{
    character::Garment,
    features::PointFrame,
    surface_map::{SurfaceMap, SurfaceMapError},
};
use unic_eval::{LinearMap, Moments, PreparedClip, PrincipalComponents, TrainingSet};

/// Frames whose displacements are in memory at once.
const ROWS: usize = 64;

/// Consecutive frames of one clip in one view, with the components of the true displacement.
pub(super) struct Series<'a> {
    motion: &'a MotionVectors,
    view: View,
    /// Of the clip.
    frames: Range<usize>,
    /// Frames × K.
    components: Vec<f64>,
    /// A series, its mirror image and the same motion in another wind have the same number.
    motion_number: usize,
}

/// Where series come from.
pub(super) struct Clips<'a> {
    pub(super) set: &'a TrainingSet,
    /// By clip.
    pub(super) motion: &'a [MotionVectors],
    pub(super) components: &'a PrincipalComponents,
}

impl<'a> Clips<'a> {
    /// Every clip, then every mirrored one where skeleton and garment are symmetric. A lone clip is cut
    /// into `pieces`, each of which counts as a motion.
    ///
    /// # Errors
    /// None for a set whose clips show its garment.
    pub(super) fn series(&self, pieces: usize) -> Result<Vec<Series<'a>>, SurfaceMapError> {
        let has_mirrored = self.motion.iter().all(MotionVectors::is_mirrored);
        let map = has_mirrored
            .then(|| mirrored_surface(&self.set.garment.rest))
            .flatten();
        let mut series = self.view(View::Direct, |clip, frame| {
            Ok(displacements(&self.set.garment, &self.set.train[clip], frame))
        })?;
        if let Some(map) = &map {
            let garment = &self.set.garment;
            let whole = Garment::new(garment.rest.clone(), garment.weights.clone());
            series.extend(self.view(View::Mirrored, |clip, frame| {
                self.reflected(map, &displacements(&whole, &self.set.train[clip], frame))
            })?);
        }
        Ok(match self.set.train.len() {
            1 => series.iter().flat_map(|s| s.cut(pieces)).collect(),
            _ => series,
        })
    }

    fn view(
        &self,
        view: View,
        of_frame: impl Fn(usize, usize) -> Result<Vec<Vec3>, SurfaceMapError> + Sync,
    ) -> Result<Vec<Series<'a>>, SurfaceMapError> {
        let numbers = self.set.motions();
        let clips = self.set.train.iter().enumerate();
        let series = |(clip, prepared): (usize, &PreparedClip)| {
            let frames = 0..prepared.len();
            Ok(Series {
                motion: &self.motion[clip],
                view,
                components: projected(self.components, frames.clone(), |t| of_frame(clip, t))?,
                frames,
                motion_number: numbers[clip],
            })
        };
        clips.map(series).collect()
    }

    /// The mirrored garment, under the mask of where it is then.
    fn reflected(&self, map: &SurfaceMap, whole: &[Vec3]) -> Result<Vec<Vec3>, SurfaceMapError> {
        let mut there = Vec::new();
        map.vectors(whole, &mut there)?;
        let there = there.into_iter().enumerate();
        Ok(there
            .map(|(v, u)| mirrored(u) * self.set.garment.share(v))
            .collect())
    }
}

impl<'a> Series<'a> {
    /// Number of frames.
    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    pub(super) fn view(&self) -> View {
        self.view
    }

    pub(super) fn motion_number(&self) -> usize {
        self.motion_number
    }

    /// Consecutive pieces, `count` at most, numbered as motions of their own.
    fn cut(&self, count: usize) -> impl Iterator<Item = Self> {
        let most = self.len().div_ceil(count).max(1);
        let width = self.components.len() / self.len().max(1);
        let pieces = self.frames.clone().step_by(most).enumerate();
        pieces.map(move |(motion_number, start)| {
            let frames = start..(start + most).min(self.frames.end);
            let rows = (frames.start - self.frames.start) * width..(frames.end - self.frames.start) * width;
            Self {
                motion: self.motion,
                view: self.view,
                frames,
                components: self.components[rows].to_vec(),
                motion_number,
            }
        })
    }

    /// Pairs of motion vectors: frames × 2 D; frame 0 of a clip is paired with itself.
    fn inputs(&self) -> Vec<f64> {
        let pair = |t: usize| {
            let both = [t.saturating_sub(1), t].map(|t| self.motion.frame(t, self.view));
            both.into_iter().flatten().copied().map(f64::from)
        };
        self.frames.clone().flat_map(pair).collect()
    }

    pub(super) fn moments(&self) -> Moments {
        Moments::new(&self.inputs(), &self.components, self.len())
    }

    /// Takes a constant away from the components, K numbers.
    fn shift(&mut self, by: &[f64]) {
        for frame in self.components.chunks_mut(by.len().max(1)) {
            frame.iter_mut().zip(by).for_each(|(c, by)| *c -= by);
        }
    }

    /// What a map says of every frame: frames × K.
    fn predicted(&self, map: Option<&LinearMap>) -> Vec<f64> {
        // Without another clip to fit, the mean is all that is known.
        map.map_or_else(
            || vec![0.0; self.components.len()],
            |m| m.apply_rows(&self.inputs()),
        )
    }

    /// What a map leaves of the components: frames × K.
    pub(super) fn residual(&self, map: Option<&LinearMap>) -> impl Iterator<Item = f64> {
        let predicted = self.predicted(map).into_iter();
        self.components.iter().zip(predicted).map(|(c, p)| c - p)
    }

    /// For a recurrence to learn beside a map.
    pub(super) fn sequence(&self, map: Option<&LinearMap>) -> Sequence<'a> {
        Sequence {
            motion: self.motion,
            view: self.view,
            frames: self.frames.clone(),
            coefficients: in_f32(&self.components),
            linear: in_f32(&self.predicted(map)),
            motion_number: self.motion_number,
        }
    }
}

/// Rounds of [`hang_alike`]: the second takes away a thousandth of what the first does.
const ROUNDS: usize = 2;

/// Takes from mirrored series what they hang differently by whatever the motion.
///
/// Cloth is settled and sticks a little askew, the same way in every clip: 8 mm a vertex for the built-in T-shirt.
/// What the motion does is the mirror's to teach; this is not, and would leave the garment half as askew on both sides.
pub(super) fn hang_alike(series: &mut [Series], strength: f64) {
    for _ in 0..ROUNDS {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let map = Moments::pooled(moments.iter()).and_then(|m| m.solve(strength));
        let [direct, mirrored] =
            [View::Direct, View::Mirrored].map(|view| mean_residual(series, view, map.as_ref()));
        let askew: Vec<f64> = mirrored.iter().zip(direct).map(|(m, d)| m - d).collect();
        (series.iter_mut().filter(|s| s.view == View::Mirrored)).for_each(|s| s.shift(&askew));
    }
}

/// Over all frames in a view: K numbers, none without a frame.
fn mean_residual(series: &[Series], view: View, map: Option<&LinearMap>) -> Vec<f64> {
    let (mut sum, mut frames) = (Vec::new(), 0);
    for series in series.iter().filter(|s| s.view == view) {
        let residual: Vec<f64> = series.residual(map).collect();
        let width = residual.len() / series.len().max(1);
        sum.resize(width, 0.0);
        for row in residual.chunks(width.max(1)) {
            sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        }
        frames += series.len();
    }
    sum.iter_mut().for_each(|sum| *sum /= frames.max(1) as f64);
    sum
}

fn in_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|x| *x as f32).collect()
}

/// Components (frames × K) of what `of_frame` says, read a few frames at a time.
///
/// # Errors
/// Those of `of_frame`.
fn projected<E: Send>(
    components: &PrincipalComponents,
    frames: Range<usize>,
    of_frame: impl Fn(usize) -> Result<Vec<Vec3>, E> + Sync,
) -> Result<Vec<f64>, E> {
    let starts: Vec<usize> = frames.clone().step_by(ROWS).collect();
    let piece = |start: usize| -> Result<Vec<f64>, E> {
        let mut samples = Vec::new();
        for frame in start..(start + ROWS).min(frames.end) {
            samples.extend(of_frame(frame)?.iter().flat_map(|u| u.to_array()));
        }
        Ok(components.project_rows(&samples))
    };
    let pieces: Result<Vec<Vec<f64>>, E> = starts.into_par_iter().map(piece).collect();
    Ok(pieces?.concat())
}

/// Displacements of a frame in the vertices' rotated frames as the mask leaves them, metres.
pub(crate) fn displacements(garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    let world = clip.captured.garment.frame(frame).iter().enumerate();
    world
        .map(|(v, x)| PointFrame::new(garment, v, world_from_rest).blended_displacement(*x))
        .collect()
}
