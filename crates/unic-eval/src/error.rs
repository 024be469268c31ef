//! What can go wrong in an evaluation.

use crate::predictor::PredictorError;
use thiserror::Error;
use unic_core::{animator::AnimatorError, motion::MotionError};

/// Result of fitting or evaluating.
pub type Result<T> = std::result::Result<T, Error>;

/// One sentence each.
#[derive(Debug, Error)]
pub enum Error {
    /// A file of the capture cannot be used.
    #[error(transparent)]
    File(#[from] unic_io::Error),
    /// The skeleton and the contact joints do not fit.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Nothing to fit baselines on.
    #[error("capture {capture}: expected training clips of two frames or more, found none")]
    NoTraining {
        /// Its name.
        capture: String,
    },
    /// Nothing to evaluate on.
    #[error("capture {capture}: expected clips to evaluate on, found none")]
    NoClips {
        /// Its name.
        capture: String,
    },
    /// A predictor gave up.
    #[error("{row} on clip {clip}: {source}")]
    Predictor {
        /// The row of the table.
        row: String,
        /// The clip.
        clip: String,
        /// Why.
        source: PredictorError,
    },
    /// A predictor gave a garment of another mesh.
    #[error("{row} on clip {clip}: expected {expected} garment vertices, found {found}")]
    Vertices {
        /// The row of the table.
        row: String,
        /// The clip.
        clip: String,
        /// Vertices of the capture's garment.
        expected: usize,
        /// Vertices predicted.
        found: usize,
    },
    /// Whoever listens to the evaluation could not take a frame.
    #[error("cannot keep the predictions of clip {clip}: {source}")]
    Observer {
        /// The clip.
        clip: String,
        /// Why.
        source: PredictorError,
    },
    /// An animator refused a clip.
    #[error("the animator on clip {clip}: {source}")]
    Animator {
        /// The clip, as it is or changed.
        clip: String,
        /// Why.
        source: AnimatorError,
    },
    /// Whoever watches asked to stop.
    #[error("{0}")]
    Stopped(#[source] PredictorError),
}
