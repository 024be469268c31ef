//! A run to a checkpoint and back.

use super::{Best, Trainer};
use crate::{
    checkpoint::{Checkpoint, Progress},
    error::TrainError,
    network::Network,
    optimiser::Moments,
    time::TrainingTime,
};
use std::path::{Path, PathBuf};

impl Trainer {
    /// Goes on from a checkpoint of the same fit with the same settings, to the same result as if it
    /// had never stopped where products are those of before; or with those of a longer run, see
    /// [`TrainConfig::is_lengthened_by`](crate::TrainConfig::is_lengthened_by).
    ///
    /// # Errors
    /// A checkpoint of another fit, other settings or another network.
    pub fn resume(&mut self, checkpoint: Checkpoint, path: &Path) -> Result<(), TrainError> {
        let wrong = |found: &str| TrainError::Checkpoint {
            path: path.to_owned(),
            found: found.to_owned(),
        };
        if checkpoint.progress.fit != self.data.fit {
            return Err(wrong("one of another fit"));
        }
        let begun = checkpoint.progress.config.with_products_of(&self.config);
        if begun != self.config && !begun.is_lengthened_by(&self.config) {
            return Err(wrong("one of other settings"));
        }
        let lengths: Vec<usize> = self.network.values().iter().map(Vec::len).collect();
        let group = |name: &str| match checkpoint.group(name) {
            Some(g) if g.iter().map(Vec::len).eq(lengths.iter().copied()) => Ok(g.clone()),
            Some(_) => Err(wrong("one of a network of other sizes")),
            None => Err(wrong("one without all its tensors")),
        };
        let parameters = group("parameters")?;
        let moments = Moments {
            first: group("first_moments")?,
            second: group("second_moments")?,
        };
        let average = self.average.is_some().then(|| group("average")).transpose()?;
        let best = match checkpoint.progress.best {
            Some((rmse, step)) => Some(Best {
                rmse,
                step,
                parameters: group("best")?,
            }),
            None => None,
        };
        self.network = Network::with_parameters(&self.shape, &parameters, &self.device);
        (self.moments, self.average, self.best) = (moments, average, best);
        self.step = checkpoint.progress.step;
        self.time = TrainingTime {
            seconds: checkpoint.progress.seconds,
            prior_seconds: checkpoint.progress.prior_seconds,
        };
        self.owes_measurement = checkpoint.progress.owes_measurement;
        Ok(())
    }

    /// Writes everything that [`Trainer::resume`] needs.
    pub(super) fn save(&self, folder: &Path) -> Result<PathBuf, TrainError> {
        let mut groups = vec![
            ("parameters".to_owned(), self.network.values()),
            ("first_moments".to_owned(), self.moments.first.clone()),
            ("second_moments".to_owned(), self.moments.second.clone()),
        ];
        groups.extend(self.average.clone().map(|a| ("average".to_owned(), a)));
        groups.extend(self.best.clone().map(|b| ("best".to_owned(), b.parameters)));
        groups.sort_by(|a, b| a.0.cmp(&b.0));
        let progress = Progress {
            fit: self.data.fit,
            step: self.step,
            config: self.config.clone(),
            seconds: self.time.seconds,
            prior_seconds: self.time.prior_seconds,
            best: self.best.as_ref().map(|b| (b.rmse, b.step)),
            owes_measurement: self.owes_measurement,
        };
        Checkpoint { progress, groups }.write(folder)
    }
}
