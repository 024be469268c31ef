//! One training of one row on one capture, and what is kept of it.

use super::{
    measure, rival,
    row::{RowSettings, Training},
};
use crate::{
    args::{AccuracyArgs, ProcessorName, TrainArgs},
    commands::{eval::timing::Timing, train},
    failure::Usage,
    model_file,
};
use anyhow::{Result, anyhow};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};
use unic_core::animator::Animator;
use unic_eval::{Evaluation, ModelPredictor, Row};
use unic_io::{Capture, Split, atomic};
use unic_train::{RivalConfig, TrainConfig};

/// What is asked for, and where it is kept.
pub(super) struct Cell<'a> {
    row: &'a RowSettings,
    seed: u64,
    capture: &'a Path,
    args: &'a AccuracyArgs,
    /// Without an ending: of the model, its run and its numbers.
    stem: PathBuf,
}

/// What came of it.
#[derive(Serialize, Deserialize)]
pub(super) struct Trained {
    pub(super) seed: u64,
    /// Settings and budget that it was asked for by; another answer is no answer to them.
    asked: String,
    pub(super) steps: u64,
    /// Training time with the prior's, without loading.
    pub(super) training_seconds: f64,
    pub(super) parameters: usize,
    pub(super) bytes: usize,
    /// Median of a frame, milliseconds.
    pub(super) frame_ms: f64,
    pub(super) evaluation: Evaluation,
}

impl<'a> Cell<'a> {
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

    /// Of each training, in words.
    pub(super) fn budget(args: &AccuracyArgs) -> String {
        match args.steps {
            Some(steps) => format!("{steps} steps"),
            None => humantime::format_duration(args.budget).to_string(),
        }
    }

    /// Read where it is kept, else trained and measured now.
    pub(super) fn trained(&self, capture: &Capture) -> Result<Trained> {
        let path = self.stem.with_extension("json");
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
        atomic::write(&path, serde_json::to_string_pretty(&trained)?.as_bytes())?;
        Ok(trained)
    }

    /// A training that was stopped goes on only for the settings and the budget that it was begun with.
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

    fn asked(&self) -> String {
        let budget = Self::budget(self.args);
        format!("budget = \"{budget}\"\n{}", self.row.training.to_toml())
    }

    fn train(&self, asked: String, capture: &Capture) -> Result<Trained> {
        match &self.row.training {
            Training::Model(config) => self.train_model(asked, config, capture),
            Training::Rival(config) => self.train_rival(asked, config, capture),
        }
    }

    fn train_model(&self, asked: String, config: &TrainConfig, capture: &Capture) -> Result<Trained> {
        let settings = self.stem.with_extension("settings.toml");
        let model_path = self.stem.with_extension("unic");
        atomic::write(&settings, config.to_toml().as_bytes())?;
        let summary = train::train(&self.train_args(settings, model_path.clone()))?;
        let animator = Animator::new(Arc::new(model_file::read(&model_path)?));
        let mut rows = [Row::model(ModelPredictor::from_animator(animator.clone()))];
        let evaluation = measure::rows_of(capture, &mut rows)?;
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

    fn train_rival(&self, asked: String, config: &RivalConfig, capture: &Capture) -> Result<Trained> {
        let budget = match self.args.steps {
            Some(steps) => rival::Budget::Steps(steps),
            None => rival::Budget::Time(self.args.budget),
        };
        let trained = rival::train(config, self.seed, budget, capture)?;
        let mut rows = [Row::model(trained.predictor)];
        let evaluation = measure::rows_of(capture, &mut rows)?;
        Ok(Trained {
            seed: self.seed,
            asked,
            steps: trained.steps,
            training_seconds: trained.seconds,
            parameters: trained.parameters,
            bytes: size_of::<f32>() * trained.parameters,
            frame_ms: rival::frame_ms(rows[0].predictor.as_mut(), capture)?,
            evaluation,
        })
    }

    fn train_args(&self, settings: PathBuf, model: PathBuf) -> TrainArgs {
        let steps = self.args.steps;
        let is_begun = model.with_extension("run").join("config.toml").exists();
        TrainArgs {
            capture: self.capture.to_path_buf(),
            preset: None,
            config: (!is_begun).then_some(settings),
            set: Vec::new(),
            seed: (!is_begun).then_some(self.seed),
            steps: steps.filter(|_| !is_begun),
            budget: (steps.is_none() && !is_begun).then_some(self.args.budget),
            device: ProcessorName::Cpu,
            out: Some(model),
            resume: is_begun,
            overwrite: !is_begun,
            force: self.args.force,
            json: false,
        }
    }
}

fn other(path: &Path) -> anyhow::Error {
    let path = path.display();
    let text = format!(
        "{path}: expected a result of the same settings and budget, found another; choose another --out"
    );
    Usage(text).into()
}
