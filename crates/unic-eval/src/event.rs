//! Events of a running evaluation, for progress bars and recorders.

use crate::{
    error::{Error, Result},
    kinematics::PreparedClip,
    predictor::{Mode, PredictorError},
};
use glam::Vec3;

/// Event of a running evaluation; see [`evaluate`](crate::evaluate()).
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A clip has been read.
    ClipStarted {
        /// The clip.
        clip: &'a PreparedClip,
        /// Index of the clip in the evaluation, from 0.
        index: usize,
        /// Number of clips in the evaluation.
        count: usize,
    },
    /// A predictor has predicted a frame.
    Predicted {
        /// Name of the predictor.
        predictor: &'a str,
        /// Mode of the prediction.
        mode: Mode,
        /// Index of the frame, at least 1.
        frame: usize,
        /// Predicted world positions of the garment's vertices, metres.
        positions: &'a [Vec3],
    },
    /// All predictors have finished some frames of the clip in one mode.
    Progress {
        /// Mode of the predictions.
        mode: Mode,
        /// Number of finished frames, frame 0 included.
        done: usize,
        /// Number of frames of the clip.
        total: usize,
    },
    /// All predictors have finished the clip in all modes.
    ClipFinished,
}

/// Callback that receives the events of an evaluation, such as a progress bar or a
/// [`Dump`](crate::Dump). An error ends the evaluation.
pub type Observer<'a> = dyn FnMut(&Event) -> std::result::Result<(), PredictorError> + 'a;

/// Passes an event to the observer. An error is returned with the name of the clip.
pub(crate) fn notify(clip: &PreparedClip, observe: &mut Observer, event: &Event) -> Result<()> {
    observe(event).map_err(|source| Error::Observer {
        clip: clip.name().to_owned(),
        source,
    })
}
