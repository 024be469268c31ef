//! Garments in motion behind a lock.

use crate::{
    error::{Error, Result, detached},
    threads::Workers,
};
use glam::Vec3;
use pyo3::prelude::*;
use std::{
    sync::{Mutex, MutexGuard, TryLockError},
    time::{Duration, Instant},
};
use unic_core::{
    Animator, AnimatorError, GarmentFrame, Pose, Start, StepInput, TickInterpolator, clip::Clip,
};

/// Time after which an animation looks for Ctrl-C.
const BETWEEN_SIGNALS: Duration = Duration::from_millis(50);

/// Garment in motion, which one call at a time uses.
pub(crate) struct Stepping {
    instance: Mutex<Instance>,
    workers: Workers,
}

/// State and buffers of a garment in motion.
pub(crate) struct Instance {
    pub(crate) animator: Animator,
    display: TickInterpolator,
}

impl Stepping {
    pub(crate) fn new(mut animator: Animator, workers: Workers) -> Result<Self> {
        animator.set_threads(workers.threads());
        let mut instance = Instance {
            animator,
            display: TickInterpolator::default(),
        };
        // Every later call finds a garment.
        let pose = instance.animator.model().character().skeleton.bind_pose();
        let input = StepInput {
            pose: &pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        instance.reset(&input, Start::MeanShape)?;
        Ok(Self {
            instance: Mutex::new(instance),
            workers,
        })
    }

    /// Takes the garment for a call.
    ///
    /// # Errors
    /// A call of another thread that has not returned, a fault in an earlier call, a forked process.
    pub(crate) fn take(&self) -> Result<MutexGuard<'_, Instance>> {
        self.workers.check_process()?;
        self.instance.try_lock().map_err(|e| match e {
            TryLockError::WouldBlock => Error::value(
                "animator",
                "calls from one thread at a time",
                "another call that has not returned",
            ),
            TryLockError::Poisoned(_) => {
                Error::Fault("animator: a fault of the library left it unusable; make another one".into())
            }
        })
    }
}

impl Instance {
    pub(crate) fn reset(&mut self, input: &StepInput<'_>, start: Start<'_>) -> Result<()> {
        self.animator.reset(input, start)?;
        self.display.cut(&self.animator);
        Ok(())
    }

    pub(crate) fn step(&mut self, input: &StepInput<'_>) -> Result<()> {
        self.animator.step(input)?;
        self.display.tick(&self.animator);
        Ok(())
    }

    pub(crate) fn replace(&mut self, positions: &[Vec3]) -> Result<()> {
        self.animator.set_garment(positions)?;
        self.display.cut(&self.animator);
        Ok(())
    }

    pub(crate) fn restore(&mut self, saved: &[u8], checksum: u32) -> Result<()> {
        let state = unic_core::AnimatorState::from_saved(saved, checksum)?;
        self.animator.restore(state)?;
        self.display.cut(&self.animator);
        Ok(())
    }

    pub(crate) fn show(
        &mut self,
        pose: &Pose,
        share: f32,
    ) -> std::result::Result<GarmentFrame<'_>, AnimatorError> {
        self.display.show(&self.animator, pose, share)
    }

    /// Animates a clip from its first frame on. Returns the positions of all frames.
    ///
    /// # Errors
    /// A clip of another skeleton or rate, more frames than memory, Ctrl-C.
    pub(crate) fn animate(&mut self, py: Python<'_>, clip: &Clip, start: Start<'_>) -> Result<Vec<f32>> {
        let (expected, found) = (self.animator.model().config().fps, clip.fps);
        // A tolerance, because files round rates such as 29.97.
        if (expected - found).abs() > 1e-3 * expected {
            let expected = format!("{expected} frames a second as in the model");
            return Err(Error::value(
                "motion",
                expected,
                format!("{found}; see Motion.resampled"),
            ));
        }
        let vertices = self.animator.model().vertex_count();
        let mut numbers: Vec<f32> = Vec::new();
        let length = 3 * vertices * clip.len();
        (numbers.try_reserve_exact(length)).map_err(|_| {
            Error::value(
                "motion",
                "frames that fit into memory",
                format!("{} frames", clip.len()),
            )
        })?;
        let mut frame = 0;
        while frame < clip.len() {
            py.check_signals()?;
            frame = detached(py, || self.animate_for_a_while(clip, frame, start, &mut numbers))?;
        }
        Ok(numbers)
    }

    /// Animates frames until it is time to look for signals. Returns the next frame.
    fn animate_for_a_while(
        &mut self,
        clip: &Clip,
        first: usize,
        start: Start<'_>,
        numbers: &mut Vec<f32>,
    ) -> Result<usize> {
        let began = Instant::now();
        for frame in first..clip.len() {
            let input = StepInput::of_clip(clip, frame);
            match frame {
                0 => self.reset(&input, start)?,
                _ => self.step(&input)?,
            }
            numbers.extend_from_slice(bytemuck::cast_slice(self.animator.garment().positions));
            if began.elapsed() > BETWEEN_SIGNALS {
                return Ok(frame + 1);
            }
        }
        Ok(clip.len())
    }
}
