//! Chooses the size, the training length and the share of a deformation field by motion left out.
//!
//! Candidates train without about a third of the motions and are judged on these, in free running,
//! against the prior alone. Rungs of more and more steps keep the better half of the candidates
//! (successive halving: Jamieson & Talwalkar 2016, "Non-stochastic Best Arm Identification and
//! Hyperparameter Optimization"). Each candidate starts every rung from scratch: its schedule is
//! then the one that a fit with the chosen number of steps has.

mod candidate;
mod folds;
mod gain;
mod judge;
mod record;
#[cfg(test)]
mod tests;
mod trial;

pub(crate) use candidate::LEAST_STEPS;
pub use candidate::{Candidate, rungs};
pub(crate) use folds::fold_count;
pub use gain::Gain;
pub use record::{Sizing, Tried};

use crate::{
    config::TrainConfig, device, error::TrainError, event::Control, field_data::FieldData,
    processor::Processor,
};
use candidate::{better_half, candidates};
use folds::{Fold, folds};
use judge::MotionErrors;
use rayon::prelude::*;
use record::Results;
use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};
use trial::Trial;

/// Report of a sizing to its listener.
#[derive(Clone, Copy, Debug)]
pub enum SizingEvent<'a> {
    /// A step of a candidate, or a part of its judgement, is done. Several threads report.
    Step {
        /// Steps done by all candidates together.
        done: u64,
        /// Steps of the sizing if every rung is reached. It ends early where all fields do harm.
        all: u64,
    },
    /// A candidate is judged.
    Judged(&'a Tried),
}

/// Callback of a sizing. After a stop it must always answer stop.
pub type Follow<'a> = dyn Fn(SizingEvent) -> Control + Sync + 'a;

/// Chooses a field's size for a run.
pub struct SizingTrainer<'a> {
    /// Data of the run's first fit. Clips that it holds out take part.
    pub data: &'a mut FieldData,
    /// Settings of the run.
    pub settings: &'a TrainConfig,
    /// Processor of the trainings.
    pub processor: Processor,
    /// Folder for checkpoints and results. A sizing that finds some continues from them.
    pub folder: Option<&'a Path>,
}

impl SizingTrainer<'_> {
    /// Chooses a field. Returns none where the settings name no sizes, where the model has no prior
    /// to fall back on, and where the motion is too short to leave any out.
    ///
    /// # Errors
    /// A training that diverges; [`TrainError::Stopped`] where `follow` answers stop, after a
    /// checkpoint; results of another run.
    pub fn run(self, follow: &Follow) -> Result<Option<Sizing>, TrainError> {
        let Self {
            data,
            settings,
            processor,
            folder,
        } = self;
        if settings.sizing.sizes.is_empty() || !settings.has_prior() {
            return Ok(None);
        }
        let device = device::open(processor)?;
        data.on_all_known_clips(|data| {
            let folds = folds(&data.clips);
            if folds.is_empty() {
                return Ok(None);
            }
            let halving = Halving {
                data,
                settings,
                device: &device,
                folder,
                follow,
                all: most_steps(settings, folds.len()),
                done: AtomicU64::new(0),
                folds,
            };
            halving.run().map(Some)
        })
    }
}

/// Returns whether any of the candidates may improve on the prior with more steps.
fn may_help(tried: &[Tried]) -> bool {
    tried.iter().any(|tried| tried.gain.may_help())
}

/// Steps of a sizing in which every rung is reached.
fn most_steps(settings: &TrainConfig, folds: usize) -> u64 {
    let mut left = settings.sizing.sizes.len();
    let mut steps = 0;
    for rung in rungs(settings.optimiser.steps) {
        steps += (left * folds) as u64 * rung;
        left = left.div_ceil(2);
    }
    steps
}

/// Successive halving on the data of all clips.
struct Halving<'a> {
    data: &'a FieldData,
    settings: &'a TrainConfig,
    device: &'a burn::tensor::Device,
    folder: Option<&'a Path>,
    follow: &'a Follow<'a>,
    folds: Vec<Fold>,
    all: u64,
    done: AtomicU64,
}

impl Halving<'_> {
    fn run(&self) -> Result<Sizing, TrainError> {
        let mut results = Results::open(self.folder, self.settings)?;
        let mut left = candidates(&self.settings.sizing);
        for (number, steps) in rungs(self.settings.optimiser.steps).into_iter().enumerate() {
            let rung: Vec<Candidate> = left.iter().map(|c| Candidate { steps, ..*c }).collect();
            // Harm beyond noise grows with steps and size, so the smallest field is asked first. A
            // field without an effect may need more steps.
            if number == 0 && !may_help(&self.rung(&rung[..1], &mut results)?) {
                break;
            }
            let tried = self.rung(&rung, &mut results)?;
            if !may_help(&tried) {
                break;
            }
            left = better_half(&tried);
        }
        Ok(results.into_sizing(&self.settings.sizing, self.judged_clips()))
    }

    /// Trains and judges the candidates of a rung that have no result yet.
    fn rung(&self, rung: &[Candidate], results: &mut Results) -> Result<Vec<Tried>, TrainError> {
        let missing: Vec<Candidate> = rung
            .iter()
            .filter(|c| results.find(c).is_none())
            .copied()
            .collect();
        if !missing.is_empty() {
            self.try_all(&missing, results)?;
        }
        let all = rung.iter().filter_map(|c| results.find(c));
        Ok(all.cloned().collect())
    }

    /// Trains and judges candidates on all folds, and writes their results.
    fn try_all(&self, missing: &[Candidate], results: &mut Results) -> Result<(), TrainError> {
        let started = Instant::now();
        let trials: Vec<(usize, usize)> = (0..missing.len())
            .flat_map(|c| (0..self.folds.len()).map(move |fold| (c, fold)))
            .collect();
        let errors = trials.par_iter().map(|&(c, fold)| self.trial(missing[c], fold));
        let errors = errors.collect::<Result<Vec<MotionErrors>, TrainError>>();
        results.seconds += started.elapsed().as_secs_f64();
        let errors = errors.inspect_err(|_| {
            // The time of an interrupted rung is lost with an error of its file, no more.
            let _ = results.write();
        })?;
        for (candidate, errors) in missing.iter().zip(errors.chunks(self.folds.len())) {
            let gain = Gain::best(errors.iter().flatten());
            let tried = Tried::new(*candidate, gain);
            (self.follow)(SizingEvent::Judged(&tried));
            results.tried.push(tried);
        }
        results.write()?;
        for (candidate, fold) in trials {
            self.folder_of(missing[candidate], fold)
                .iter()
                .for_each(|f| trial::remove(f));
        }
        Ok(())
    }

    fn trial(&self, candidate: Candidate, fold: usize) -> Result<MotionErrors, TrainError> {
        let folder = self.folder_of(candidate, fold);
        let trial = Trial {
            data: self.data,
            device: self.device,
            fold: &self.folds[fold],
            folder: folder.as_deref(),
            config: candidate.config(self.settings),
        };
        trial.run(&|steps| {
            // Relaxed is enough: the counter orders no other memory access.
            let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
            (self.follow)(SizingEvent::Step { done, all: self.all })
        })
    }

    /// Folder of the checkpoints of a trial.
    fn folder_of(&self, candidate: Candidate, fold: usize) -> Option<PathBuf> {
        let name = format!("{}_without_{fold}", candidate.name());
        self.folder.map(|folder| folder.join(name))
    }

    fn judged_clips(&self) -> Vec<String> {
        let stretches = self.folds.iter().flat_map(|fold| &fold.held_out);
        let mut names: Vec<String> = Vec::new();
        for stretch in stretches {
            let name = self.data.clips[stretch.clip].name();
            if !names.iter().any(|n| n == name) {
                names.push(name.to_owned());
            }
        }
        names
    }
}
