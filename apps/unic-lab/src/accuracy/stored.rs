//! Training of one row with one seed on one capture, and its stored result.

use super::{
    measure, networks,
    row::{RowSettings, Training},
};
use crate::args::AccuracyArgs;
use crate::comparison::ComparisonConfig;
use anyhow::{Result, anyhow};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};
use unic_cli::{
    args::{ProcessorName, TrainArgs},
    commands::train,
    failure::Usage,
    model_file,
    timing::Timing,
};
use unic_core::{Animator, Model, Precision};
use unic_eval::{Evaluation, ModelPredictor, NamedPredictor};
use unic_io::{Capture, Split, atomic};
use unic_train::TrainConfig;

/// Training to do, and the place of its result.
pub(super) struct TrainingJob<'a> {
    row: &'a RowSettings,
    seed: u64,
    capture: &'a Path,
    args: &'a AccuracyArgs,
    /// Path of the model, its run and its result, without the ending.
    stem: PathBuf,
}

/// Result of a training, as it is stored.
#[derive(Serialize, Deserialize)]
pub(super) struct Trained {
    pub(super) seed: u64,
    /// Settings and budget of the training. A result of others is refused.
    asked: String,
    pub(super) steps: u64,
    /// Duration of the training, with the prior's fit and without loading, seconds.
    pub(super) training_seconds: f64,
    /// Number of trained parameters.
    pub(super) parameters: usize,
    /// Size of the model, bytes.
    pub(super) bytes: usize,
    /// Median time of a frame, milliseconds.
    pub(super) frame_ms: f64,
    pub(super) evaluation: Evaluation,
}

impl<'a> TrainingJob<'a> {
    pub(super) fn new(
        args: &'a AccuracyArgs,
        capture: &'a Path,
        folder: &Path,
        row: &'a RowSettings,
        seed: u64,
    ) -> Self {
        let stem = folder.join(&row.name).join(format!("seed-{seed}"));
        Self {
            row,
            seed,
            capture,
            args,
            stem,
        }
    }

    /// Returns the budget of each training in words.
    pub(super) fn budget_in_words(args: &AccuracyArgs) -> String {
        match args.steps {
            Some(steps) => format!("{steps} steps"),
            None => humantime::format_duration(args.budget).to_string(),
        }
    }

    /// Returns the stored result, or trains and measures where there is none.
    pub(super) fn trained(&self, capture: &Capture) -> Result<Trained> {
        let path = self.stem.with_extension("json");
        // Texts are compared instead of parsed settings, so that a new default makes stored results
        // differ.
        let asked = self.asked();
        self.check_begun(&asked)?;
        if let Ok(text) = fs::read_to_string(&path) {
            let kept: Trained =
                serde_json::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()))?;
            return match kept.asked == asked {
                true => Ok(kept),
                false => Err(other(&path)),
            };
        }
        let trained = self.train(asked, capture)?;
        // Written when it is complete: an interrupted benchmark leaves no partial result.
        atomic::write(&path, serde_json::to_string_pretty(&trained)?.as_bytes())?;
        Ok(trained)
    }

    /// Refuses to go on with a stopped training of other settings or another budget. The first
    /// training stores its own.
    fn check_begun(&self, asked: &str) -> Result<()> {
        let path = self.stem.with_extension("asked.toml");
        match fs::read_to_string(&path) {
            Ok(begun) if begun != asked => Err(other(&path)),
            Ok(_) => Ok(()),
            Err(_) => {
                let folder = path.parent().unwrap_or(Path::new("."));
                fs::create_dir_all(folder)
                    .map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
                Ok(atomic::write(&path, asked.as_bytes())?)
            }
        }
    }

    /// Returns settings and budget as TOML.
    fn asked(&self) -> String {
        let budget = Self::budget_in_words(self.args);
        format!("budget = \"{budget}\"\n{}", self.row.training.to_toml())
    }

    /// Trains and measures.
    fn train(&self, asked: String, capture: &Capture) -> Result<Trained> {
        match &self.row.training {
            Training::Model(config) => self.train_model(asked, config, capture),
            Training::Network(config) => self.train_network(asked, config, capture),
        }
    }

    /// Trains a model and measures it.
    fn train_model(&self, asked: String, config: &TrainConfig, capture: &Capture) -> Result<Trained> {
        let settings = self.stem.with_extension("settings.toml");
        let model_path = self.stem.with_extension("unic");
        atomic::write(&settings, config.to_toml().as_bytes())?;
        let summary = train::train(&self.train_args(settings, model_path.clone()))?;
        let animator = Animator::new(Arc::new(exact(model_file::read(&model_path)?)));
        let mut predictors = [NamedPredictor::model(ModelPredictor::from_animator(
            animator.clone(),
        ))];
        let evaluation = measure::on_test_clips(capture, &mut predictors)?;
        let clips = capture.clip_names(Split::Test);
        Ok(Trained {
            seed: self.seed,
            asked,
            steps: summary.steps,
            training_seconds: summary.seconds,
            parameters: summary.parameters,
            bytes: summary.bytes,
            frame_ms: Timing::measure(animator, capture, clips)?.frame_ms,
            evaluation,
        })
    }

    /// Trains a network of another method and measures it.
    fn train_network(&self, asked: String, config: &ComparisonConfig, capture: &Capture) -> Result<Trained> {
        let budget = match self.args.steps {
            Some(steps) => networks::Budget::Steps(steps),
            None => networks::Budget::Time(self.args.budget),
        };
        let trained = networks::train(config, self.seed, budget, capture)?;
        let mut predictors = [NamedPredictor::model(trained.predictor)];
        let evaluation = measure::on_test_clips(capture, &mut predictors)?;
        Ok(Trained {
            seed: self.seed,
            asked,
            steps: trained.steps,
            training_seconds: trained.seconds,
            parameters: trained.parameters,
            bytes: size_of::<f32>() * trained.parameters,
            frame_ms: networks::frame_ms(predictors[0].predictor.as_mut(), capture)?,
            evaluation,
        })
    }

    /// Returns the options of `unic train` that begin or resume the training of a model.
    fn train_args(&self, settings: PathBuf, model: PathBuf) -> TrainArgs {
        let steps = self.args.steps;
        // A run that exists takes its settings, seed and budget from its own folder.
        let run_exists = model.with_extension("run").join("config.toml").exists();
        TrainArgs {
            capture: self.capture.to_path_buf(),
            preset: None,
            config: (!run_exists).then_some(settings),
            set: Vec::new(),
            seed: (!run_exists).then_some(self.seed),
            steps: steps.filter(|_| !run_exists),
            budget: (steps.is_none() && !run_exists).then_some(self.args.budget),
            device: ProcessorName::Cpu,
            out: Some(model),
            resume: run_exists,
            overwrite: !run_exists,
            view: false,
            force: self.args.force,
            json: false,
        }
    }
}

/// Returns the error of a result with other settings or another budget.
fn other(path: &Path) -> anyhow::Error {
    let path = path.display();
    let text = format!(
        "{path}: expected a result of the same settings and budget, found another; choose another --out"
    );
    Usage(text).into()
}

/// Model in f32, so that tables of all machines compare.
fn exact(model: Model) -> Model {
    model.with_precision(Precision::F32)
}
