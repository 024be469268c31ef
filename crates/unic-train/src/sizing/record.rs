//! Results of a sizing, in the run folder and in the model file.

use super::{Candidate, Gain};
use crate::{
    config::{SizingSettings, TrainConfig},
    error::TrainError,
};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A candidate with its gain on motion left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Size and steps.
    #[serde(flatten)]
    pub candidate: Candidate,
    /// Gain with the best share.
    #[serde(flatten)]
    pub gain: Gain,
}

impl Tried {
    pub(super) fn new(candidate: Candidate, gain: Gain) -> Self {
        Self { candidate, gain }
    }
}

/// Choice of a field for a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sizing {
    /// Size and steps of the field.
    pub chosen: Candidate,
    /// Factor of its output, 0 where no field helps.
    pub share: f32,
    /// Clips that judged, each left out of the trainings that it judged.
    pub judged_clips: Vec<String>,
    /// All candidates.
    pub tried: Vec<Tried>,
    /// Seconds that it took, over all resumes.
    pub seconds: f64,
}

impl Sizing {
    /// The settings of a run with the chosen size and number of steps.
    pub fn applied_to(&self, settings: &TrainConfig) -> TrainConfig {
        self.chosen.config(settings)
    }
}

/// File of the results in the sizing's folder.
const FILE: &str = "tried.json";

/// Results so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    settings: TrainConfig,
    tried: Vec<Tried>,
    seconds: f64,
}

/// Results so far, and the file that they go to.
pub(super) struct Results {
    path: Option<PathBuf>,
    settings: TrainConfig,
    pub(super) tried: Vec<Tried>,
    pub(super) seconds: f64,
}

impl Results {
    /// Reads the results of an interrupted sizing, if there are some.
    ///
    /// # Errors
    /// A file that cannot be read, or that is of a run with other settings.
    pub(super) fn open(folder: Option<&Path>, settings: &TrainConfig) -> Result<Self, TrainError> {
        let path = folder.map(|folder| folder.join(FILE));
        let stored = match &path {
            Some(path) if path.exists() => Some(read(path, settings)?),
            _ => None,
        };
        let (tried, seconds) = stored.map_or_else(Default::default, |s| (s.tried, s.seconds));
        Ok(Self {
            path,
            settings: settings.clone(),
            tried,
            seconds,
        })
    }

    pub(super) fn find(&self, candidate: &Candidate) -> Option<&Tried> {
        self.tried.iter().find(|tried| tried.candidate == *candidate)
    }

    /// Writes the results.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn write(&self) -> Result<(), TrainError> {
        let Some(path) = &self.path else { return Ok(()) };
        let stored = Stored {
            settings: self.settings.clone(),
            tried: self.tried.clone(),
            seconds: self.seconds,
        };
        let wrong = |e: serde_json::Error| wrong(path, e.to_string());
        Ok(unic_io::atomic::write(
            path,
            &serde_json::to_vec(&stored).map_err(wrong)?,
        )?)
    }

    /// Chooses the candidate whose gain has the largest lower bound. Where none is significant the share is 0, and
    /// the first size with a single step stands for no field.
    pub(super) fn into_sizing(self, settings: &SizingSettings, judged_clips: Vec<String>) -> Sizing {
        let significant = self.tried.iter().filter(|tried| tried.gain.is_significant());
        let best =
            significant.reduce(
                |best, tried| match tried.gain.lower_bound() > best.gain.lower_bound() {
                    true => tried,
                    false => best,
                },
            );
        let none = super::candidates(settings)
            .first()
            .map(|c| Candidate { steps: 1, ..*c });
        let (chosen, share) = match (best, none) {
            (Some(tried), _) => (tried.candidate, tried.gain.share),
            (None, Some(candidate)) => (candidate, 0.0),
            // A sizing without sizes does not run.
            (None, None) => unreachable!("settings without sizes"),
        };
        Sizing {
            chosen,
            share,
            judged_clips,
            tried: self.tried,
            seconds: self.seconds,
        }
    }
}

fn read(path: &Path, settings: &TrainConfig) -> Result<Stored, TrainError> {
    let bytes = fs::read(path).map_err(|e| wrong(path, e.to_string()))?;
    let stored: Stored = serde_json::from_slice(&bytes).map_err(|e| wrong(path, e.to_string()))?;
    // The product format may change with the machine, as in the fits.
    match stored.settings.with_products_of(settings) == *settings {
        true => Ok(stored),
        false => Err(wrong(path, "one of other settings".to_owned())),
    }
}

fn wrong(path: &Path, found: String) -> TrainError {
    TrainError::Checkpoint {
        path: path.to_owned(),
        found,
    }
}
