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

    /// Returns whether models with these values and with others show the same.
    pub(crate) fn shows_as(&self, other: &Self) -> bool {
        let [own, other] = [self, other].map(|chosen| Self {
            replay_factor: Some(chosen.replay_factor.unwrap_or(1.0)),
            ..*chosen
        });
        own == other
    }

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
    /// RMSE in free running over the frames that were measured, metres: ten a second for the bending, three
    /// a second and with intersection handling for self-crossings, all frames for the life.
    pub rmse: f64,
}

/// Property of the shown cloth, compared with that of the truth.
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
        /// Mean over the clips. None if it is not finite, and where no truth is alive.
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
    /// Writes the values that are set and what was measured, on one line.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let chosen = &self.chosen;
        let bending = chosen.bending.map(|bending| format!("bending {bending}"));
        let chords = (chosen.chord_deviations).map(|chords| format!("chords from {chords} deviations"));
        let order = chosen.order.map(|order| format!("order {order}"));
        let replay = (chosen.replay_factor).map(|factor| format!("{factor} times the replay"));
        let values: Vec<String> = [bending, chords, order, replay].into_iter().flatten().collect();
        write!(f, "{}: RMSE {:.2} mm, ", values.join(", "), 1e3 * self.rmse)?;
        let ratio = |log: Option<f64>| log.map_or("unknown".to_owned(), |log| format!("{:.3}", log.exp()));
        match self.measured {
            Measured::Bending { all, by_clip } => {
                write!(
                    f,
                    "bending ratio {}, mean of the clips {}",
                    ratio(all),
                    ratio(by_clip)
                )
            }
            Measured::Crossings { excess } => {
                write!(
                    f,
                    "self-crossing edges {:.2} points above the truth's",
                    100.0 * excess
                )
            }
            Measured::Life { excess } => write!(f, "living ratio {}", ratio(excess)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_says_what_was_tried_and_measured() {
        let text = |measured, chosen| {
            let rmse = 0.03917;
            ShownTrial {
                chosen,
                measured,
                rmse,
            }
            .to_string()
        };
        let bends = Measured::Bending {
            all: Some(0.0),
            by_clip: None,
        };
        let chosen = Chosen {
            bending: Some(0.35),
            chord_deviations: Some(1.5),
            order: Some(0.0),
            replay_factor: Some(2.72),
            ..Chosen::SETTINGS
        };
        assert_eq!(
            text(bends, chosen),
            "bending 0.35, chords from 1.5 deviations, order 0, 2.72 times the replay: RMSE 39.17 mm, \
             bending ratio 1.000, mean of the clips unknown"
        );
        let crosses = Measured::Crossings { excess: 0.0036 };
        let chosen = Chosen {
            order: Some(0.2),
            ..Chosen::SETTINGS
        };
        assert_eq!(
            text(crosses, chosen),
            "order 0.2: RMSE 39.17 mm, self-crossing edges 0.36 points above the truth's"
        );
        let lives = Measured::Life {
            excess: Some(2.0_f64.ln()),
        };
        assert!(text(lives, chosen).ends_with("living ratio 2.000"));
    }

    #[test]
    fn a_factor_of_one_shows_what_no_factor_shows() {
        let with = |replay_factor| Chosen {
            replay_factor,
            ..Chosen::SETTINGS
        };
        assert!(with(None).shows_as(&with(Some(1.0))));
        assert!(!with(None).shows_as(&with(Some(1.01))));
    }
}
