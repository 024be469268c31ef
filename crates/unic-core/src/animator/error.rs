//! Errors of an animator.

use thiserror::Error;

/// Error: input that an animator refuses, because it is not for its model or not usable.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum AnimatorError {
    /// A pose of another skeleton.
    #[error("animator: expected a pose of {expected} joints, found {found}")]
    Joints {
        /// Joints of the model.
        expected: usize,
        /// Joints of the pose.
        found: usize,
    },
    /// A pose, ground height or wind that is not finite or beyond
    /// [`FARTHEST`](super::FARTHEST), or quaternions that are not unit.
    #[error(
        "animator: expected unit rotations and finite numbers below a million in pose, ground and wind, found others"
    )]
    Pose,
    /// Positions of another mesh.
    #[error("animator: expected {expected} vertex positions, found {found}")]
    Vertices {
        /// Vertices of the model.
        expected: usize,
        /// Positions given.
        found: usize,
    },
    /// A position that is NaN or infinite.
    #[error("animator: the position of vertex {vertex} is not finite")]
    Position {
        /// The vertex.
        vertex: usize,
    },
    /// A saved state of another model.
    #[error("animator: expected a state of this model, found one of another: {0}")]
    State(String),
}
