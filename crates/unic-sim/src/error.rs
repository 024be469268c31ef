//! Errors of a simulation.

use thiserror::Error;

/// An invalid input of a simulation, or a state that is not finite.
#[derive(Debug, Error, PartialEq)]
pub enum SimulationError {
    /// A position that is infinite or NaN.
    #[error("simulation: the position of vertex {vertex} is not finite after {seconds:.3} s")]
    NotFinite {
        /// Index of the first such vertex.
        vertex: usize,
        /// Simulated time since the garment was placed, seconds.
        seconds: f64,
    },
    /// A pose that has the wrong number of joints or is not finite.
    #[error("simulation: expected a finite pose of {expected} joints, found one of {found}")]
    Pose {
        /// Number of joints of the character.
        expected: usize,
        /// Number of joints of the pose.
        found: usize,
    },
    /// A request that needs a character, in a simulation without one.
    #[error("simulation: {what} needs a character, and there is none")]
    NoCharacter {
        /// Name of the request or input.
        what: &'static str,
    },
    /// An attachment to a face that the body does not have.
    #[error("simulation: expected attachments to faces below {faces}, found face {found}")]
    Attachment {
        /// Index of the face that the attachment names.
        found: u32,
        /// Number of faces of the body.
        faces: usize,
    },
    /// A setting out of range.
    #[error("simulation: expected {name} {expected}, found {found}")]
    Setting {
        /// Name of the field.
        name: &'static str,
        /// Range of valid values, in words.
        expected: &'static str,
        /// Value of the setting.
        found: f32,
    },
    /// A wind that is infinite or NaN.
    #[error("simulation: the wind is not finite")]
    Wind,
}
