//! Values between the stages of a tick, and its result.

use super::{
    Axis::{Categories, Channels, Components, Fixed, Latent, MotionPair, Vertices},
    Port, Role,
};

/// Skinned rest positions.
pub(crate) const SKINNED: Port = Port {
    name: "skinned",
    shape: &[Vertices, Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "rest position of each vertex after linear blend skinning, in the world",
};
/// Two normalised motion vectors.
pub(crate) const MOTION_PAIR: Port = Port {
    name: "motion_pair",
    shape: &[Fixed(1), MotionPair],
    role: Role::Stage,
    unit: "",
    meaning: "motion vectors of the last frame and of this one, normalised",
};
/// Latent vector.
pub(crate) const LATENT: Port = Port {
    name: "latent",
    shape: &[Fixed(1), Latent],
    role: Role::Stage,
    unit: "",
    meaning: "code of the motion, which the field reads; the category with the largest logit in each channel",
};
/// Logits of the motion code.
pub(crate) const LOGITS: Port = Port {
    name: "logits",
    shape: &[Channels, Categories],
    role: Role::Stage,
    unit: "",
    meaning: "logits of the code's categories, for programs that pick categories by a rule of their own",
};
/// Coefficients of the prior.
pub(crate) const COEFFICIENTS: Port = Port {
    name: "coefficients",
    shape: &[Fixed(1), Components],
    role: Role::Stage,
    unit: "",
    meaning: "coefficients of the prior's principal components",
};
/// Displacements of the prior.
pub(crate) const PRIOR: Port = Port {
    name: "prior",
    shape: &[Vertices, Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "displacement of each vertex by the prior, in its rotated frame",
};
/// Rotations of the vertices.
pub(crate) const VERTEX_ROTATIONS: Port = Port {
    name: "vertex_rotations",
    shape: &[Vertices, Fixed(4)],
    role: Role::Stage,
    unit: "",
    meaning: "rotation of each vertex's frame, the blend of its joints': unit quaternions x, y, z, w",
};
/// Rotation of the frame of root-relative states.
pub(crate) const FRAME_ROTATION: Port = Port {
    name: "frame_rotation",
    shape: &[Fixed(1), Fixed(4)],
    role: Role::Stage,
    unit: "",
    meaning: "world rotation of the frame of root_relative: a unit quaternion x, y, z, w",
};
/// World position of the root joint.
pub(crate) const ROOT_POSITION: Port = Port {
    name: "root_position",
    shape: &[Fixed(1), Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "world position of the root joint",
};
/// World positions of the garment.
pub(crate) const POSITIONS: Port = Port {
    name: "positions",
    shape: &[Vertices, Fixed(3)],
    role: Role::Result,
    unit: "m",
    meaning: "world position of each vertex",
};
