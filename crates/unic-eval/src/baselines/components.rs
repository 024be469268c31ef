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
use unic_core::{
    character::Garment,
    motion::{Normalisation, NormalisationRule, NormalisedElements},
};

/// Principal components of the displacement.
pub const COMPONENTS: usize = 60;

/// Most frames that the components are computed from, evenly spread over the training clips; their
/// mean and the regression see every frame. The cost grows with the square of this number, the
/// components hardly change: neighbouring frames are alike.
pub const MOST_GRAM_FRAMES: usize = 2000;

/// Every number of the motion vector is scaled, rotations and contacts included. The least standard
/// deviation that an input is divided by is in its own unit: m, m/s, rad/s or 1.
///
/// An input that training hardly moves, such as the wrist's rotation in a run, would otherwise be
/// blown up by a new motion: on the T-shirt in the shared data ridge then errs by 120 mm and more.
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

/// One clip as the regressions see it.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Of frames 1, 2, ...: P numbers each.
    pub(super) inputs: Vec<Vec<f64>>,
    /// Components of frames 0, 1, ...: K numbers each, metres.
    pub(super) components: Vec<Vec<f64>>,
    /// Number of the motion, see [`TrainingSet::motions`].
    pub(super) motion: usize,
}

/// All clips that a regression may look at.
#[derive(Clone, Debug, Default)]
pub(super) struct SeriesSet {
    /// To fit.
    pub(super) train: Vec<Series>,
    /// To choose the strength by; may be empty.
    pub(super) validation: Vec<Series>,
}

fn input_scale(set: &TrainingSet) -> Normalisation {
    let joints = set.train.first().map_or(0, |clip| clip.kinematics.joints());
    let frames = set.frames();
    let vectors = frames
        .iter()
        .map(|f| set.train[f.clip].kinematics.motion(f.frame));
    // Clips are read with finite poses alone; without statistics the inputs stay as they are.
    Normalisation::fit(joints, INPUT_SCALE, vectors).unwrap_or_else(|_| Normalisation::identity(joints))
}

impl ComponentModel {
    /// Fits components and scale.
    pub fn fit(set: &TrainingSet) -> Self {
        let frames = set.spread_frames(MOST_GRAM_FRAMES);
        Self {
            garment: Arc::new(set.garment.clone()),
            components: PrincipalComponents::fit(&Displacements { set, frames }, COMPONENTS),
            scale: input_scale(set),
        }
    }

    /// (c_{t−1}, c_t), standardised.
    pub(super) fn inputs(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        let both = [frame - 1, frame].map(|t| clip.kinematics.motion(t));
        let scaled = |c: &[f32]| {
            let mut c = c.to_vec();
            self.scale.apply(&mut c);
            c.into_iter().map(f64::from)
        };
        both.into_iter().flat_map(scaled).collect()
    }

    /// Components of the true displacement.
    pub(super) fn truth(&self, clip: &PreparedClip, frame: usize) -> Vec<f64> {
        self.components
            .project(&displacements(&self.garment, clip, frame))
    }

    fn series(&self, clip: &PreparedClip, motion: usize) -> Series {
        let frames = 0..clip.len();
        Series {
            inputs: (1..clip.len()).map(|t| self.inputs(clip, t)).collect(),
            components: frames.into_par_iter().map(|t| self.truth(clip, t)).collect(),
            motion,
        }
    }

    /// Reads every frame once.
    pub(super) fn series_set(&self, set: &TrainingSet) -> SeriesSet {
        let train = set.train.iter().zip(set.motions());
        SeriesSet {
            train: train.map(|(clip, motion)| self.series(clip, motion)).collect(),
            validation: set.validation.iter().map(|clip| self.series(clip, 0)).collect(),
        }
    }
}
