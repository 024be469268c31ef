//! Motion vector ([`unic_core::motion`]) as a part of a graph.

mod frame;
mod springs;
mod vector;

use crate::{
    graph::{Graph, Value},
    kinematics::{Joints, forward_kinematics},
    port::{
        JOINT_POSITIONS, JOINT_ROTATIONS, MOTION, NEXT_KNOWN, NEXT_ROOT, NEXT_ROTATIONS, ROOT, ROTATIONS,
        SEQUENCE_ORIGIN, SEQUENCE_ROTATION, SPRING_OFFSETS, SPRING_VELOCITIES, YAW,
    },
};
use frame::FrameState;
use springs::{Masses, SpringBuilder};
use unic_core::{Model, motion::VelocityScheme, skeleton::Skeleton};
use vector::VectorBuilder;

/// Motion of one frame.
pub(crate) struct Motion {
    /// Joints of this frame.
    pub(crate) joints: Joints,
    /// Normalised motion vectors of the last frame and of this one (1, 2 D).
    pub(crate) pair: Value,
    /// Rotation of the vector's frame (1, 4).
    pub(crate) frame_rotation: Value,
    /// Normalised motion vector of this frame (1, D).
    vector: Value,
    frame: FrameState,
    /// Masses on springs, if the model has some.
    masses: Option<Masses>,
}

/// Pose with its joints.
#[derive(Clone, Copy)]
struct PosedJoints {
    /// Local rotations (J, 4).
    rotations: Value,
    joints: Joints,
}

/// Joints between which velocities are differences.
#[derive(Clone, Copy)]
struct Step {
    from: Joints,
    to: Joints,
}

/// Movement to a frame.
#[derive(Clone, Copy)]
struct Moved {
    /// Joints whose difference is a velocity.
    step: Step,
    /// Masses after the movement.
    masses: Option<Masses>,
}

impl Motion {
    /// Advances the motion by one tick to the pose of the inputs.
    pub(crate) fn advance(graph: &mut Graph, model: &Model) -> Self {
        graph.scope("motion");
        let skeleton = &model.character().skeleton;
        let previous = Joints {
            positions: graph.input(JOINT_POSITIONS),
            rotations: graph.input(JOINT_ROTATIONS),
        };
        let previous_vector = graph.input(MOTION);
        let pose = pose_of_inputs(graph, skeleton);
        let backward = Step {
            from: previous,
            to: pose.joints,
        };
        let step = match model.config().motion.velocity {
            VelocityScheme::Backward => backward,
            VelocityScheme::Forward => forward_step(graph, skeleton, backward),
        };
        let frame = FrameState::advanced(graph, model, backward);
        let builder = VectorBuilder { model };
        let rotation = frame.rotation(graph);
        let masses = SpringBuilder { model }.advance(graph, backward);
        let moved = Moved { step, masses };
        let vector = builder.vector(graph, pose, frame, moved, rotation);
        Self {
            joints: pose.joints,
            pair: graph.concat(&[previous_vector, vector], 1),
            frame_rotation: rotation,
            vector,
            frame,
            masses,
        }
    }

    /// Motion of the first frame, whose velocities are those to the second pose. Both vectors of
    /// the pair are the same.
    pub(crate) fn start(graph: &mut Graph, model: &Model) -> Self {
        graph.scope("motion");
        let skeleton = &model.character().skeleton;
        let pose = pose_of_inputs(graph, skeleton);
        let step = Step {
            from: pose.joints,
            to: next_joints(graph, skeleton),
        };
        let frame = FrameState::start(graph, model, pose.joints);
        // Backward differences belong to the second frame, and are in its frame.
        let velocity_rotation = match model.config().motion.velocity {
            VelocityScheme::Forward => frame.rotation(graph),
            VelocityScheme::Backward => {
                let second = frame.turned(graph, model, step);
                second.rotation(graph)
            }
        };
        let builder = VectorBuilder { model };
        let masses = SpringBuilder { model }.start(graph, step);
        let moved = Moved { step, masses };
        let vector = builder.vector(graph, pose, frame, moved, velocity_rotation);
        Self {
            joints: pose.joints,
            pair: graph.concat(&[vector, vector], 1),
            frame_rotation: frame.rotation(graph),
            vector,
            frame,
            masses,
        }
    }

    /// Declares the state after the tick as outputs.
    pub(crate) fn output_state(&self, graph: &mut Graph) {
        graph.output(JOINT_POSITIONS, self.joints.positions);
        graph.output(JOINT_ROTATIONS, self.joints.rotations);
        match self.frame {
            FrameState::Heading { yaw } => graph.output(YAW, yaw),
            FrameState::Sequence { rotation, origin } => {
                graph.output(SEQUENCE_ROTATION, rotation);
                if let Some(origin) = origin {
                    graph.output(SEQUENCE_ORIGIN, origin);
                }
            }
        }
        if let Some(masses) = self.masses {
            graph.output(SPRING_OFFSETS, masses.offsets);
            graph.output(SPRING_VELOCITIES, masses.velocities);
        }
        graph.output(MOTION, self.vector);
    }
}

fn pose_of_inputs(graph: &mut Graph, skeleton: &Skeleton) -> PosedJoints {
    let (root, rotations) = (graph.input(ROOT), graph.input(ROTATIONS));
    PosedJoints {
        rotations,
        joints: forward_kinematics(graph, skeleton, root, rotations),
    }
}

fn next_joints(graph: &mut Graph, skeleton: &Skeleton) -> Joints {
    let (root, rotations) = (graph.input(NEXT_ROOT), graph.input(NEXT_ROTATIONS));
    forward_kinematics(graph, skeleton, root, rotations)
}

/// Step to the next pose, or the step from the previous one where the next is not known.
fn forward_step(graph: &mut Graph, skeleton: &Skeleton, backward: Step) -> Step {
    let next = next_joints(graph, skeleton);
    let known = graph.input(NEXT_KNOWN);
    let half = graph.scalar(0.5);
    let is_known = graph.less(half, known);
    Step {
        from: Joints::choose(graph, is_known, backward.to, backward.from),
        to: Joints::choose(graph, is_known, next, backward.to),
    }
}
