//! Events and errors of a controller.

use thiserror::Error;

/// Events of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Outcome of the search.
    pub search: SearchOutcome,
    /// Distance by which the root was moved towards the object beside its own motion, metres.
    pub adjusted_m: f32,
    /// Whether the distance to the object was at its limit.
    pub clamping: Clamping,
}

/// Outcome of a step's search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SearchOutcome {
    /// No search was due.
    #[default]
    NotDue,
    /// The frame that plays went on.
    Continued,
    /// Another frame plays now.
    Switched,
}

/// Whether the root was moved onto the limit of its distance to the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clamping {
    /// It was within the limits.
    #[default]
    Within,
    /// It was moved.
    Clamped,
}

/// Error of a controller.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ControllerError {
    /// A saved state of another database.
    #[error("controller: expected {expected} as {what} of the state, found {found}")]
    State {
        /// Name of the number.
        what: &'static str,
        /// Number of the database.
        expected: usize,
        /// Number of the state.
        found: usize,
    },
    /// A state or a command with a number that is not finite.
    #[error("controller: expected finite numbers, found one that is not")]
    NotFinite,
    /// Tags that no frame has.
    #[error("controller: expected a frame with these tags, found none")]
    NoFrames,
}
