//! Conversion between the states of vertices and their world positions.

use super::{state::VertexState, tiles::for_each_tile};
use crate::{
    config::StateConfig,
    features::{PointHistory, StateFrame},
    model::Model,
    sampling::{InterpolationRow, Sampling},
    transform::Rigid,
};
use glam::Vec3;

/// The [`StateFrame`]s of all vertices in one frame of the motion.
pub(super) enum StateFrames<'a> {
    /// States are positions relative to the root joint, by this `world_from_state`.
    RootRelative(Rigid),
    /// States are displacements from those of the prior, in each vertex's own frame.
    Displacement {
        histories: &'a [PointHistory],
        prior: &'a [Vec3],
    },
}

impl<'a> StateFrames<'a> {
    pub(super) fn new(
        model: &Model,
        histories: &'a [PointHistory],
        prior: &'a [Vec3],
        world_from_state: Rigid,
    ) -> Self {
        match model.config.state {
            StateConfig::RootRelative => Self::RootRelative(world_from_state),
            StateConfig::Displacement(_) => Self::Displacement { histories, prior },
        }
    }

    /// Returns the frame of one vertex.
    pub(super) fn of(&self, vertex: usize) -> StateFrame {
        match self {
            Self::RootRelative(frame) => StateFrame::of_position(*frame),
            Self::Displacement { histories, prior } => {
                StateFrame::of_displacement(histories[vertex].now, prior[vertex])
            }
        }
    }
}

/// Interpolation of sampled states over the garment.
///
/// It interpolates displacements from skinning in the vertices' own rotated frames, whatever the
/// state is: these vary smoothly over the garment, which positions under a bent joint do not.
pub(super) enum SampleInterpolation<'a> {
    /// States are such displacements already.
    Direct,
    /// States are positions relative to the root joint, which are converted and back.
    ThroughSkinning {
        histories: &'a [PointHistory],
        world_from_state: Rigid,
    },
}

impl<'a> SampleInterpolation<'a> {
    pub(super) fn new(model: &Model, histories: &'a [PointHistory], world_from_state: Rigid) -> Self {
        match model.config.state {
            StateConfig::Displacement(_) => Self::Direct,
            StateConfig::RootRelative => Self::ThroughSkinning {
                histories,
                world_from_state,
            },
        }
    }

    /// Writes the new states of all vertices from those of the samples.
    ///
    /// `sampled` is converted to displacements on the way.
    pub(super) fn interpolate(
        &self,
        histories: &[PointHistory],
        sampling: &Sampling,
        sampled: &mut [VertexState],
        vertices: &mut [VertexState],
    ) {
        for (sample, &vertex) in sampled.iter_mut().zip(sampling.samples()) {
            sample.value = self.displacement(vertex as usize, sample.value);
        }
        let (sampled, rows) = (&*sampled, sampling.rows());
        for_each_tile(vertices, |first, tile| {
            for (vertex, state) in (first..).zip(tile) {
                let InterpolationRow { samples, weights } = rows[vertex];
                let shares = samples.map(|s| histories[sampling.samples()[s as usize] as usize].now.share);
                let scale = mask_scale(histories[vertex].now.share, &shares, &weights);
                let sum = (samples.iter().zip(weights))
                    // Summed in the fixed order of the row.
                    .fold(Vec3::ZERO, |sum, (&s, w)| sum + sampled[s as usize].value * w);
                *state = VertexState {
                    value: self.state(vertex, sum * scale),
                    previous: state.value,
                };
            }
        });
    }

    /// Converts a state to a displacement from skinning.
    fn displacement(&self, vertex: usize, state: Vec3) -> Vec3 {
        match self {
            Self::Direct => state,
            Self::ThroughSkinning {
                histories,
                world_from_state,
            } => histories[vertex].now.displacement(world_from_state.point(state)),
        }
    }

    /// Converts a displacement from skinning to a state.
    fn state(&self, vertex: usize, displacement: Vec3) -> Vec3 {
        match self {
            Self::Direct => displacement,
            Self::ThroughSkinning {
                histories,
                world_from_state,
            } => {
                let position = histories[vertex].now.position(displacement);
                StateFrame::of_position(*world_from_state).to_state(position)
            }
        }
    }
}

/// Factor for a displacement that is interpolated between samples.
///
/// The mask has scaled the samples by `shares`. The factor reduces their mean to the vertex's own
/// `share`, and to zero where that is zero. It is never above 1: a division by a small interpolated
/// share would enlarge errors.
fn mask_scale(share: f32, shares: &[f32], weights: &[f32]) -> f32 {
    let interpolated: f32 = shares.iter().zip(weights).map(|(s, w)| s * w).sum();
    match share {
        1.0 => 1.0,
        0.0 => 0.0,
        share if interpolated > share => share / interpolated,
        _ => 1.0,
    }
}
