//! Runs of the animator under test, on clips of a capture or on motion made from them.

use super::progress::{Progress, ProgressObserver};
use crate::error::{Error, Result};
use std::ops::Range;
use unic_core::{Animator, AnimatorError, Start, StepInput, clip::Clip, skeleton::Skeleton};
use unic_io::Capture;

/// Runs an animator through motion and reports progress.
pub(super) struct Runner<'a> {
    pub(super) capture: &'a Capture,
    pub(super) animator: Animator,
    observe: &'a mut ProgressObserver<'a>,
    progress: Progress,
}

/// Callback after each frame: index of the frame, and the animator after it.
pub(super) type FrameCallback<'a> = dyn FnMut(usize, &Animator) + 'a;

impl<'a> Runner<'a> {
    /// Wraps an animator of a model that fits the capture.
    pub(super) fn new(
        capture: &'a Capture,
        animator: Animator,
        observe: &'a mut ProgressObserver<'_>,
    ) -> Self {
        Self {
            capture,
            animator,
            observe,
            progress: Progress {
                measure: "",
                done: 0,
                total: 0,
            },
        }
    }

    /// Returns the frame rate of the model.
    pub(super) fn fps(&self) -> f32 {
        self.animator.model().config().fps
    }

    /// Returns the skeleton of the capture.
    pub(super) fn skeleton(&self) -> &'a Skeleton {
        &self.capture.character.skeleton
    }

    /// Returns the number of frames of a clip without reading it.
    pub(super) fn frames(&self, name: &str) -> Result<usize> {
        Ok(self.capture.summarise_clip(name)?.pose_frames)
    }

    /// Starts a measure of `total` frames, for the progress.
    pub(super) fn begin_measure(&mut self, measure: &'static str, total: usize) {
        self.progress = Progress {
            measure,
            done: 0,
            total,
        };
    }

    /// Resets the animator at the first frame and steps through the others. Without frames it does
    /// nothing.
    pub(super) fn run(
        &mut self,
        clip: &Clip,
        frames: Range<usize>,
        start: Start,
        each_frame: &mut FrameCallback,
    ) -> Result<()> {
        if frames.is_empty() {
            return Ok(());
        }
        let first = self
            .animator
            .reset(&StepInput::of_clip(clip, frames.start), start);
        first.map(|_| ()).map_err(|e| refused(clip, e))?;
        each_frame(frames.start, &self.animator);
        self.step_through(clip, frames.start + 1..frames.end, each_frame)
    }

    /// Steps through the frames from the animator's current state.
    pub(super) fn step_through(
        &mut self,
        clip: &Clip,
        frames: Range<usize>,
        each_frame: &mut FrameCallback,
    ) -> Result<()> {
        for frame in frames {
            let stepped = self.animator.step(&StepInput::of_clip(clip, frame));
            stepped.map(|_| ()).map_err(|e| refused(clip, e))?;
            each_frame(frame, &self.animator);
            self.progress.done += 1;
            (self.observe)(&self.progress).map_err(Error::Stopped)?;
        }
        Ok(())
    }
}

/// Adds the name of the clip to an animator's error.
pub(super) fn refused(clip: &Clip, source: AnimatorError) -> Error {
    Error::Animator {
        clip: clip.name.clone(),
        source,
    }
}
