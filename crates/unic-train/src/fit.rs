//! The fits that a run is made of, and the clips that each of them sees.

use crate::{
    config::{Refit, TrainConfig},
    error::TrainError,
    stream::{Stream, generator},
};
use rand::RngExt;
use serde::{Deserialize, Serialize};
use unic_io::{Capture, Split};

/// One fit of a run, from random parameters to the last step; ordered as a run makes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Validation clips are held out: the free-running error on them is that of unseen motion.
    HeldOut,
    /// All training clips are trained on, and no error on unseen motion is measured.
    AllClips,
}

impl Fit {
    /// The fits of a run, in their order; the last one is the model.
    pub fn of_run(capture: &Capture, config: &TrainConfig) -> &'static [Self] {
        let draws = capture.clip_names(Split::Validation).is_empty();
        // A lone training clip is its own validation clip and stays in.
        let takes_out = draws && capture.clip_names(Split::Train).len() > 1;
        match config.validation.refit {
            Refit::AllClips if takes_out => &[Self::HeldOut, Self::AllClips],
            Refit::AllClips | Refit::Never => &[Self::HeldOut],
            Refit::Only => &[Self::AllClips],
        }
    }

    /// Name of the fit in files: `held_out` or `all_clips`.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeldOut => "held_out",
            Self::AllClips => "all_clips",
        }
    }
}

/// The clips of one fit by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FitClips {
    pub(crate) train: Vec<String>,
    pub(crate) validation: Vec<String>,
    /// The run's next fit trains on the validation clips too.
    pub(crate) validation_comes_back: bool,
}

impl FitClips {
    /// Chooses the clips. The capture's validation clips are held out, else one training clip drawn
    /// by the seed. A lone training clip serves for both.
    pub(crate) fn new(capture: &Capture, fit: Fit, config: &TrainConfig) -> Result<Self, TrainError> {
        let mut train = capture.clip_names(Split::Train).to_vec();
        let mut validation = capture.clip_names(Split::Validation).to_vec();
        if train.is_empty() {
            return Err(TrainError::NoClips {
                capture: capture.root.clone(),
            });
        }
        match fit {
            Fit::AllClips => validation.clear(),
            Fit::HeldOut if validation.is_empty() => {
                let drawn = generator(config.seed, Stream::Validation, 0).random_range(0..train.len());
                validation = vec![train[drawn].clone()];
                if train.len() > 1 {
                    train.remove(drawn);
                }
            }
            Fit::HeldOut => {}
        }
        let has_next = Fit::of_run(capture, config) == [fit, Fit::AllClips];
        Ok(Self {
            train,
            validation,
            validation_comes_back: fit == Fit::HeldOut && has_next,
        })
    }
}
