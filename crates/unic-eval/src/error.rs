//! Errors of fits and evaluations.

use crate::{life::ControlError, predictor::PredictorError};
use thiserror::Error;
use unic_core::{AnimatorError, motion::MotionError};

/// Result of a fit or an evaluation.
pub type Result<T> = std::result::Result<T, Error>;

/// Error of a fit or an evaluation. Its text is one sentence.
#[derive(Debug, Error)]
pub enum Error {
    /// A file of the capture cannot be used.
    #[error(transparent)]
    File(#[from] unic_io::Error),
    /// The contact joints do not fit the skeleton.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The capture has no training clips of two frames or more.
    #[error("capture {capture}: expected training clips of two frames or more, found none")]
    NoTraining {
        /// Name of the capture.
        capture: String,
    },
    /// No clips are given to evaluate on.
    #[error("capture {capture}: expected clips to evaluate on, found none")]
    NoClips {
        /// Name of the capture.
        capture: String,
    },
    /// A predictor failed.
    #[error("{predictor} on clip {clip}: {source}")]
    Predictor {
        /// Name of the predictor.
        predictor: String,
        /// Name of the clip.
        clip: String,
        /// Cause.
        source: PredictorError,
    },
    /// A predictor returned another number of vertices than the garment has.
    #[error("{predictor} on clip {clip}: expected {expected} garment vertices, found {found}")]
    Vertices {
        /// Name of the predictor.
        predictor: String,
        /// Name of the clip.
        clip: String,
        /// Number of vertices of the capture's garment.
        expected: usize,
        /// Number of predicted vertices.
        found: usize,
    },
    /// The observer of the evaluation failed.
    #[error("cannot keep the predictions of clip {clip}: {source}")]
    Observer {
        /// Name of the clip.
        clip: String,
        /// Cause.
        source: PredictorError,
    },
    /// The smoothings of a garment's rest mesh cannot be factorised.
    #[error(
        "garment: expected a rest mesh that can be smoothed, found areas too unequal ({vertices} vertices)"
    )]
    Smoothing {
        /// Number of vertices of the welded rest mesh.
        vertices: usize,
    },
    /// A capture cannot be the control of the evaluated one.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// An animator refused the motion of a clip.
    #[error("the animator on clip {clip}: {source}")]
    Animator {
        /// Name of the clip, or of the motion made from it.
        clip: String,
        /// Cause.
        source: AnimatorError,
    },
    /// The observer of a measurement asked to stop.
    #[error("{0}")]
    Stopped(#[source] PredictorError),
}
