//! Training settings.

mod check;
mod keys;
mod length;
mod presets;
mod products;
mod shown;
#[cfg(test)]
mod tests;
mod text;

pub use check::SettingsError;
pub use length::PUBLISHED_EPOCHS;
pub use presets::Preset;
pub use products::Products;
pub use shown::ReplaySettings;
pub(crate) use shown::{MOST_CHORD_DEVIATIONS, ProjectionSettings};

use serde::{Deserialize, Serialize};
use unic_core::{
    config::{Corrects, EncoderConfig, FieldConfig, IntersectionMode, PointInput},
    motion::{MotionLayout, NormalisationRule, Spring, VelocityScheme},
};

/// Everything that a run depends on beside its capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// Seed of all random streams.
    pub seed: u64,
    /// Seconds of training motion that are used, the same share of every clip from its start;
    /// absent: all there is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion_seconds: Option<f64>,
    /// The model to train.
    pub model: ModelSettings,
    /// AdamW and its schedule.
    pub optimiser: OptimiserConfig,
    /// Size of a training step's batch.
    pub batch: BatchConfig,
    /// Noise and augmentation.
    pub regularisation: RegularisationConfig,
    /// Weights of the loss terms.
    pub loss: LossConfig,
    /// Intersection handling of the finished model.
    pub intersection: IntersectionConfig,
    /// Strain projection of the finished model.
    #[serde(default)]
    pub projection: ProjectionSettings,
    /// Replay of wrinkles.
    #[serde(default)]
    pub replay: ReplaySettings,
    /// Choice of the field's size.
    #[serde(default)]
    pub sizing: SizingSettings,
    /// Validation during the run, and the fit after it.
    pub validation: ValidationConfig,
}

/// Settings of the model. Scales and sizes that depend on the capture are measured on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSettings {
    /// Layout of the motion vector.
    pub layout: MotionLayout,
    /// Direction of differences in the motion vector.
    pub velocity: VelocityScheme,
    /// Springs of each joint, whose offsets the motion vector holds. Up to 24 joints have them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<Spring>,
    /// Scaling of the motion vector.
    pub normalisation: NormalisationRule,
    /// Motion encoder.
    pub encoder: EncoderConfig,
    /// Deformation field.
    pub field: FieldConfig,
    /// State of a vertex.
    pub state: StateSettings,
}

/// State of a vertex, as in [`unic_core::config::StateConfig`] but without the scales, which are
/// measured on the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum StateSettings {
    /// The paper's: positions relative to the root joint, turned by the inverse of the first root
    /// rotation.
    RootRelative,
    /// Displacement carried by the skeleton.
    Displacement {
        /// Skinning weights of the garment.
        // Runs of earlier versions have none.
        #[serde(default)]
        skinning: SkinningSource,
        /// Time constant of forgetting, seconds.
        memory_s: f32,
        /// Excursion of the predicted garment within which a given garment stays as it lies, metres,
        /// in models whose field has a share of 0. With 0 it fades with `memory_s` alone.
        // Runs of earlier versions have none.
        #[serde(default)]
        excursion_m: f32,
        /// Number of principal components of the prior. With 0 the prior is the mean displacement.
        prior_shapes: usize,
        /// Recurrent part of the prior. Without it the prior depends on the current motion alone.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        recurrence: Option<RecurrenceSettings>,
        /// Inputs of the field.
        inputs: Vec<PointInput>,
    },
}

/// Skinning weights that a model's garment has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SkinningSource {
    /// Weights of the capture.
    #[default]
    Given,
    /// Weights that are fitted to the garment's motion in the training clips, from those of the capture.
    Fitted,
}

/// Sizes and training of a prior's recurrence, see [`unic_core::recurrence::Recurrence`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecurrenceSettings {
    /// First values of the parameters.
    #[serde(default = "RecurrenceStart::random")]
    pub start: RecurrenceStart,
    /// Oscillators M.
    pub oscillators: usize,
    /// Width of the embedding and of the hidden layer.
    pub width: usize,
    /// Largest number of AdamW steps of the model's recurrence. The recurrences of cross-validation
    /// train on less motion and take proportionally fewer steps.
    pub steps: u64,
    /// Largest number of passes over the frames of motion. It limits the steps for captures with
    /// few clips, which are soon memorised.
    pub epochs: u64,
    /// Peak learning rate: the end of a warm-up over a sixth of the steps and the start of a half
    /// period of the cosine.
    pub learning_rate: f64,
    /// Windows in a step.
    pub windows: usize,
    /// Frames of a window.
    pub frames: usize,
    /// Dropout rate of inputs and hidden activations, at least 0 and below 1. A window has one
    /// mask.
    pub dropout: f32,
    /// Wanted share, 0 to 1, of the true energy of swings above half a hertz on motions left out.
    /// Least squares predict too little of it, and the cloth appears stiff. Training targets are
    /// scaled up to this share, by a factor of at most 1.5 in the blend; 0 leaves them as they are.
    pub swing: f32,
}

/// First values of a recurrence's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecurrenceStart {
    /// Random numbers.
    Random,
    /// Parameters of the unit that comes with the program, which has learned how other garments
    /// follow human motion. Random for a skeleton that is not recognised as a human's, in another
    /// layout than `heading`, and for other sizes than 128 oscillators and a width of 256. The last
    /// map is the garment's own: random, or a regression with less than a minute of motion.
    Pretrained,
}

impl RecurrenceStart {
    /// The value of settings without the key.
    fn random() -> Self {
        Self::Random
    }
}

impl RecurrenceSettings {
    /// Steps for so many frames of motion, mirrored ones included.
    pub(crate) fn steps_for(&self, frames: usize) -> u64 {
        let most = self
            .epochs
            .saturating_mul(frames as u64)
            .div_ceil((self.windows * self.frames).max(1) as u64);
        self.steps.min(most).max(1)
    }

    pub(crate) fn optimiser(&self, steps: u64) -> OptimiserConfig {
        OptimiserConfig {
            steps,
            epochs: None,
            learning_rate: self.learning_rate,
            final_learning_rate: 0.0,
            half_periods: 1.0,
            warmup: 1.0 / 6.0,
            // Values from 0.1 to 1 do slightly better than 0.01 on every capture: small weights
            // extrapolate better to unseen motion.
            weight_decay: 0.3,
            clip_norm: 1.0,
            products: Products::F32,
        }
    }
}

/// AdamW (Loshchilov & Hutter 2019) with a cosine schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimiserConfig {
    /// Optimiser steps of the whole run; computed from `epochs` where there are some.
    pub steps: u64,
    /// Passes over all pairs of consecutive frames of the training clips, each pair with a random
    /// subset of its vertices; absent: the number of steps is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epochs: Option<u64>,
    /// Learning rate at the start.
    pub learning_rate: f64,
    /// Learning rate at the minima of the cosine.
    pub final_learning_rate: f64,
    /// Half periods of the cosine in a run: 1 falls once; 3 falls, rises and falls, as the paper's
    /// 300 epochs with a half period of 100 do.
    pub half_periods: f64,
    /// Share of the steps, at least 0 and below 1, over which the learning rate rises from zero.
    pub warmup: f64,
    /// Decoupled weight decay.
    pub weight_decay: f32,
    /// Largest global norm of the gradient; 0 leaves gradients as they are.
    pub clip_norm: f64,
    /// Number format of the field's matrix products, forward and backward.
    #[serde(default)]
    pub products: Products,
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

/// Regularisation against overfitting and drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegularisationConfig {
    /// Probability by which inputs of the encoder's linear maps are dropped.
    pub dropout: f32,
    /// Probability for the motion vector itself, the input of the first map.
    pub input_dropout: f32,
    /// One dropout mask for all frames of a window, so that a rollout sees one thinned network.
    pub dropout_by_window: bool,
    /// Standard deviation of the noise on the state that a window starts from, metres; smooth over
    /// the garment.
    pub state_noise_m: f32,
    /// Mirroring of half of the windows left to right. Where the garment is symmetric the prior is
    /// fitted to all mirrored motion too.
    pub mirror: bool,
    /// Decay of the running mean of the parameters that the finished model takes; 0 takes the last
    /// ones.
    pub average: f64,
}

/// Weights of the loss terms, which are mean squares in m².
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LossConfig {
    /// λ of the paper, on positions.
    pub position: f32,
}

/// Intersection handling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntersectionConfig {
    /// Rule that moves vertices out of the body. The default is the paper's.
    #[serde(default)]
    pub rule: IntersectionRule,
    /// r of the paper's rule, metres.
    pub relaxation_m: f32,
    /// Height over the skin that the robust rule keeps, metres.
    #[serde(default = "default_margin")]
    pub margin_m: f32,
    /// Intersection handling of the finished model: on or off by default.
    pub at_inference: bool,
}

/// Rule that moves vertices out of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IntersectionRule {
    /// The paper's rule: to the nearest body vertex, and r along its normal.
    #[default]
    Paper,
    /// The shortest way out of the parts that carry them, see `unic_core::intersection`.
    Robust,
}

fn default_margin() -> f32 {
    IntersectionMode::MARGIN_M
}

impl IntersectionConfig {
    /// Intersection handling that the finished model has by default.
    pub fn of_model(&self) -> IntersectionMode {
        if !self.at_inference {
            return IntersectionMode::Off;
        }
        let (relaxation_m, margin_m) = (self.relaxation_m, self.margin_m);
        match self.rule {
            IntersectionRule::Paper => IntersectionMode::Paper { relaxation_m },
            IntersectionRule::Robust => IntersectionMode::Robust {
                margin_m,
                corrects: Corrects::Display,
            },
        }
    }
}

/// Choice of the field's size, steps and share by motion left out, see [`crate::SizingTrainer`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SizingSettings {
    /// Width and number of hidden layers of each field that is tried, from small to large. With
    /// none, the field has the size of `model.field` and trains for `optimiser.steps`, else for as
    /// many at most.
    pub sizes: Vec<[usize; 2]>,
}

/// Free-running error on clips that are held out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValidationConfig {
    /// Steps from one validation to the next.
    pub every: u64,
    /// Second fit after the one whose error was measured on held-out clips.
    pub refit: Refit,
}

/// Choice of a second fit with nothing held out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refit {
    /// The model is the one that was validated.
    Never,
    /// A training clip that the seed drew for validation goes back: the model is a second fit from
    /// scratch, on all training clips and for as many steps. Clips that the capture names for
    /// validation stay out, and there is no second fit.
    AllClips,
    /// Nothing is held out, and so no error on unseen motion is known: one fit, on all training
    /// clips. For captures whose test clips measure the model afterwards.
    Only,
}

impl TrainConfig {
    /// Frames that windows are rolled out over at a step.
    pub fn unroll(&self, step: u64) -> usize {
        let b = &self.batch;
        // At least one step: a share of 0 would divide zero by zero at step 0.
        let grown = (self.optimiser.steps as f64 * b.unroll_grown).max(1.0);
        let share = (step as f64 / grown).min(1.0);
        let length = b.unroll_first as f64 + (b.unroll_last as f64 - b.unroll_first as f64) * share;
        (length.round() as usize).max(1)
    }

    /// Learning rate of a step.
    pub fn learning_rate(&self, step: u64) -> f64 {
        self.optimiser.learning_rate(step)
    }

    /// Returns whether the model has a prior, so that the field only adds a correction.
    pub fn has_prior(&self) -> bool {
        matches!(
            self.model.state,
            StateSettings::Displacement {
                prior_shapes: 1..,
                ..
            }
        )
    }
}

impl OptimiserConfig {
    /// Learning rate of a step: warm-up, then cosine between the two rates.
    pub fn learning_rate(&self, step: u64) -> f64 {
        let phase = std::f64::consts::PI * self.half_periods * step as f64 / self.steps as f64;
        let rate = self.final_learning_rate
            + (self.learning_rate - self.final_learning_rate) * (1.0 + phase.cos()) / 2.0;
        // Whole steps, so that the rate reaches its value within the warm-up of any run.
        let warmup_steps = (self.steps as f64 * self.warmup).floor().max(1.0);
        rate * ((step as f64 + 1.0) / warmup_steps).min(1.0)
    }
}
