//! Coordinate frame of the motion vectors.

use super::Step;
use crate::{
    graph::{Graph, Value},
    heading,
    kinematics::Joints,
    port::{SEQUENCE_ORIGIN, SEQUENCE_ROTATION, YAW},
};
use unic_core::{Model, motion::MotionLayout};

/// State that the coordinate frame of the vectors follows from.
#[derive(Clone, Copy)]
pub(super) enum FrameState {
    /// The sequence frame: rotation (1, 4), and the origin (1, 3) where the layout reads it.
    Sequence { rotation: Value, origin: Option<Value> },
    /// The heading frame: yaw (1, 1).
    Heading { yaw: Value },
}

impl FrameState {
    pub(super) fn start(graph: &mut Graph, model: &Model, joints: Joints) -> Self {
        let skeleton = &model.character().skeleton;
        let rotation = joints.root_rotation(graph, skeleton);
        match model.config().motion.layout {
            MotionLayout::Heading => Self::Heading {
                yaw: heading::start(graph, rotation),
            },
            MotionLayout::Paper => Self::Sequence {
                rotation,
                origin: Some(joints.root_position(graph, skeleton)),
            },
            MotionLayout::PaperRootRelative => Self::Sequence {
                rotation,
                origin: None,
            },
        }
    }

    /// The state of the inputs, advanced by a step of the pose.
    pub(super) fn advanced(graph: &mut Graph, model: &Model, step: Step) -> Self {
        let state = match model.config().motion.layout {
            MotionLayout::Heading => Self::Heading {
                yaw: graph.input(YAW),
            },
            MotionLayout::Paper => Self::Sequence {
                rotation: graph.input(SEQUENCE_ROTATION),
                origin: Some(graph.input(SEQUENCE_ORIGIN)),
            },
            MotionLayout::PaperRootRelative => Self::Sequence {
                rotation: graph.input(SEQUENCE_ROTATION),
                origin: None,
            },
        };
        state.turned(graph, model, step)
    }

    pub(super) fn turned(self, graph: &mut Graph, model: &Model, step: Step) -> Self {
        let Self::Heading { yaw } = self else { return self };
        let skeleton = &model.character().skeleton;
        let roots = [step.from, step.to].map(|joints| joints.root_rotation(graph, skeleton));
        let dt = 1.0 / model.config().fps;
        Self::Heading {
            yaw: heading::advance(graph, yaw, roots, dt),
        }
    }

    /// Rotation (1, 4) of the frame.
    pub(super) fn rotation(self, graph: &mut Graph) -> Value {
        match self {
            Self::Sequence { rotation, .. } => rotation,
            Self::Heading { yaw } => graph.rotation_about_y(yaw),
        }
    }
}
