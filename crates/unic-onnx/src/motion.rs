//! Motion vector ([`unic_core::motion`]) as a part of a graph.

use crate::{
    graph::{Graph, Value},
    heading::{self, rotation_vector, turn_between},
    kinematics::{Joints, forward_kinematics},
    port::{
        GROUND_HEIGHT, JOINT_POSITIONS, JOINT_ROTATIONS, MOTION, NEXT_KNOWN, NEXT_ROOT, NEXT_ROTATIONS, ROOT,
        ROTATIONS, SEQUENCE_ORIGIN, SEQUENCE_ROTATION, WIND, YAW,
    },
};
use unic_core::{
    Model,
    motion::{
        CONTACT_HEIGHT_M, CONTACT_SPEED_M_S, MotionLayout, PAPER_CONTACT_STEP_SQUARED_M2, VelocityScheme,
    },
    skeleton::Skeleton,
};

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
}

/// State that the coordinate frame of the vectors follows from.
#[derive(Clone, Copy)]
enum FrameState {
    /// The sequence frame: rotation (1, 4), and the origin (1, 3) where the layout reads it.
    Sequence { rotation: Value, origin: Option<Value> },
    /// The heading frame: yaw (1, 1).
    Heading { yaw: Value },
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
        let vector = builder.vector(graph, pose, frame, step, rotation);
        Self {
            joints: pose.joints,
            pair: graph.concat(&[previous_vector, vector], 1),
            frame_rotation: rotation,
            vector,
            frame,
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
        let vector = builder.vector(graph, pose, frame, step, velocity_rotation);
        Self {
            joints: pose.joints,
            pair: graph.concat(&[vector, vector], 1),
            frame_rotation: frame.rotation(graph),
            vector,
            frame,
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

impl FrameState {
    fn start(graph: &mut Graph, model: &Model, joints: Joints) -> Self {
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
    fn advanced(graph: &mut Graph, model: &Model, step: Step) -> Self {
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

    fn turned(self, graph: &mut Graph, model: &Model, step: Step) -> Self {
        let Self::Heading { yaw } = self else { return self };
        let skeleton = &model.character().skeleton;
        let roots = [step.from, step.to].map(|joints| joints.root_rotation(graph, skeleton));
        let dt = 1.0 / model.config().fps;
        Self::Heading {
            yaw: heading::advance(graph, yaw, roots, dt),
        }
    }

    /// Rotation (1, 4) of the frame.
    fn rotation(self, graph: &mut Graph) -> Value {
        match self {
            Self::Sequence { rotation, .. } => rotation,
            Self::Heading { yaw } => graph.rotation_about_y(yaw),
        }
    }
}

/// Parts of a motion vector for one model.
struct VectorBuilder<'a> {
    model: &'a Model,
}

impl VectorBuilder<'_> {
    /// Normalised motion vector (1, D) of a pose. Velocities are those of `step`, in the frame with
    /// the rotation `velocity_rotation` (1, 4).
    fn vector(
        &self,
        graph: &mut Graph,
        pose: PosedJoints,
        frame: FrameState,
        step: Step,
        velocity_rotation: Value,
    ) -> Value {
        let [root_position, orientations, positions] = self.positions(graph, pose, frame);
        let [root_velocity, turn, velocities] = self.velocities(graph, step, velocity_rotation);
        let contacts = self.contacts(graph, pose.joints, step);
        // The order of `MotionSlices`.
        let [root_orientation, joint_rotations] = orientations_of(graph, orientations);
        let parts = [
            root_position,
            root_velocity,
            root_orientation,
            turn,
            joint_rotations,
            positions,
            velocities,
            contacts,
        ];
        let parts = parts.map(|part| graph.reshape(part, &[1, -1]));
        let vector = graph.concat(&parts, 1);
        self.normalised(graph, vector)
    }

    /// Root position (1, 3), matrices (J, 9) of the root's orientation and then the other joints'
    /// local rotations, and the other joints' positions (J − 1, 3).
    fn positions(&self, graph: &mut Graph, pose: PosedJoints, frame: FrameState) -> [Value; 3] {
        let skeleton = &self.model.character().skeleton;
        let root = pose.joints.root_position(graph, skeleton);
        let rotation = frame.rotation(graph);
        let matrix = graph.matrices(rotation);
        let origin = match frame {
            FrameState::Sequence {
                origin: Some(origin), ..
            } => origin,
            _ => root,
        };
        let root_position = match self.model.config().motion.layout {
            MotionLayout::Paper => {
                let offset = graph.sub(root, origin);
                graph.unrotated_together(matrix, offset)
            }
            MotionLayout::PaperRootRelative => graph.constant(&[1, 3], &[0.0; 3]),
            MotionLayout::Heading => {
                let ground = graph.input(GROUND_HEIGHT);
                let over_ground = graph.sub(root, ground);
                let up = graph.constant(&[1, 3], &[0.0, 1.0, 0.0]);
                graph.mul(over_ground, up)
            }
        };
        let root_rotation = pose.joints.root_rotation(graph, skeleton);
        let orientation = turn_from_frame(graph, rotation, root_rotation);
        let others = other_joints(skeleton);
        let local = graph.take(pose.rotations, &others, 0);
        let rotations = graph.concat(&[orientation, local], 0);
        let rotations = graph.matrices(rotations);
        let others = graph.take(pose.joints.positions, &others, 0);
        let offsets = graph.sub(others, origin);
        let positions = graph.unrotated_together(matrix, offsets);
        [root_position, rotations, positions]
    }

    /// Velocity (1, 3) and angular velocity (1, 3) of the root, and velocities (J − 1, 3) of the
    /// other joints.
    fn velocities(&self, graph: &mut Graph, step: Step, rotation: Value) -> [Value; 3] {
        let skeleton = &self.model.character().skeleton;
        let dt = 1.0 / self.model.config().fps;
        let matrix = graph.matrices(rotation);
        let wind = graph.input(WIND);
        let drift = graph.scale(wind, dt);
        let moved = graph.sub(step.to.positions, step.from.positions);
        let in_air = graph.sub(moved, drift);
        let in_frame = graph.unrotated_together(matrix, in_air);
        let velocities = graph.scale(in_frame, self.rate());
        let [from, to] = [step.from, step.to].map(|joints| joints.root_rotation(graph, skeleton));
        let turn = turn_between(graph, from, to);
        let turn = rotation_vector(graph, turn);
        let turn = graph.unrotated_together(matrix, turn);
        [
            graph.take(velocities, &[skeleton.root() as i64], 0),
            graph.scale(turn, self.rate()),
            graph.take(velocities, &other_joints(skeleton), 0),
        ]
    }

    /// Contacts (4, 1) with the ground, 0 or 1.
    fn contacts(&self, graph: &mut Graph, joints: Joints, step: Step) -> Value {
        let spec = &self.model.config().motion;
        let indices = spec.contact_joints.map(|joint| joint as i64);
        let moved = graph.sub(step.to.positions, step.from.positions);
        let moved = graph.take(moved, &indices, 0);
        let squared = graph.squared_lengths(moved);
        if spec.layout != MotionLayout::Heading {
            let is_slow = graph.is_below(squared, PAPER_CONTACT_STEP_SQUARED_M2);
            return graph.zero_or_one(is_slow);
        }
        let length = graph.map("Sqrt", squared);
        let speed = graph.scale(length, self.rate());
        let is_slow = graph.is_below(speed, CONTACT_SPEED_M_S);
        let positions = graph.take(joints.positions, &indices, 0);
        let heights = graph.slice(positions, 1, 2, 1);
        let ground = graph.input(GROUND_HEIGHT);
        let heights = graph.sub(heights, ground);
        let limits = spec.contact_rest_heights_m.map(|rest| rest + CONTACT_HEIGHT_M);
        let limits = graph.constant(&[4, 1], &limits);
        let is_low = graph.less(heights, limits);
        let [slow, low] = [is_slow, is_low].map(|condition| graph.zero_or_one(condition));
        graph.mul(slow, low)
    }

    fn normalised(&self, graph: &mut Graph, vector: Value) -> Value {
        let normalisation = self.model.normalisation();
        let shape = [1, normalisation.mean.len()];
        let mean = graph.constant(&shape, &normalisation.mean);
        let std = graph.constant(&shape, &normalisation.std);
        let centred = graph.sub(vector, mean);
        let scaled = graph.div(centred, std);
        match normalisation.limit {
            Some(limit) => graph.clamp(scaled, limit),
            None => scaled,
        }
    }

    /// Factor from differences between frames to the layout's unit of velocity.
    fn rate(&self) -> f32 {
        match self.model.config().motion.layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => 1.0,
            MotionLayout::Heading => self.model.config().fps,
        }
    }
}

/// Rotation (1, 4) of the root relative to a frame's.
fn turn_from_frame(graph: &mut Graph, frame: Value, root: Value) -> Value {
    let inverse = graph.conjugate(frame);
    graph.product(inverse, root)
}

/// First two rows of rotation matrices (J, 9): of the first one (1, 6), and of the others
/// (J − 1, 6).
fn orientations_of(graph: &mut Graph, matrices: Value) -> [Value; 2] {
    let joints = graph.sizes().joints;
    let rows = graph.slice(matrices, 0, 6, 1);
    [graph.slice(rows, 0, 1, 0), graph.slice(rows, 1, joints, 0)]
}

/// All joints but the root, in the skeleton's order.
fn other_joints(skeleton: &Skeleton) -> Vec<i64> {
    let root = skeleton.root();
    (0..skeleton.len())
        .filter(|&joint| joint != root)
        .map(|joint| joint as i64)
        .collect()
}
