//! Progress of the measures, for progress bars.

use crate::predictor::PredictorError;

/// Progress of a measure; see [`measure`](super::measure).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Name of the measure.
    pub measure: &'static str,
    /// Number of frames that have run.
    pub done: usize,
    /// Number of frames to run.
    pub total: usize,
}

/// Callback that receives the progress after each frame. An error ends all measures.
pub type ProgressObserver<'a> = dyn FnMut(&Progress) -> std::result::Result<(), PredictorError> + 'a;
