//! What can go wrong while cloth moves.

use thiserror::Error;

/// What is wrong with a simulation's inputs or state.
#[derive(Debug, Error, PartialEq)]
pub enum SimulationError {
    /// A position that is no number.
    #[error("simulation: the position of vertex {vertex} is not finite after {seconds:.3} s")]
    NotFinite {
        /// The first such vertex.
        vertex: usize,
        /// Simulated time since the start of settling.
        seconds: f64,
    },
    /// A pose of another skeleton, or one that is not finite.
    #[error("simulation: expected a finite pose of {expected} joints, found one of {found}")]
    Pose {
        /// Joints of the character.
        expected: usize,
        /// Joints of the pose.
        found: usize,
    },
    /// Something that needs a body in a simulation without one.
    #[error("simulation: {what} needs a character, and there is none")]
    NoCharacter {
        /// What needs it.
        what: &'static str,
    },
    /// An attachment to a face that the body does not have.
    #[error("simulation: a vertex is attached to face {found} of a body of {faces} faces")]
    Attachment {
        /// Index found.
        found: u32,
        /// Faces of the body.
        faces: usize,
    },
    /// A setting out of range.
    #[error("simulation: expected {name} {expected}, found {found}")]
    Setting {
        /// Name of the field.
        name: &'static str,
        /// What it should be.
        expected: &'static str,
        /// Its value.
        found: f32,
    },
    /// No wind is a number.
    #[error("simulation: the wind is not finite")]
    Wind,
}
