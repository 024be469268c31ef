//! Inputs and outputs of the regressions: standardised motion vectors, and principal components of
//! the displacement.

use super::skinning::displacements;
use crate::{
    kinematics::PreparedClip,
    pca::PrincipalComponents,
    training::{Displacements, TrainingSet},
};
use rayon::prelude::*;
use std::sync::Arc;
use unic_core::{
    character::Garment,
    motion::{Normalisation, NormalisationRule, NormalisedElements},
};

/// Number of principal components of the displacement that regressions predict.
pub const COMPONENTS: usize = 60;

/// Largest number of frames that the components are computed from, evenly spread over the training
/// clips. The mean and the regression use every frame.
///
/// The cost grows with the square of this number. More frames hardly change the components, because
/// neighbouring frames are similar.
pub const MOST_GRAM_FRAMES: usize = 2000;

/// Rule that standardises the inputs. Every element is scaled, rotations and contacts included.
///
/// `least_std` is in the unit of each element: m, m/s, rad/s or 1.
// Without a least standard deviation, an element that hardly varies in training (a wrist's rotation
// while running) becomes huge in new motion: ridge regression then errs by 120 mm and more on a
// T-shirt.
const INPUT_SCALE: NormalisationRule = NormalisationRule {
    elements: NormalisedElements::All,
    least_std: 0.02,
    limit: None,
};

/// Principal components of the garment's displacement and the scale of the motion vectors.
#[derive(Clone, Debug)]
pub struct ComponentModel {
    pub(super) garment: Arc<Garment>,
    pub(super) components: PrincipalComponents,
    scale: Normalisation,
}

/// Inputs and outputs of the regressions over one clip.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Standardised motion pairs of frames 1, 2, ..., P numbers each.
    pub(super) inputs: Vec<Vec<f64>>,
    /// True components of frames 0, 1, ..., K numbers each, metres.
    pub(super) components: Vec<Vec<f64>>,
    /// Index of the motion; see [`TrainingSet::motions`].
    pub(super) motion: usize,
}

/// Clips that a regression is fitted on.
#[derive(Clone, Debug, Default)]
pub(super) struct SeriesSet {
    /// Clips to fit.
    pub(super) train: Vec<Series>,
    /// Clips that choose the regularisation strength. May be empty.
    pub(super) validation: Vec<Series>,
}

/// Fits the scale of the inputs on all training frames.
fn input_scale(set: &TrainingSet) -> Normalisation {
    let joints = set.train.first().map_or(0, |clip| clip.kinematics.joints());
    let frames = set.frames();
    let vectors = frames
        .iter()
        .map(|f| set.train[f.clip].kinematics.motion(f.frame));
    let len = set.train.first().map_or(0, |clip| clip.kinematics.motion_len());
    // This fails for motion vectors that are not finite, which no clip that could be read has.
    Normalisation::fit(joints, len, INPUT_SCALE, vectors).unwrap_or_else(|_| Normalisation::identity(len))
}

impl ComponentModel {
    /// Fits the components and the scale of the inputs on the training clips.
    pub fn fit(set: &TrainingSet) -> Self {
        let frames = set.spread_frames(MOST_GRAM_FRAMES);
        Self {
            garment: Arc::new(set.garment.clone()),
            components: PrincipalComponents::fit(&Displacements { set, frames }, COMPONENTS),
            scale: input_scale(set),
        }
    }

    /// Returns the standardised motion pair (c_{t−1}, c_t) of frame t ≥ 1.
    pub(super) fn inputs(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        let both = [frame - 1, frame].map(|t| clip.kinematics.motion(t));
        let scaled = |c: &[f32]| {
            let mut c = c.to_vec();
            self.scale.apply(&mut c);
            c.into_iter().map(f64::from)
        };
        both.into_iter().flat_map(scaled).collect()
    }

    /// Returns the components of the true displacement of a frame, metres.
    pub(super) fn truth(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        self.components
            .project(&displacements(&self.garment, clip, frame))
    }

    /// Reads one clip, whose motion has the given index.
    fn series(&self, clip: &PreparedClip, motion: usize) -> Series {
        let frames = 0..clip.len();
        Series {
            inputs: (1..clip.len()).map(|t| self.inputs(clip, t)).collect(),
            // Each projection reads every vertex of a frame, which is enough work for a task.
            components: frames.into_par_iter().map(|t| self.truth(clip, t)).collect(),
            motion,
        }
    }

    /// Reads all clips of a training set, each frame once.
    pub(super) fn series_set(&self, set: &TrainingSet) -> SeriesSet {
        let train = set.train.iter().zip(set.motions());
        SeriesSet {
            train: train.map(|(clip, motion)| self.series(clip, motion)).collect(),
            validation: set.validation.iter().map(|clip| self.series(clip, 0)).collect(),
        }
    }
}
