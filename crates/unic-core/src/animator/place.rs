//! Between the states of vertices and their places in the world.

use crate::{
    config::StateConfig,
    features::{PointFrame, PointHistory},
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

/// Where the state of one vertex is counted from: world = origin + rotation · (offset + state).
pub(super) struct Place {
    frame: PointFrame,
    offset: Vec3,
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
            Self::Frame(frame) => Place {
                frame: PointFrame {
                    skinned: frame.translation,
                    rotation: frame.rotation,
                },
                offset: Vec3::ZERO,
            },
            Self::Points { histories, prior } => Place {
                frame: histories[vertex].now,
                offset: prior[vertex],
            },
        }
    }
}

impl Place {
    pub(super) fn to_world(&self, state: Vec3) -> Vec3 {
        self.frame.position(self.offset + state)
    }

    pub(super) fn to_state(&self, world: Vec3) -> Vec3 {
        self.frame.displacement(world) - self.offset
    }
}
