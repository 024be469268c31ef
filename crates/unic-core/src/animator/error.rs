//! What an animator refuses.

use thiserror::Error;

/// Input that does not belong to the animator's model.
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
    /// A pose, ground height or wind that is no number or absurdly large, or rotations that are none.
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
    /// NaN or infinity.
    #[error("animator: the position of vertex {vertex} is not finite")]
    Position {
        /// The vertex.
        vertex: usize,
    },
    /// A saved state of another model.
    #[error("animator: expected a state of this model, found one of another: {0}")]
    State(String),
}
