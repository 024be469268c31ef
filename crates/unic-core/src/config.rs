//! What a model is: the values that its variants differ in.
//!
//! A configuration travels inside the model file, so that the runtime needs nothing else. Training
//! settings (learning rate, noise, unrolling) are not part of it.

use crate::motion::MotionSpec;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Everything that defines the shape and the meaning of a model's numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Frames per second that the garment ticks at: the training rate.
    pub fps: f32,
    /// Which motion vector the encoder reads.
    pub motion: MotionSpec,
    /// Motion encoder.
    pub encoder: EncoderConfig,
    /// Deformation field.
    pub field: FieldConfig,
    /// What the field reads of a vertex and what it changes.
    pub state: StateConfig,
    /// What happens to vertices inside the body, in the loop.
    pub intersection: IntersectionMode,
}

/// Categorical motion encoder: linear maps with ELU between them, then one code a channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderConfig {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Channels D_h, each of which picks one category.
    pub channels: usize,
    /// Categories D_w that one number of each channel is picked from.
    pub categories: usize,
    /// Form in which the field reads the picked categories.
    #[serde(default)]
    pub code: LatentCode,
}

/// Form in which the field reads the category that a channel picks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LatentCode {
    /// The picked logit, one number a channel, as in the authors' release.
    #[default]
    PickedLogit,
    /// One at the picked category and zero at the others, `categories` numbers a channel: Gumbel-Softmax
    /// with straight-through gradients (Jang et al. 2017).
    OneHot,
}

impl EncoderConfig {
    /// Numbers in the latent vector, which the field reads.
    pub fn latent_len(&self) -> usize {
        match self.code {
            LatentCode::PickedLogit => self.channels,
            LatentCode::OneHot => self.channels * self.categories,
        }
    }

    /// Widths from input to output: `inputs`, the hidden ones, channels × categories.
    pub fn widths(&self, inputs: usize) -> Vec<usize> {
        let ends = (inputs, self.channels * self.categories);
        let hidden = self.hidden.iter().copied();
        std::iter::once(ends.0).chain(hidden).chain([ends.1]).collect()
    }
}

/// Pointwise deformation field: a ReLU network with a linear head.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldConfig {
    /// Width of the hidden layers.
    pub width: usize,
    /// Number of hidden layers.
    pub hidden_layers: usize,
    /// Hidden layer (from 0) before which the input is concatenated again.
    pub skip: Option<usize>,
}

/// The state of one vertex, and how the field moves it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum StateConfig {
    /// The paper's: the position relative to the root joint of the same frame, turned as the motion vector is;
    /// v_t = v_{t−1} + field(v_{t−1}, z). See [`MotionState::world_from_state`](crate::motion::MotionState::world_from_state).
    RootRelative,
    /// A displacement carried by the skeleton; see [`DisplacementConfig`].
    Displacement(DisplacementConfig),
}

/// Displacement from where the garment usually hangs, in the rotated frame of each vertex:
/// x_i = LBS_i(rest) + R_i (p_i + d_i) and d_t = γ d_{t−1} + s · field(...), γ = exp(−dt / memory).
///
/// p is the model's [`crate::prior::Prior`], which may remember the motion. The field's output is bounded in length by
/// `output_limit`, so |d_t| ≤ γ^t |d_0| + s · output_limit / (1 − γ) for ever.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisplacementConfig {
    /// Time constant in seconds by which a displacement is forgotten; 0 makes the field pose-only.
    pub memory_s: f32,
    /// s, metres: what one unit of the field's output and of its displacement inputs means.
    pub scale_m: f32,
    /// Largest length of the field's output, in units of `scale_m`.
    pub output_limit: f32,
    /// Inputs of the field beside the latent vector, in this order.
    pub inputs: Vec<PointInput>,
}

/// One input of the field, all in the vertex's own rotated frame, each three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointInput {
    /// d_{t−1} / s.
    Displacement,
    /// (d_{t−1} − d_{t−2}) / (s · 3 frames): the second order of the state, without which a garment cannot ring.
    Velocity,
    /// Position in the rest shape, scaled to its bounding box: tells layers that touch apart.
    Rest,
    /// World up, Rᵀ·(0, 1, 0): gravity.
    Up,
    /// Rᵀ times the velocity of the skinned point, in units of 2 m/s.
    SkinVelocity,
    /// Rᵀ times the acceleration of the skinned point, in units of 20 m/s².
    SkinAcceleration,
}

impl PointInput {
    /// Does it change with the state, so that gradients flow through it?
    pub fn is_state(self) -> bool {
        matches!(self, Self::Displacement | Self::Velocity)
    }
}

impl DisplacementConfig {
    /// γ for a tick of `dt` seconds.
    pub fn decay(&self, dt: f32) -> f32 {
        if self.memory_s > 0.0 {
            (-dt / self.memory_s).exp()
        } else {
            0.0
        }
    }
}

impl StateConfig {
    /// Numbers that the field reads of one vertex.
    pub fn input_len(&self) -> usize {
        match self {
            Self::RootRelative => 3,
            Self::Displacement(d) => 3 * d.inputs.len(),
        }
    }

    /// How many of them depend on the state: the leading ones.
    pub fn state_input_len(&self) -> usize {
        match self {
            Self::RootRelative => 3,
            Self::Displacement(d) => 3 * d.inputs.iter().filter(|i| i.is_state()).count(),
        }
    }
}

/// What happens to garment vertices inside the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum IntersectionMode {
    /// Nothing.
    Off,
    /// The paper's: nearest body vertex, its tangent plane, dragged to b + relaxation · n.
    Paper {
        /// r, metres; the paper's is 0.005.
        relaxation_m: f32,
    },
    /// Ours: closest triangle of the parts of the body that may push the vertex, out to a height
    /// along the shortest way; faces that the body pokes through are lifted, and corrections spread.
    Robust {
        /// Height over the skin that vertices are kept at, metres.
        margin_m: f32,
        /// What is corrected.
        #[serde(default)]
        corrects: Corrects,
    },
}

/// What a correction changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Corrects {
    /// What is shown. The state goes on as if there were no body, so that a push leaves with what
    /// pushed.
    #[default]
    Display,
    /// The state, vertex by vertex, and then what is shown. For models that are trained with corrections.
    State,
}

/// A configuration that no network can be built from.
#[derive(Debug, Error, PartialEq)]
#[error("model configuration: {what} must be {expected}, found {found}")]
pub struct ConfigError {
    /// Which value.
    pub what: &'static str,
    /// What it must be.
    pub expected: String,
    /// What it is.
    pub found: String,
}

/// Widths beyond this are refused: a damaged file must not ask for terabytes.
const LARGEST_WIDTH: usize = 1 << 16;
/// Ticks so short that accelerations, differences over dt², lose their meaning in f32.
const FASTEST_FPS: f32 = 10_000.0;

impl ModelConfig {
    /// # Errors
    /// Names the value, what it must be and what it is.
    pub fn check(&self, joints: usize) -> Result<(), ConfigError> {
        let positive = |what, value: f32| check(what, "above 0", value, value > 0.0 && value.is_finite());
        check(
            "fps",
            "1 to 10000",
            self.fps,
            (1.0..=FASTEST_FPS).contains(&self.fps),
        )?;
        let EncoderConfig {
            hidden,
            channels,
            categories,
            code: _,
        } = &self.encoder;
        for &width in hidden.iter().chain([channels, categories, &self.field.width]) {
            check(
                "a layer's width",
                "1 to 65536",
                width,
                (1..=LARGEST_WIDTH).contains(&width),
            )?;
        }
        let logits = channels.saturating_mul(*categories);
        check(
            "channels x categories",
            "at most 65536",
            logits,
            logits <= LARGEST_WIDTH,
        )?;
        let layers = self.field.hidden_layers;
        check(
            "field.hidden_layers",
            "1 to 64",
            layers,
            (1..=64).contains(&layers),
        )?;
        if let Some(skip) = self.field.skip {
            check(
                "field.skip",
                "from 1 to the last hidden layer",
                skip,
                (1..layers).contains(&skip),
            )?;
        }
        for joint in self.motion.contact_joints {
            check(
                "motion.contact_joints",
                "joints of the skeleton",
                joint,
                joint < joints,
            )?;
        }
        if let StateConfig::Displacement(d) = &self.state {
            positive("state.scale_m", d.scale_m)?;
            positive("state.output_limit", d.output_limit)?;
            // In f32 a very long memory is an integrator, whose errors grow without bound.
            let forgets = d.memory_s >= 0.0 && d.decay(1.0 / self.fps) < 1.0;
            check(
                "state.memory_s",
                "0 or more, and short enough to forget",
                d.memory_s,
                forgets,
            )?;
            check_inputs(&d.inputs)?;
        }
        self.intersection.check()
    }
}

impl IntersectionMode {
    /// r of the paper (section 3.3), metres.
    pub const RELAXATION_M: f32 = 0.005;
    /// What simulated cloth keeps from the skin, metres.
    pub const MARGIN_M: f32 = 0.003;

    /// # Errors
    /// A relaxation or a margin that is negative or not finite.
    pub fn check(self) -> Result<(), ConfigError> {
        let (what, metres) = match self {
            Self::Off => return Ok(()),
            Self::Paper { relaxation_m } => ("intersection.relaxation_m", relaxation_m),
            Self::Robust { margin_m, .. } => ("intersection.margin_m", margin_m),
        };
        let holds = metres >= 0.0 && metres.is_finite();
        check(what, "0 or more", metres, holds)
    }
}

fn check_inputs(inputs: &[PointInput]) -> Result<(), ConfigError> {
    let sorted = inputs.is_sorted_by_key(|input| !input.is_state());
    let expected = "without repetition and with displacement and velocity first";
    let distinct = (1..inputs.len()).all(|i| !inputs[..i].contains(&inputs[i]));
    check(
        "state.inputs",
        expected,
        format_args!("{inputs:?}"),
        sorted && distinct,
    )?;
    check("state.inputs", "at least one", inputs.len(), !inputs.is_empty())
}

fn check(
    what: &'static str,
    expected: &str,
    found: impl std::fmt::Debug,
    holds: bool,
) -> Result<(), ConfigError> {
    if holds {
        return Ok(());
    }
    Err(ConfigError {
        what,
        expected: expected.to_owned(),
        found: format!("{found:?}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{MotionLayout, VelocityScheme};

    fn config() -> ModelConfig {
        ModelConfig {
            fps: 30.0,
            motion: MotionSpec {
                layout: MotionLayout::Heading,
                velocity: VelocityScheme::Backward,
                contact_joints: [0, 1, 2, 3],
                contact_rest_heights_m: [0.1; 4],
            },
            encoder: EncoderConfig {
                hidden: vec![8],
                channels: 4,
                categories: 3,
                code: LatentCode::default(),
            },
            field: FieldConfig {
                width: 8,
                hidden_layers: 3,
                skip: Some(2),
            },
            state: StateConfig::Displacement(DisplacementConfig {
                memory_s: 0.1,
                scale_m: 0.05,
                output_limit: 3.0,
                inputs: vec![PointInput::Velocity, PointInput::Displacement, PointInput::Rest],
            }),
            intersection: IntersectionMode::Paper { relaxation_m: 0.005 },
        }
    }

    fn refused(change: impl FnOnce(&mut ModelConfig, &mut DisplacementConfig)) -> &'static str {
        let mut config = config();
        let StateConfig::Displacement(mut state) = config.state.clone() else {
            unreachable!("the configuration above");
        };
        change(&mut config, &mut state);
        config.state = StateConfig::Displacement(state);
        config.check(5).unwrap_err().what
    }

    #[test]
    fn every_value_that_means_nothing_is_named() {
        assert_eq!(config().check(5), Ok(()));
        assert_eq!(refused(|c, _| c.fps = f32::NAN), "fps");
        assert_eq!(refused(|c, _| c.fps = 0.0), "fps");
        assert_eq!(refused(|c, _| c.encoder.hidden = vec![0]), "a layer's width");
        assert_eq!(refused(|c, _| c.field.width = usize::MAX), "a layer's width");
        assert_eq!(
            refused(|c, _| (c.encoder.channels, c.encoder.categories) = (1 << 16, 2)),
            "channels x categories"
        );
        assert_eq!(
            refused(|c, _| c.field.hidden_layers = usize::MAX),
            "field.hidden_layers"
        );
        assert_eq!(refused(|c, _| c.field.skip = Some(3)), "field.skip");
        assert_eq!(
            refused(|c, _| c.motion.contact_joints[2] = 5),
            "motion.contact_joints"
        );
        assert_eq!(refused(|_, s| s.scale_m = -0.1), "state.scale_m");
        assert_eq!(
            refused(|_, s| s.output_limit = f32::INFINITY),
            "state.output_limit"
        );
        assert_eq!(refused(|_, s| s.memory_s = 1e9), "state.memory_s");
        assert_eq!(refused(|_, s| s.memory_s = f32::NAN), "state.memory_s");
        assert_eq!(refused(|_, s| s.inputs.clear()), "state.inputs");
        assert_eq!(refused(|_, s| s.inputs.push(PointInput::Rest)), "state.inputs");
        assert_eq!(refused(|_, s| s.inputs.reverse()), "state.inputs");
        let relaxation_m = f32::NAN;
        let named = refused(|c, _| c.intersection = IntersectionMode::Paper { relaxation_m });
        assert_eq!(named, "intersection.relaxation_m");
        let robust = IntersectionMode::Robust {
            margin_m: -0.001,
            corrects: Corrects::Display,
        };
        let named = refused(|c, _| c.intersection = robust);
        assert_eq!(named, "intersection.margin_m");
    }

    #[test]
    fn state_inputs_are_the_leading_ones() {
        assert_eq!(
            (config().state.input_len(), config().state.state_input_len()),
            (9, 6)
        );
        assert_eq!(
            (
                StateConfig::RootRelative.input_len(),
                StateConfig::RootRelative.state_input_len()
            ),
            (3, 3)
        );
    }

    #[test]
    fn a_memory_of_one_tick_decays_by_e() {
        let StateConfig::Displacement(mut state) = config().state else {
            unreachable!("the configuration above");
        };
        assert!((state.decay(0.1) - (-1f32).exp()).abs() < 1e-6);
        state.memory_s = 0.0;
        assert_eq!(state.decay(0.1), 0.0);
    }
}
