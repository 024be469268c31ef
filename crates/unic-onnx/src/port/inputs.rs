//! Inputs from outside of the graphs: poses, surroundings, arrays of the garment.

use super::{
    Axis::{Components, Fixed, Joints, Vertices},
    Port, Role,
};

/// World position of the root joint minus its rest position.
pub(crate) const ROOT: Port = Port {
    name: "root",
    shape: &[Fixed(3)],
    role: Role::Pose,
    unit: "m",
    meaning: "world position of the root joint minus its rest position",
};
/// Local rotations of the joints.
pub(crate) const ROTATIONS: Port = Port {
    name: "rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::Pose,
    unit: "",
    meaning: "rotation of each joint relative to its parent, of the root joint relative to the world: unit quaternions x, y, z, w",
};
/// `root` of the next frame.
pub(crate) const NEXT_ROOT: Port = Port {
    name: "next_root",
    shape: &[Fixed(3)],
    role: Role::Pose,
    unit: "m",
    meaning: "root of the frame after this one",
};
/// `rotations` of the next frame.
pub(crate) const NEXT_ROTATIONS: Port = Port {
    name: "next_rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::Pose,
    unit: "",
    meaning: "rotations of the frame after this one",
};
/// Flag of a known next frame.
pub(crate) const NEXT_KNOWN: Port = Port {
    name: "next_known",
    shape: &[Fixed(1)],
    role: Role::Pose,
    unit: "",
    meaning: "1 if next_root and next_rotations are known; 0 takes backward differences and ignores them, though they must be finite",
};
/// Height of the ground.
pub(crate) const GROUND_HEIGHT: Port = Port {
    name: "ground_height",
    shape: &[Fixed(1)],
    role: Role::Surroundings,
    unit: "m",
    meaning: "height of the ground under the character, in the world",
};
/// Velocity of the air.
pub(crate) const WIND: Port = Port {
    name: "wind",
    shape: &[Fixed(3)],
    role: Role::Surroundings,
    unit: "m/s",
    meaning: "velocity of the air, in the world; zero in still air",
};
/// Rest positions.
pub(crate) const REST: Port = Port {
    name: "rest",
    shape: &[Vertices, Fixed(3)],
    role: Role::Vertices,
    unit: "m",
    meaning: "rest position of each vertex, in the space of the character's rest pose",
};
/// Dense skinning weights.
pub(crate) const SKINNING_WEIGHTS: Port = Port {
    name: "skinning_weights",
    shape: &[Vertices, Joints],
    role: Role::Vertices,
    unit: "",
    meaning: "skinning weight of each joint at each vertex; each row sums to 1",
};
/// Mask of the garment.
pub(crate) const MASK: Port = Port {
    name: "mask",
    shape: &[Vertices, Fixed(1)],
    role: Role::Vertices,
    unit: "",
    meaning: "share, 0 to 1, of a vertex's displacement from skinning",
};
/// Mean displacement.
pub(crate) const PRIOR_MEAN: Port = Port {
    name: "prior_mean",
    shape: &[Vertices, Fixed(3)],
    role: Role::Vertices,
    unit: "m",
    meaning: "mean displacement from skinning in training, in each vertex's rotated frame",
};
/// Principal components.
pub(crate) const PRIOR_SHAPES: Port = Port {
    name: "prior_shapes",
    shape: &[Vertices, Fixed(3), Components],
    role: Role::Vertices,
    unit: "m",
    meaning: "principal components of the displacement, in each vertex's rotated frame",
};
