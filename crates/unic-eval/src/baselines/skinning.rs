//! Baselines by linear blend skinning with a constant displacement.

use super::mean_shape::points;
use crate::{
    kinematics::PreparedClip,
    pca::mean,
    predictor::{Mode, Predictor, PredictorError},
    training::{Displacements, TrainingSet, write_displacements},
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{character::Garment, features::PointFrame, transform::Rigid};

/// Predicts x_i = LBS_i(rest) + R_i u_i with a displacement u that is constant over a clip.
#[derive(Clone, Debug)]
pub struct Skinning {
    garment: Arc<Garment>,
    displacement: Displacement,
}

/// Constant displacement of a garment.
#[derive(Clone, Debug)]
enum Displacement {
    /// No displacement: the rest shape.
    Zero,
    /// Same displacement for every clip: x, y, z of every vertex, metres.
    Fixed(Vec<f32>),
    /// Displacement of the clip's own frame 0: x, y, z of every vertex, metres.
    First(Vec<f32>),
}

impl Skinning {
    /// Skins the rest shape without displacement.
    pub fn rest(garment: &Arc<Garment>) -> Self {
        Self::new(garment, Displacement::Zero)
    }

    /// Adds the mean displacement of all training frames.
    pub fn mean(garment: &Arc<Garment>, set: &TrainingSet) -> Self {
        let frames = set.frames();
        let mean = mean(&Displacements { set, frames });
        Self::new(garment, Displacement::Fixed(mean))
    }

    /// Adds the displacement of each clip's own frame 0.
    pub fn first(garment: &Arc<Garment>) -> Self {
        Self::new(garment, Displacement::First(Vec::new()))
    }

    fn new(garment: &Arc<Garment>, displacement: Displacement) -> Self {
        Self {
            garment: Arc::clone(garment),
            displacement,
        }
    }
}

/// Returns the true displacements of a frame: x, y, z of every vertex, metres.
pub(super) fn displacements(garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<f32> {
    let mut all = vec![0.0; 3 * garment.rest.vertices.len()];
    write_displacements(garment, clip, frame, 0..all.len(), &mut all);
    all
}

/// Computes world positions from displacements (x, y, z of every vertex), metres.
pub(super) fn place(
    garment: &Garment,
    displacements: &[f32],
    world_from_rest: &[Rigid],
    positions: &mut Vec<Vec3>,
) {
    let vertices = points(displacements).enumerate();
    positions.clear();
    positions.extend(vertices.map(|(v, u)| PointFrame::new(garment, v, world_from_rest).position(u)));
}

impl Predictor for Skinning {
    fn modes(&self) -> &[Mode] {
        &[Mode::FreeRunning]
    }

    fn start(&mut self, clip: &PreparedClip, _: Mode) -> Result<(), PredictorError> {
        if let Displacement::First(first) = &mut self.displacement {
            *first = displacements(&self.garment, clip, 0);
        }
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        let Garment { rest, weights, .. } = &*self.garment;
        let world_from_rest = clip.kinematics.world_from_rest(frame);
        match &self.displacement {
            Displacement::Zero => weights.skin(&rest.vertices, world_from_rest, positions),
            Displacement::Fixed(u) | Displacement::First(u) => {
                place(&self.garment, u, world_from_rest, positions);
            }
        }
        Ok(())
    }
}
