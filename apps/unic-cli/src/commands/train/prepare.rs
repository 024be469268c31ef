//! Preparation of a run before the first step of its field: budget, clips and prior.

use super::{
    Run,
    sizing_progress::{SizingProgress, outcome},
};
use crate::{
    failure::Interrupted,
    interrupt::{self, SaveGuard},
    machine,
    output::print_status,
    progress::Progress,
    run_folder::RunRecord,
};
use anyhow::Result;
use std::sync::{Mutex, MutexGuard, PoisonError};
use unic_train::{
    Budget, Control, Dataset, FieldData, FittedPrior, PriorTrainer, Processor, SizingTrainer, TrainError,
    Trainer,
};

/// Preparation of a run's first fit.
pub(super) struct Preparation<'a> {
    pub(super) run: &'a mut Run,
    pub(super) processor: Processor,
    /// Record of a new run, until it is written with the first step. `None` for a resumed run.
    pub(super) new: Option<RunRecord>,
    /// Time for the run, from which its steps are still to be planned.
    pub(super) budget: Option<Budget>,
}

impl Preparation<'_> {
    /// Loads the clips, fits the prior or continues to fit it, and plans the steps.
    ///
    /// # Errors
    /// Clips that cannot be read, a prior that cannot be fitted, files of the run that cannot be
    /// written, an interruption.
    pub(super) fn trainer(mut self) -> Result<Trainer> {
        let capture = self.run.capture.clone();
        // A resumed run keeps the settings of the prior that it began with.
        if let (Some(budget), Some(_)) = (&self.budget, &self.new) {
            budget.shorten_prior(&mut self.run.config, &capture, self.processor)?;
            interrupt::check()?;
        }
        let data = Dataset::load(capture, &self.run.config, self.run.fits[0])?;
        if let Some(preview) = &self.run.preview {
            preview.begin(&data);
        }
        interrupt::check()?;
        let prior = self.prior(&data)?;
        let data = FieldData::new(data, prior, &self.run.config)?;
        let mut trainer = Trainer::on(self.processor, data, self.run.config.clone())?;
        if let Some(budget) = &self.budget {
            print_status("timing a few steps to fill the budget");
            budget.set_steps(&mut self.run.config, &mut trainer, self.run.fits)?;
            interrupt::check()?;
            trainer = Trainer::on(self.processor, trainer.into_data(), self.run.config.clone())?;
        }
        // The trainer has computed the number of steps from the epochs. It is stored, so that a
        // resumed run has the same schedule.
        self.run.config = trainer.config().clone();
        self.begin()?;
        self.run.folder.write_config(&self.run.config)?;
        // The steps are planned and stored: a run that is resumed from here on needs no budget.
        if let Some(record) = self.run.folder.stored_record()?.planned() {
            self.run.folder.write_record(&record)?;
        }
        self.sized(trainer.into_data())
    }

    /// Chooses the field's size, or continues to choose it, with progress.
    ///
    /// # Errors
    /// A failure of a training or of its files, an interruption.
    fn sized(&mut self, mut data: FieldData) -> Result<Trainer> {
        let folder = self.run.folder.checkpoints_of_sizing();
        let sizing = SizingTrainer {
            data: &mut data,
            settings: &self.run.config,
            processor: self.processor,
            folder: Some(&folder),
        };
        let _saving = interrupt::begin_saving();
        let shown = Mutex::new(SizingProgress::new(&self.run.folder));
        let sizing = sizing.run(&|event| locked(&shown).follow(event));
        let shown = shown.into_inner().unwrap_or_else(PoisonError::into_inner);
        shown.finish()?;
        let sizing = match sizing {
            Err(TrainError::Stopped) => Err(Interrupted(format!(
                "stopped while the field's size was chosen, which is saved; continue with `{}`",
                self.run.resume_command
            ))
            .into()),
            sizing => sizing.map_err(anyhow::Error::from),
        }?;
        if let Some(sizing) = &sizing {
            let outcome = outcome(sizing);
            print_status(&outcome);
            self.run.folder.log(&outcome)?;
        }
        let trainer = Trainer::sized(self.processor, data, &self.run.config, sizing.as_ref())?;
        self.run.sizing = sizing;
        Ok(trainer)
    }

    /// Fits the prior, with progress. The run begins with the first step of the prior's recurrence,
    /// from which on it can be resumed.
    ///
    /// # Errors
    /// A failure of the fit or of the run's files, an interruption.
    fn prior(&mut self, data: &Dataset) -> Result<FittedPrior> {
        if self.new.is_some() {
            // Those of an overwritten run, which a new one must not continue from.
            self.run.folder.clear_prior()?;
        }
        let folder = self.run.folder.checkpoints_of_prior();
        let state = Mutex::new(Following::default());
        let settings = self.run.config.clone();
        let trainer = PriorTrainer {
            data,
            settings: &settings,
            processor: self.processor,
            folder: Some(&folder),
        };
        // Recurrences train on several threads, whose reports change what is behind these locks.
        let this = Mutex::new(&mut *self);
        let watch = |done: u64, all: u64| {
            let mut following = locked(&state);
            // Before the first step there is nothing to save, nor to continue from.
            if following.saving.is_none() && done > 0 {
                following.saving = Some(interrupt::begin_saving());
                following.begun = locked(&this).begin();
            }
            let shown = following
                .progress
                .get_or_insert_with(|| Progress::new("fitting the prior", done, all));
            shown.set(done, String::new);
            match following.begun.is_err() {
                true => Control::Stop,
                false => interrupt::control(),
            }
        };
        let fitted = trainer.run(&watch);
        let following = state.into_inner().unwrap_or_else(PoisonError::into_inner);
        drop(following.progress);
        following.begun?;
        match fitted {
            // Before the first step: the run has no files yet.
            Err(TrainError::Stopped) if self.new.is_some() => Err(interrupt::interrupted().into()),
            Err(TrainError::Stopped) => Err(Interrupted(format!(
                "stopped while the prior was trained, which is saved; continue with `{}`",
                self.run.resume_command
            ))
            .into()),
            fitted => Ok(fitted?),
        }
    }

    /// Writes the files of a new run, once.
    fn begin(&mut self) -> Result<()> {
        match self.new.take() {
            Some(mut record) => {
                record.budget_s = self.budget.map(|budget| budget.duration.as_secs_f64());
                self.run.folder.begin(&self.run.config, &record)?;
                self.run.folder.log(&machine::description())
            }
            None => Ok(()),
        }
    }
}

/// State of the callback that follows the training of the prior.
struct Following {
    progress: Option<Progress>,
    /// Alive from the first step on, since a stop must save the prior.
    saving: Option<SaveGuard>,
    /// Result of writing the files of a new run. An error stops the training.
    begun: Result<()>,
}

impl Default for Following {
    fn default() -> Self {
        Self {
            progress: None,
            saving: None,
            begun: Ok(()),
        }
    }
}

/// Locks a mutex, also after a panic in another thread: the values are valid at any time.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
