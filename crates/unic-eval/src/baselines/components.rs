//! The space that the regressions work in: principal components of the displacement against
//! standardised motion vectors.

use super::skinning::displacements;
use crate::{
    kinematics::PreparedClip,
    pca::PrincipalComponents,
    training::{Displacements, TrainingSet},
};
use rayon::prelude::*;
use std::sync::Arc;
use unic_core::character::Garment;

/// Principal components of the displacement.
pub const COMPONENTS: usize = 60;

/// Most frames that the components are computed from, evenly spread over the training clips; their
/// mean and the regression see every frame. The cost grows with the square of this number, the
/// components hardly change: neighbouring frames are alike.
pub const MOST_GRAM_FRAMES: usize = 2000;

/// Least standard deviation that an input is divided by, in its own unit: m, m/s, rad/s or 1.
///
/// An input that training hardly moves, such as the wrist's rotation in a run, would otherwise be
/// blown up by a new motion: on the T-shirt in the shared data ridge then errs by 120 mm and more.
const LEAST_DEVIATION: f64 = 0.02;

/// Standardisation of every number of the motion vector, rotations and contacts included.
#[derive(Clone, Debug)]
struct InputScale {
    mean: Vec<f64>,
    deviation: Vec<f64>,
}

/// Principal components of the garment's displacement and the scale of the motion vectors.
#[derive(Clone, Debug)]
pub struct ComponentModel {
    pub(super) garment: Arc<Garment>,
    pub(super) components: PrincipalComponents,
    scale: InputScale,
}

/// One clip as the regressions see it.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Of frames 1, 2, ...: P numbers each.
    pub(super) inputs: Vec<Vec<f64>>,
    /// Components of frames 0, 1, ...: K numbers each, metres.
    pub(super) components: Vec<Vec<f64>>,
}

/// All clips that a regression may look at.
#[derive(Clone, Debug, Default)]
pub(super) struct SeriesSet {
    /// To fit.
    pub(super) train: Vec<Series>,
    /// To choose the strength by; may be empty.
    pub(super) validation: Vec<Series>,
}

impl InputScale {
    fn fit(set: &TrainingSet) -> Self {
        let frames = set.frames();
        let vectors = || {
            frames
                .iter()
                .map(|f| set.train[f.clip].kinematics.motion(f.frame))
        };
        let len = vectors().next().map_or(0, <[f32]>::len);
        let count = frames.len().max(1) as f64;
        let mean_of = |value: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            let mut sums = vec![0.0; len];
            for c in vectors() {
                (sums.iter_mut().zip(c).enumerate()).for_each(|(i, (s, x))| *s += value(i, f64::from(*x)));
            }
            sums.into_iter().map(|s| s / count).collect()
        };
        let mean = mean_of(&|_, x| x);
        let variance = mean_of(&|i, x| (x - mean[i]).powi(2));
        let deviation = |v: f64| v.sqrt().max(LEAST_DEVIATION);
        Self {
            deviation: variance.into_iter().map(deviation).collect(),
            mean,
        }
    }

    fn apply(&self, vector: &[f32]) -> impl Iterator<Item = f64> {
        let scales = self.mean.iter().zip(&self.deviation);
        (vector.iter().zip(scales)).map(|(x, (mean, deviation))| (f64::from(*x) - mean) / deviation)
    }
}

impl ComponentModel {
    /// Fits components and scale.
    pub fn fit(set: &TrainingSet) -> Self {
        let frames = set.spread_frames(MOST_GRAM_FRAMES);
        Self {
            garment: Arc::new(set.garment.clone()),
            components: PrincipalComponents::fit(&Displacements { set, frames }, COMPONENTS),
            scale: InputScale::fit(set),
        }
    }

    /// (c_{t−1}, c_t), standardised.
    pub(super) fn inputs(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        let both = [frame - 1, frame].map(|t| clip.kinematics.motion(t));
        both.into_iter().flat_map(|c| self.scale.apply(c)).collect()
    }

    /// Components of the true displacement.
    pub(super) fn truth(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        self.components
            .project(&displacements(&self.garment, clip, frame))
    }

    fn series(&self, clip: &PreparedClip) -> Series {
        let frames = 0..clip.len();
        Series {
            inputs: (1..clip.len()).map(|t| self.inputs(clip, t)).collect(),
            components: frames.into_par_iter().map(|t| self.truth(clip, t)).collect(),
        }
    }

    /// Reads every frame once.
    pub(super) fn series_set(&self, set: &TrainingSet) -> SeriesSet {
        let all = |clips: &[PreparedClip]| clips.iter().map(|c| self.series(c)).collect();
        SeriesSet {
            train: all(&set.train),
            validation: all(&set.validation),
        }
    }
}
