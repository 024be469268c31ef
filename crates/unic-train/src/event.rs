//! Events that a run reports to its listener, and the listener's answers.

use std::{path::Path, sync::Arc};
use unic_core::Model;

/// Event of a run, reported to its listener.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// A step is done.
    Step {
        /// Steps done so far.
        step: u64,
        /// Loss of the step.
        loss: f32,
        /// Global norm of the gradient before clipping.
        gradient_norm: f64,
        /// Learning rate of the step.
        learning_rate: f64,
        /// Seconds that the step took.
        seconds: f64,
    },
    /// The error of single steps from ground truth, without dropout, noise and intersection
    /// handling.
    OneStep {
        /// Steps done so far.
        step: u64,
        /// RMSE on a fixed sample of the training clips, metres.
        training_rmse: f64,
        /// RMSE on the first seconds of the validation clips, where there are some, metres.
        validation_rmse: Option<f64>,
        /// Seconds that measuring took.
        seconds: f64,
    },
    /// A model is about to run freely on the validation clips, for a preview.
    Previewed {
        /// Steps done so far.
        step: u64,
        /// Model with the present parameters.
        model: &'a Arc<Model>,
    },
    /// The free-running error on the validation clips.
    Validated {
        /// Steps done so far.
        step: u64,
        /// RMSE, metres.
        rmse: f64,
        /// Smallest so far, metres.
        best: f64,
        /// Seconds that the validation took.
        seconds: f64,
    },
    /// A frame of a validation clip is about to be predicted. An answer to stop ends the
    /// measurement; a resumed run makes it again.
    Measuring {
        /// Steps done so far.
        step: u64,
    },
    /// A checkpoint is on disk.
    Saved {
        /// Steps done so far.
        step: u64,
        /// The file.
        path: &'a Path,
    },
}

/// A listener's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Save a checkpoint and return.
    Stop,
}

/// Result of a call of [`crate::Trainer::run`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All steps are done.
    Finished,
    /// A listener stopped the run; a checkpoint is on disk.
    Stopped,
}

impl Control {
    /// Combines two answers: stop if either is [`Control::Stop`].
    pub(crate) fn and(self, other: Self) -> Self {
        if self == Self::Stop { self } else { other }
    }
}
