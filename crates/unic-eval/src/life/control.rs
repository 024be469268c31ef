//! Second simulation of the evaluated motions, as a row of the evaluation.

use crate::{
    error::Result,
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::path::PathBuf;
use thiserror::Error;
use unic_core::clip::Clip;
use unic_io::{Capture, CapturedClip};

/// "Predicts" the garment of another capture: a second simulation of the same motions with another
/// history.
///
/// Its distance from the truth is what chance in the cloth alone makes. No model that sees the
/// motion alone can be expected to come closer.
pub struct ControlPredictor {
    capture: Capture,
    clip: Option<CapturedClip>,
}

/// Capture that is no second simulation of the evaluated one.
#[derive(Debug, Error)]
pub enum ControlError {
    /// The garment has another mesh.
    #[error(
        "{}: expected the garment mesh of {} ({expected} vertices), found another one ({found} vertices)",
        control.display(), capture.display()
    )]
    Garment {
        /// Folder of the control.
        control: PathBuf,
        /// Folder of the evaluated capture.
        capture: PathBuf,
        /// Number of vertices of the evaluated garment.
        expected: usize,
        /// Number of vertices of the control's garment.
        found: usize,
    },
    /// A clip has too few frames.
    #[error("{}, clip {clip}: expected {expected} frames or more, found {found}", control.display())]
    Frames {
        /// Folder of the control.
        control: PathBuf,
        /// Name of the clip.
        clip: String,
        /// Number of evaluated frames.
        expected: usize,
        /// Number of frames of the control.
        found: usize,
    },
    /// A clip has another frame rate.
    #[error("{}, clip {clip}: expected {expected} frames a second, found {found}", control.display())]
    FrameRate {
        /// Folder of the control.
        control: PathBuf,
        /// Name of the clip.
        clip: String,
        /// Frame rate of the evaluated clip.
        expected: f32,
        /// Frame rate of the control.
        found: f32,
    },
    /// A clip has another motion.
    #[error("{}, clip {clip}: expected the motion of the evaluated clip, found another one", control.display())]
    Motion {
        /// Folder of the control.
        control: PathBuf,
        /// Name of the clip.
        clip: String,
    },
}

impl ControlPredictor {
    /// Wraps the control of an evaluation of the named clips of a capture.
    ///
    /// # Errors
    /// A [`ControlError`] for another garment mesh, or another motion, frame rate or number of
    /// frames of a clip; clips that cannot be read.
    pub fn new(control: Capture, capture: &Capture, clips: &[String]) -> Result<Self> {
        let [expected, found] = [capture, &control].map(|c| &c.garment.rest);
        if expected.faces != found.faces || expected.vertices.len() != found.vertices.len() {
            let error = ControlError::Garment {
                control: control.root.clone(),
                capture: capture.root.clone(),
                expected: expected.vertices.len(),
                found: found.vertices.len(),
            };
            return Err(error.into());
        }
        let control = Self {
            capture: control,
            clip: None,
        };
        for name in clips {
            let frames = capture.summarise_clip(name)?.pose_frames;
            control.load(name, frames, &capture.load_clip(name)?.clip)?;
        }
        Ok(control)
    }

    /// Reads the control's clip and compares it with the first frames of the evaluated one.
    fn load(&self, name: &str, frames: usize, evaluated: &Clip) -> Result<CapturedClip> {
        let found = self.capture.load_clip(name)?;
        let (control, clip) = (self.capture.root.clone(), name.to_owned());
        let error = if found.clip.fps != evaluated.fps {
            ControlError::FrameRate {
                control,
                clip,
                expected: evaluated.fps,
                found: found.clip.fps,
            }
        } else if found.garment.len() < frames {
            ControlError::Frames {
                control,
                clip,
                expected: frames,
                found: found.garment.len(),
            }
        } else if !found.clip.has_motion_of(evaluated) {
            ControlError::Motion { control, clip }
        } else {
            return Ok(found);
        };
        Err(error.into())
    }
}

impl Predictor for ControlPredictor {
    fn modes(&self) -> &[Mode] {
        &[Mode::FreeRunning]
    }

    fn start(&mut self, clip: &PreparedClip, _: Mode) -> std::result::Result<(), PredictorError> {
        self.clip = Some(self.load(clip.name(), clip.len(), &clip.captured.clip)?);
        Ok(())
    }

    fn predict(
        &mut self,
        _: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> std::result::Result<(), PredictorError> {
        positions.clear();
        if let Some(clip) = &self.clip {
            positions.extend_from_slice(clip.garment.frame(frame));
        }
        Ok(())
    }
}
