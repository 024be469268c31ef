//! States: outputs of a tick that are inputs of the next one.

use super::{
    Axis::{Fixed, Joints, Masses, Motion, Recurrence, Vertices},
    Port, Role,
};

/// Positions of the joints in the last frame.
pub(crate) const JOINT_POSITIONS: Port = Port {
    name: "joint_positions",
    shape: &[Joints, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "world position of each joint",
};
/// Rotations of the joints in the last frame.
pub(crate) const JOINT_ROTATIONS: Port = Port {
    name: "joint_rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::State,
    unit: "",
    meaning: "world rotation of each joint: unit quaternions x, y, z, w",
};
/// Heading of the character.
pub(crate) const YAW: Port = Port {
    name: "yaw",
    shape: &[Fixed(1), Fixed(1)],
    role: Role::State,
    unit: "rad",
    meaning: "heading of the character about +Y; at 0 it faces +Z",
};
/// Rotation of the sequence frame.
pub(crate) const SEQUENCE_ROTATION: Port = Port {
    name: "sequence_rotation",
    shape: &[Fixed(1), Fixed(4)],
    role: Role::State,
    unit: "",
    meaning: "world rotation of the root joint in the first frame: a unit quaternion x, y, z, w",
};
/// Origin of the sequence frame.
pub(crate) const SEQUENCE_ORIGIN: Port = Port {
    name: "sequence_origin",
    shape: &[Fixed(1), Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "world position of the root joint in the first frame",
};
/// Offsets of the masses on springs.
pub(crate) const SPRING_OFFSETS: Port = Port {
    name: "spring_offsets",
    shape: &[Masses, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "offset of each mass on a spring from its joint, in the axes of the world",
};
/// Velocities of the masses on springs.
pub(crate) const SPRING_VELOCITIES: Port = Port {
    name: "spring_velocities",
    shape: &[Masses, Fixed(3)],
    role: Role::State,
    unit: "m/s",
    meaning: "velocity of each mass on a spring, in the axes of the world",
};
/// Normalised motion vector of the last frame.
pub(crate) const MOTION: Port = Port {
    name: "motion",
    shape: &[Fixed(1), Motion],
    role: Role::State,
    unit: "",
    meaning: "motion vector, normalised",
};
/// State of the prior's recurrence.
pub(crate) const RECURRENCE: Port = Port {
    name: "recurrence",
    shape: &[Fixed(1), Recurrence],
    role: Role::State,
    unit: "",
    meaning: "oscillators of the prior: all real parts, then all imaginary parts",
};
/// Displacements of the vertices.
pub(crate) const DISPLACEMENT: Port = Port {
    name: "displacement",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "displacement of each vertex from the prior, in its rotated frame",
};
/// Displacements one frame earlier.
pub(crate) const DISPLACEMENT_BEFORE: Port = Port {
    name: "displacement_before",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "displacement one tick earlier",
};
/// Positions relative to the root joint.
pub(crate) const ROOT_RELATIVE: Port = Port {
    name: "root_relative",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "position of each vertex relative to the root joint, in the frame of the motion vector",
};
/// Skinned rest positions of the last frame.
pub(crate) const SKINNED_BEFORE: Port = Port {
    name: "skinned_before",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "skinned positions of the tick before",
};
