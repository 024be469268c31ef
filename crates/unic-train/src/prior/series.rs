//! Clips as series of motion vectors and principal components, with their mirror images.

use crate::{
    dataset::MotionVectors,
    mirror::{View, mirrored, mirrored_surface},
    recurrence::Sequence,
    regression::Pairs,
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

/// Number of frames whose displacements are projected at once, which bounds memory.
const ROWS: usize = 64;

/// Consecutive frames of one clip in one view, with the components of the true displacement.
pub(super) struct Series<'a> {
    motion: &'a MotionVectors,
    view: View,
    /// Frames of the clip.
    frames: Range<usize>,
    /// Principal components of the displacement, frames × K.
    components: Vec<f64>,
    /// Number of the motion. A series, its mirror image and the same motion in another wind share
    /// it.
    motion_number: usize,
}

/// Clips that series are made of.
pub(super) struct Clips<'a, 'c> {
    pub(super) set: &'c TrainingSet,
    /// Motion vectors of each clip.
    pub(super) motion: &'a [MotionVectors],
    pub(super) components: &'c PrincipalComponents,
}

impl<'a> Clips<'a, '_> {
    /// Makes a series of every clip, then of every mirrored one where skeleton and garment are
    /// symmetric. A lone clip is cut into `pieces`, each of which counts as a motion.
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
            // Without the mask: `reflected` applies the share of the mirrored place.
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

    /// Displacements of the mirrored garment, scaled by the mask at the mirrored place.
    fn reflected(&self, map: &SurfaceMap, whole: &[Vec3]) -> Result<Vec<Vec3>, SurfaceMapError> {
        let mut there = Vec::new();
        map.interpolate_vectors(whole, &mut there)?;
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

    /// Cuts the series into at most `count` consecutive pieces, each numbered as a motion of its
    /// own.
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

    /// Pairs of motion vectors, frames × 2 D. Frame 0 of a clip is paired with itself.
    fn inputs(&self) -> Vec<f64> {
        let pair = |t: usize| {
            let both = [t.saturating_sub(1), t].map(|t| self.motion.frame(t, self.view));
            both.into_iter().flatten().copied().map(f64::from)
        };
        self.frames.clone().flat_map(pair).collect()
    }

    /// Subtracts K constants from the components of every frame.
    fn subtract(&mut self, by: &[f64]) {
        for frame in self.components.chunks_mut(by.len().max(1)) {
            frame.iter_mut().zip(by).for_each(|(c, by)| *c -= by);
        }
    }

    /// Components that a linear map predicts, frames × K.
    fn predicted(&self, map: Option<&LinearMap>) -> Vec<f64> {
        // Without a second motion there is no map. The components are about their mean, which is
        // zero.
        map.map_or_else(
            || vec![0.0; self.components.len()],
            |m| m.apply_rows(&self.inputs()),
        )
    }

    /// Components minus those that a linear map predicts, frames × K.
    fn residual(&self, map: Option<&LinearMap>) -> impl Iterator<Item = f64> {
        let predicted = self.predicted(map).into_iter();
        self.components.iter().zip(predicted).map(|(c, p)| c - p)
    }

    /// Makes the sequence that a recurrence is trained on beside a linear map.
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

impl Pairs for Series<'_> {
    fn motion_number(&self) -> usize {
        self.motion_number
    }

    fn moments(&self) -> Moments {
        Moments::new(&self.inputs(), &self.components, self.len())
    }

    fn squared_error(&self, map: Option<&LinearMap>) -> f64 {
        self.residual(map).map(|e| e * e).sum()
    }
}

/// Rounds of [`remove_mirror_bias`]. The second changes a thousandth of what the first does.
const ROUNDS: usize = 2;

/// Removes from the mirrored series their constant difference from the direct ones.
///
/// Cloth settles and sticks a little to one side, the same in every clip: by 8 mm a vertex for the
/// built-in T-shirt. Mirrored motion teaches how the garment moves. It must not teach this bias, or
/// the garment would be half as biased to both sides.
pub(super) fn remove_mirror_bias(series: &mut [Series], strength: f64) {
    for _ in 0..ROUNDS {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let map = Moments::pooled(moments.iter()).and_then(|m| m.solve(strength));
        let [direct, mirrored] =
            [View::Direct, View::Mirrored].map(|view| mean_residual(series, view, map.as_ref()));
        let bias: Vec<f64> = mirrored.iter().zip(direct).map(|(m, d)| m - d).collect();
        (series.iter_mut().filter(|s| s.view == View::Mirrored)).for_each(|s| s.subtract(&bias));
    }
}

/// Mean residual over all frames of a view: K numbers, or none without a frame.
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

/// Principal components, frames × K, of the displacements that `of_frame` returns.
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

/// Displacements of a frame in the vertices' rotated frames, in metres, scaled by the garment's
/// mask.
pub fn displacements(garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    let world = clip.captured.garment.frame(frame).iter().enumerate();
    world
        .map(|(v, x)| PointFrame::new(garment, v, world_from_rest).blended_displacement(*x))
        .collect()
}
