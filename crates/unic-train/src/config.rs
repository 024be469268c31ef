//! Training settings and the presets.

use serde::{Deserialize, Serialize};
use thiserror::Error;
use unic_core::{
    config::{EncoderConfig, FieldConfig, PointInput},
    motion::{MotionLayout, NormalisationRule, NormalisedElements, VelocityScheme},
};

/// Everything that a run depends on beside its capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// Seed of all random streams.
    pub seed: u64,
    /// The model to train.
    pub model: ModelSettings,
    /// AdamW and its schedule.
    pub optimiser: OptimiserConfig,
    /// What one step sees.
    pub batch: BatchConfig,
    /// Noise and augmentation.
    pub regularisation: RegularisationConfig,
    /// Weights of the loss terms.
    pub loss: LossConfig,
    /// Intersection handling in the training loop and in the finished model.
    pub intersection: IntersectionConfig,
    /// Which parameters the finished model gets.
    pub keep: Keep,
    /// Free-running error on the validation clips every so many steps.
    pub validate_every: u64,
}

/// The model, without what only the capture can tell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSettings {
    /// Layout of the motion vector.
    pub layout: MotionLayout,
    /// Direction of differences in the motion vector.
    pub velocity: VelocityScheme,
    /// Scaling of the motion vector.
    pub normalisation: NormalisationRule,
    /// Motion encoder.
    pub encoder: EncoderConfig,
    /// Deformation field.
    pub field: FieldConfig,
    /// State of a vertex.
    pub state: StateSettings,
}

/// As `unic_core::config::StateConfig`, its scales measured on the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum StateSettings {
    /// The paper's: positions in the frame of the first root pose.
    Position,
    /// Displacement carried by the skeleton.
    Displacement {
        /// Time constant of forgetting, seconds.
        memory_s: f32,
        /// Shapes of the linear prior; 0 leaves the mean alone.
        prior_shapes: usize,
        /// Inputs of the field.
        inputs: Vec<PointInput>,
    },
}

/// AdamW (Loshchilov & Hutter 2019) with a cosine schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimiserConfig {
    /// Optimiser steps of the whole run.
    pub steps: u64,
    /// Learning rate at the start.
    pub learning_rate: f64,
    /// Learning rate at the minima of the cosine.
    pub final_learning_rate: f64,
    /// Half periods of the cosine in a run: 1 falls once; 3 falls, rises and falls, as the paper's
    /// 300 epochs with a half period of 100 do.
    pub half_periods: f64,
    /// Steps over which the learning rate rises from zero.
    pub warmup_steps: u64,
    /// Decoupled weight decay.
    pub weight_decay: f32,
    /// Largest global norm of the gradient; 0 leaves gradients as they are.
    pub clip_norm: f64,
}

/// Windows of consecutive frames, a random subset of the vertices in each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatchConfig {
    /// Windows in a step.
    pub windows: usize,
    /// Vertices of each window: the field is pointwise, so any subset will do.
    pub points: usize,
    /// Frames that a window is rolled out over at the start; 1 is teacher forcing.
    pub unroll_first: usize,
    /// Frames at the end; the length grows linearly until `unroll_grown`.
    pub unroll_last: usize,
    /// Share of the run after which windows have their full length.
    pub unroll_grown: f64,
}

/// Against overfitting and drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegularisationConfig {
    /// Probability by which inputs of the encoder's linear maps are dropped.
    pub dropout: f32,
    /// Probability for the motion vector itself, the input of the first map.
    pub input_dropout: f32,
    /// One dropout mask for all frames of a window, so that a rollout sees one thinned network.
    pub dropout_by_window: bool,
    /// Standard deviation of the noise on the state that a window starts from, metres; smooth over the garment.
    pub state_noise_m: f32,
    /// Standard deviation of the noise on normalised motion vectors.
    pub motion_noise: f32,
    /// Half of the windows are mirrored left to right.
    pub mirror: bool,
    /// Decay of the running mean of the parameters that the finished model takes; 0 takes the last ones.
    pub average: f64,
}

/// Mean squares in m², times these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LossConfig {
    /// λ of the paper, on positions.
    pub position: f32,
    /// On differences of consecutive frames.
    pub velocity: f32,
}

/// Intersection handling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntersectionConfig {
    /// In training from this step on, the corrections without gradient; absent: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_step: Option<u64>,
    /// r of the paper, metres.
    pub relaxation_m: f32,
    /// In the finished model.
    pub at_inference: bool,
}

/// Which parameters the finished model gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Keep {
    /// Those of the last step.
    Last,
    /// Those of the validation with the smallest free-running error.
    Best,
}

/// Named starting points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// The published method with its sizes, for comparison.
    Paper,
    /// The best that we know; see ARCHITECTURE.md.
    Standard,
    /// Small, for slow machines and tests.
    Tiny,
}

/// Settings that no run can be made from.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// Not TOML of this shape.
    #[error("training settings: {0}")]
    Toml(#[from] toml::de::Error),
    /// A `key=value` that is none.
    #[error("expected key=value with a dotted key such as optimiser.steps=1000, found `{0}`")]
    Assignment(String),
    /// A value out of range.
    #[error("training settings: {what} must be {expected}, found {found}")]
    Value {
        /// Dotted key.
        what: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
}

impl TrainConfig {
    /// The settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        match preset {
            Preset::Paper => paper(),
            Preset::Standard => standard(),
            Preset::Tiny => tiny(),
        }
    }

    /// These settings with `key=value` assignments, keys dotted as in the TOML file.
    ///
    /// # Errors
    /// Assignments that are none, keys that do not exist, values of another type or out of range.
    pub fn with_assignments(&self, assignments: &[String]) -> Result<Self, SettingsError> {
        let mut table = toml::Table::try_from(self).map_err(|e| SettingsError::Assignment(e.to_string()))?;
        for assignment in assignments {
            let wrong = || SettingsError::Assignment(assignment.clone());
            let (key, value) = assignment.split_once('=').ok_or_else(wrong)?;
            let value = parse_value(value.trim());
            assign(&mut table, key.trim(), value).ok_or_else(wrong)?;
        }
        let config: Self = table.try_into()?;
        config.check()?;
        Ok(config)
    }

    /// Reads a complete settings file.
    ///
    /// # Errors
    /// Missing or unknown keys, values of another type or out of range.
    pub fn from_toml(text: &str) -> Result<Self, SettingsError> {
        let config: Self = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// The settings as a file that [`TrainConfig::from_toml`] reads.
    pub fn to_toml(&self) -> String {
        // Only maps with keys that are no strings cannot be written, and there are none.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// # Errors
    /// The first value out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let b = &self.batch;
        let o = &self.optimiser;
        let r = &self.regularisation;
        let share = |x: f32| (0.0..1.0).contains(&x);
        let counts = [
            ("batch.windows", b.windows, 1 << 16),
            ("batch.points", b.points, 1 << 20),
            ("batch.unroll_first", b.unroll_first, 1 << 10),
            ("batch.unroll_last", b.unroll_last, 1 << 10),
        ];
        for (what, found, most) in counts {
            ensure(
                what,
                "1 or more, and not absurd",
                found,
                (1..=most).contains(&found),
            )?;
        }
        ensure("optimiser.steps", "1 or more", o.steps, o.steps > 0)?;
        ensure(
            "validate_every",
            "1 or more",
            self.validate_every,
            self.validate_every > 0,
        )?;
        let rate = o.learning_rate;
        ensure(
            "optimiser.learning_rate",
            "above 0",
            rate,
            rate > 0.0 && rate.is_finite(),
        )?;
        for (what, found) in self.amounts() {
            ensure(what, "0 or more", found, found >= 0.0 && found.is_finite())?;
        }
        ensure(
            "regularisation.dropout",
            "at least 0 and below 1",
            r.dropout,
            share(r.dropout),
        )?;
        ensure(
            "regularisation.input_dropout",
            "at least 0 and below 1",
            r.input_dropout,
            share(r.input_dropout),
        )?;
        ensure(
            "regularisation.average",
            "at least 0 and below 1",
            r.average,
            (0.0..1.0).contains(&r.average),
        )
    }

    /// Values of which any amount will do.
    fn amounts(&self) -> [(&'static str, f64); 10] {
        let (o, r) = (&self.optimiser, &self.regularisation);
        [
            ("optimiser.final_learning_rate", o.final_learning_rate),
            ("optimiser.half_periods", o.half_periods),
            ("optimiser.weight_decay", o.weight_decay.into()),
            ("optimiser.clip_norm", o.clip_norm),
            ("batch.unroll_grown", self.batch.unroll_grown),
            ("regularisation.state_noise_m", r.state_noise_m.into()),
            ("regularisation.motion_noise", r.motion_noise.into()),
            ("loss.position", self.loss.position.into()),
            ("loss.velocity", self.loss.velocity.into()),
            ("intersection.relaxation_m", self.intersection.relaxation_m.into()),
        ]
    }

    /// Frames that windows are rolled out over at a step.
    pub fn unroll(&self, step: u64) -> usize {
        let b = &self.batch;
        let grown = (self.optimiser.steps as f64 * b.unroll_grown).max(1.0);
        let share = (step as f64 / grown).min(1.0);
        let length = b.unroll_first as f64 + (b.unroll_last as f64 - b.unroll_first as f64) * share;
        (length.round() as usize).max(1)
    }

    /// Learning rate of a step: warm-up, then cosine between the two rates.
    pub fn learning_rate(&self, step: u64) -> f64 {
        let o = &self.optimiser;
        let phase = std::f64::consts::PI * o.half_periods * step as f64 / o.steps as f64;
        let rate =
            o.final_learning_rate + (o.learning_rate - o.final_learning_rate) * (1.0 + phase.cos()) / 2.0;
        let warmup = (step + 1) as f64 / o.warmup_steps.max(1) as f64;
        rate * warmup.min(1.0)
    }
}

fn ensure(
    what: &'static str,
    expected: &'static str,
    found: impl std::fmt::Display,
    holds: bool,
) -> Result<(), SettingsError> {
    if holds {
        return Ok(());
    }
    let found = found.to_string();
    Err(SettingsError::Value {
        what,
        expected,
        found,
    })
}

/// A TOML value, or a string where it is none: `keep=best` needs no quotes.
fn parse_value(text: &str) -> toml::Value {
    let document: Result<toml::Table, _> = toml::from_str(&format!("value = {text}"));
    let value = document.ok().and_then(|mut table| table.remove("value"));
    value.unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

fn assign(table: &mut toml::Table, key: &str, value: toml::Value) -> Option<()> {
    match key.split_once('.') {
        Some((head, rest)) => assign(table.get_mut(head)?.as_table_mut()?, rest, value),
        None => {
            table.insert(key.to_owned(), value);
            Some(())
        }
    }
}

/// Sizes, optimiser, schedule and teacher forcing of the paper (section 4.1) and the authors'
/// release; a batch is subsampled, which the pointwise field allows.
fn paper() -> TrainConfig {
    TrainConfig {
        seed: 1,
        model: ModelSettings {
            layout: MotionLayout::Paper,
            velocity: VelocityScheme::Forward,
            normalisation: NormalisationRule::PAPER,
            encoder: EncoderConfig {
                hidden: vec![4096, 4096],
                channels: 128,
                categories: 8,
            },
            field: FieldConfig {
                width: 256,
                hidden_layers: 8,
                skip: Some(5),
            },
            state: StateSettings::Position,
        },
        optimiser: OptimiserConfig {
            steps: 3000,
            learning_rate: 1e-4,
            final_learning_rate: 1e-6,
            half_periods: 3.0,
            warmup_steps: 0,
            weight_decay: 1e-4,
            clip_norm: 0.0,
        },
        batch: BatchConfig {
            windows: 128,
            points: 256,
            unroll_first: 1,
            unroll_last: 1,
            unroll_grown: 1.0,
        },
        regularisation: RegularisationConfig {
            dropout: 0.25,
            input_dropout: 0.25,
            dropout_by_window: false,
            state_noise_m: 0.0,
            motion_noise: 0.0,
            mirror: false,
            average: 0.0,
        },
        loss: LossConfig {
            position: 1e4,
            velocity: 0.0,
        },
        intersection: IntersectionConfig {
            from_step: None,
            relaxation_m: 0.005,
            at_inference: true,
        },
        keep: Keep::Last,
        validate_every: 500,
    }
}

/// Small and briefly trained on purpose. Chosen by leaving clips out of the T-shirt in the shared
/// data (35 s of motion in all): wider networks and more steps fit the training clips better and
/// unseen ones worse, long rollouts and a long memory help, and so does the prior.
fn standard() -> TrainConfig {
    use PointInput::{Displacement, Rest, SkinVelocity, Up, Velocity};
    TrainConfig {
        model: ModelSettings {
            layout: MotionLayout::Heading,
            velocity: VelocityScheme::Backward,
            normalisation: NormalisationRule {
                elements: NormalisedElements::All,
                least_std: 0.02,
                limit: Some(5.0),
            },
            encoder: EncoderConfig {
                hidden: vec![128],
                channels: 32,
                categories: 8,
            },
            field: FieldConfig {
                width: 32,
                hidden_layers: 4,
                skip: None,
            },
            state: StateSettings::Displacement {
                memory_s: 2.0,
                prior_shapes: 32,
                inputs: vec![Displacement, Velocity, Rest, Up, SkinVelocity],
            },
        },
        optimiser: OptimiserConfig {
            steps: 300,
            learning_rate: 3e-4,
            final_learning_rate: 1e-6,
            half_periods: 1.0,
            warmup_steps: 100,
            weight_decay: 1e-2,
            clip_norm: 1.0,
        },
        batch: BatchConfig {
            windows: 16,
            points: 64,
            unroll_first: 8,
            unroll_last: 24,
            unroll_grown: 0.6,
        },
        regularisation: RegularisationConfig {
            dropout: 0.5,
            input_dropout: 0.5,
            dropout_by_window: true,
            state_noise_m: 0.01,
            motion_noise: 0.0,
            mirror: true,
            average: 0.98,
        },
        loss: LossConfig {
            position: 1e4,
            velocity: 0.0,
        },
        keep: Keep::Last,
        validate_every: 50,
        ..paper()
    }
}

fn tiny() -> TrainConfig {
    let standard = standard();
    TrainConfig {
        model: ModelSettings {
            encoder: EncoderConfig {
                hidden: vec![64],
                channels: 16,
                categories: 8,
            },
            field: FieldConfig {
                width: 32,
                hidden_layers: 4,
                skip: None,
            },
            ..standard.model
        },
        optimiser: OptimiserConfig {
            steps: 100,
            ..standard.optimiser
        },
        batch: BatchConfig {
            windows: 8,
            points: 64,
            unroll_first: 4,
            unroll_last: 12,
            ..standard.batch
        },
        validate_every: 50,
        ..standard
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_survive_their_own_file() {
        for preset in [Preset::Paper, Preset::Standard, Preset::Tiny] {
            let config = TrainConfig::preset(preset);
            config.check().unwrap();
            assert_eq!(TrainConfig::from_toml(&config.to_toml()).unwrap(), config);
        }
    }

    #[test]
    fn assignments_reach_nested_keys_and_refuse_unknown_ones() {
        let config = TrainConfig::preset(Preset::Tiny);
        let set = |text: &str| config.with_assignments(&[text.to_owned()]);
        assert_eq!(set("optimiser.steps=7").unwrap().optimiser.steps, 7);
        assert_eq!(set("keep = last").unwrap().keep, Keep::Last);
        assert_eq!(
            set("intersection.from_step=5").unwrap().intersection.from_step,
            Some(5)
        );
        for wrong in [
            "steps",
            "optimiser.stepz=7",
            "nowhere.steps=7",
            "optimiser.steps=x",
            "batch.points=0",
            "loss.velocity=-1",
            "optimiser.clip_norm=nan",
            "optimiser.learning_rate=inf",
        ] {
            assert!(set(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_schedule_of_the_paper_rises_again() {
        let config = TrainConfig::preset(Preset::Paper);
        let third = config.optimiser.steps / 3;
        assert!((config.learning_rate(0) - 1e-4).abs() < 1e-12);
        assert!((config.learning_rate(third) - 1e-6).abs() < 1e-9);
        assert!((config.learning_rate(2 * third) - 1e-4).abs() < 1e-9);
        assert!((config.learning_rate(3 * third) - 1e-6).abs() < 1e-9);
    }

    #[test]
    fn unrolling_grows_to_its_full_length() {
        let config = TrainConfig::preset(Preset::Standard);
        assert_eq!(config.unroll(0), config.batch.unroll_first);
        assert_eq!(
            config.unroll(config.optimiser.steps - 1),
            config.batch.unroll_last
        );
        assert_eq!(TrainConfig::preset(Preset::Paper).unroll(10), 1);
    }
}
