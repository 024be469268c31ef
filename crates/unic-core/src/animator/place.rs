//! Between the states of vertices and their places in the world.

use super::{state::VertexState, tiles::for_each_tile};
use crate::{
    config::StateConfig,
    features::{Place, PointHistory},
    model::Model,
    sampling::{Row, Sampling},
    transform::Rigid,
};
use glam::Vec3;

/// Where the states of all vertices are counted from in one frame.
pub(super) enum Places<'a> {
    /// States are positions relative to the root joint.
    RootRelative(Rigid),
    /// States are displacements from where the prior puts each vertex, in its own frame.
    Points {
        histories: &'a [PointHistory],
        prior: &'a [Vec3],
    },
}

impl<'a> Places<'a> {
    pub(super) fn new(
        model: &Model,
        histories: &'a [PointHistory],
        prior: &'a [Vec3],
        world_from_state: Rigid,
    ) -> Self {
        match model.config.state {
            StateConfig::RootRelative => Self::RootRelative(world_from_state),
            StateConfig::Displacement(_) => Self::Points { histories, prior },
        }
    }

    pub(super) fn of(&self, vertex: usize) -> Place {
        match self {
            Self::RootRelative(frame) => Place::in_frame(*frame),
            Self::Points { histories, prior } => Place::at_point(histories[vertex].now, prior[vertex]),
        }
    }
}

/// Displacements in the vertices' own rotated frames, whatever the state is: what may be interpolated.
pub(super) enum OwnFrames<'a> {
    /// States are such displacements.
    Own,
    /// States are positions relative to the root joint, which follow from where the skeleton carries each vertex.
    RootRelative {
        histories: &'a [PointHistory],
        world_from_state: Rigid,
    },
}

impl<'a> OwnFrames<'a> {
    pub(super) fn new(model: &Model, histories: &'a [PointHistory], world_from_state: Rigid) -> Self {
        match model.config.state {
            StateConfig::Displacement(_) => Self::Own,
            StateConfig::RootRelative => Self::RootRelative {
                histories,
                world_from_state,
            },
        }
    }

    /// New states of all vertices from those of the samples, which are changed into displacements.
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
                let Row { samples, weights } = rows[vertex];
                let shares = samples.map(|s| histories[sampling.samples()[s as usize] as usize].now.share);
                let reach = reach(histories[vertex].now.share, &shares, &weights);
                let sum = (samples.iter().zip(weights))
                    .fold(Vec3::ZERO, |sum, (&s, w)| sum + sampled[s as usize].value * w);
                *state = VertexState {
                    value: self.state(vertex, sum * reach),
                    previous: state.value,
                };
            }
        });
    }

    fn displacement(&self, vertex: usize, state: Vec3) -> Vec3 {
        match self {
            Self::Own => state,
            Self::RootRelative {
                histories,
                world_from_state,
            } => histories[vertex].now.displacement(world_from_state.point(state)),
        }
    }

    fn state(&self, vertex: usize, displacement: Vec3) -> Vec3 {
        match self {
            Self::Own => displacement,
            Self::RootRelative {
                histories,
                world_from_state,
            } => Place::in_frame(*world_from_state).to_state(histories[vertex].now.position(displacement)),
        }
    }
}

/// Factor for a displacement interpolated between samples whose `shares` a mask has scaled: no more of it
/// than the vertex's own `share`, and none of it where that is zero.
fn reach(share: f32, shares: &[f32], weights: &[f32]) -> f32 {
    let interpolated: f32 = shares.iter().zip(weights).map(|(s, w)| s * w).sum();
    match share {
        1.0 => 1.0,
        0.0 => 0.0,
        share if interpolated > share => share / interpolated,
        _ => 1.0,
    }
}
