//! Parts of a motion vector.

use super::{FrameState, Moved, PosedJoints, SpringBuilder, Step};
use crate::{
    graph::{Graph, Value},
    heading::{rotation_vector, turn_between},
    kinematics::Joints,
    port::{GROUND_HEIGHT, WIND},
};
use unic_core::{
    Model,
    motion::{CONTACT_HEIGHT_M, CONTACT_SPEED_M_S, MotionLayout, PAPER_CONTACT_STEP_SQUARED_M2},
    skeleton::Skeleton,
};

/// Parts of a motion vector for one model.
pub(super) struct VectorBuilder<'a> {
    pub(super) model: &'a Model,
}

impl VectorBuilder<'_> {
    /// Normalised motion vector (1, D) of a pose. Velocities are those of `moved`, in the frame with
    /// the rotation `velocity_rotation` (1, 4).
    pub(super) fn vector(
        &self,
        graph: &mut Graph,
        pose: PosedJoints,
        frame: FrameState,
        moved: Moved,
        velocity_rotation: Value,
    ) -> Value {
        let Moved { step, masses } = moved;
        let [root_position, orientations, positions] = self.positions(graph, pose, frame);
        let [root_velocity, turn, velocities] = self.velocities(graph, step, velocity_rotation);
        let contacts = self.contacts(graph, pose.joints, step);
        // The order of `MotionSlices`.
        let [root_orientation, joint_rotations] = orientations_of(graph, orientations);
        let mut parts = vec![
            root_position,
            root_velocity,
            root_orientation,
            turn,
            joint_rotations,
            positions,
            velocities,
            contacts,
        ];
        parts.extend(
            masses.map(|masses| SpringBuilder { model: self.model }.numbers(graph, masses, pose.joints)),
        );
        let parts: Vec<Value> = parts
            .into_iter()
            .map(|part| graph.reshape(part, &[1, -1]))
            .collect();
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
