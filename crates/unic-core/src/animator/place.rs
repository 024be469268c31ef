//! Between the states of vertices and their places in the world.

use crate::{
    config::StateConfig,
    features::{Place, PointHistory},
    model::Model,
    transform::Rigid,
};
use glam::Vec3;

/// Where the states of all vertices are counted from in one frame.
pub(super) enum Places<'a> {
    /// States are positions in the frame of the motion vector.
    Frame(Rigid),
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
        world_from_frame: Rigid,
    ) -> Self {
        match model.config.state {
            StateConfig::Position => Self::Frame(world_from_frame),
            StateConfig::Displacement(_) => Self::Points { histories, prior },
        }
    }

    pub(super) fn of(&self, vertex: usize) -> Place {
        match self {
            Self::Frame(frame) => Place::in_frame(*frame),
            Self::Points { histories, prior } => Place::at_point(histories[vertex].now, prior[vertex]),
        }
    }
}
