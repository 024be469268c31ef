//! Values of the shown cloth that a validation tries, and what it measures with them.

use super::Bending;
use crate::error::TrainError;
use std::fmt;
use unic_core::{model::ModelError, prior::Prior};

/// Values of a model that a validation chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Factor of the field's output, 0 to 1.
    pub field_share: f32,
    /// Bending of the strain projection; none for that of the settings.
    pub bending: Option<f32>,
    /// Least lengths of free chords; none for those of the settings.
    pub chord_deviations: Option<f32>,
    /// Order of the strain projection; none for that of the settings.
    pub order: Option<f32>,
    /// Factor of the replayed wrinkles; none for 1.
    pub replay_factor: Option<f32>,
}

impl Chosen {
    /// The values before a validation: the whole field, and the settings.
    pub(crate) const SETTINGS: Self = Self {
        field_share: 1.0,
        bending: None,
        chord_deviations: None,
        order: None,
        replay_factor: None,
    };

    /// Multiplies the wrinkles that a prior replays by the factor.
    pub(crate) fn scale_replay(&self, prior: &mut Prior) -> Result<(), TrainError> {
        if let Some(factor) = self.replay_factor
            && let Some(replay) = prior.replay.take()
        {
            prior.replay = Some(replay.scaled(factor).map_err(ModelError::from)?);
        }
        Ok(())
    }
}

/// Values with which a validation has shown the cloth of motions left out, and what it measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownTrial {
    /// The values.
    pub chosen: Chosen,
    /// Property of the cloth that was measured.
    pub measured: Measured,
    /// RMSE in free running, metres.
    pub rmse: f64,
}

/// Property of the shown cloth, by that of the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// Logarithms of the bending by the truth's. None if it is not finite, and without a truth that bends.
    Bending {
        /// Over all clips together: lively ones decide.
        all: Option<f64>,
        /// Mean over the clips.
        by_clip: Option<f64>,
    },
    /// Excess of self-crossings.
    Crossings {
        /// Share of the edges, 0 to 1, beyond the truth's, averaged over the clips.
        excess: f64,
    },
    /// Logarithm of the living ratio.
    Life {
        /// Mean over the clips. None where no truth is alive.
        excess: Option<f64>,
    },
}

impl ShownTrial {
    /// The bending, if that was measured.
    pub(crate) fn bending(&self) -> Option<Bending> {
        match self.measured {
            Measured::Bending { all, by_clip } => Some(Bending {
                all,
                by_clip,
                rmse: self.rmse,
            }),
            _ => None,
        }
    }
}

impl fmt::Display for ShownTrial {
    /// Writes the values that are set and the ratios, on one line.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let chosen = &self.chosen;
        let values = [
            ("bending", chosen.bending),
            ("chords from deviations of", chosen.chord_deviations),
            ("order", chosen.order),
            ("replay times", chosen.replay_factor),
        ];
        for (name, value) in values {
            if let Some(value) = value {
                write!(f, "{name} {value}, ")?;
            }
        }
        let ratio = |log: Option<f64>| log.map_or("unknown".to_owned(), |log| format!("{:.3}", log.exp()));
        write!(f, "{:.2} mm, by the truth's: ", 1e3 * self.rmse)?;
        match self.measured {
            Measured::Bending { all, by_clip } => {
                write!(f, "bending {}, mean of the clips {}", ratio(all), ratio(by_clip))
            }
            Measured::Crossings { excess } => write!(f, "self-crossing edges {:+.2} %", 100.0 * excess),
            Measured::Life { excess } => write!(f, "living ratio {}", ratio(excess)),
        }
    }
}
