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
    /// Channels D_h: numbers in the latent vector.
    pub channels: usize,
    /// Categories D_w that one number of each channel is picked from.
    pub categories: usize,
}

impl EncoderConfig {
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
    /// The paper's: the position in the frame of the motion vector; v_t = v_{t−1} + field(v_{t−1}, z).
    Position,
    /// A displacement carried by the skeleton; see [`DisplacementConfig`].
    Displacement(DisplacementConfig),
}

/// Displacement from where the garment usually hangs, in the rotated frame of each vertex:
/// x_i = LBS_i(rest) + R_i (p_i + d_i) and d_t = γ d_{t−1} + s · field(...), γ = exp(−dt / memory).
///
/// p is the model's [`crate::prior::LinearPrior`]. The field's output is bounded in length by
/// `output_limit`, so |d| ≤ s · output_limit / (1 − γ) for ever.
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
            Self::Position => 3,
            Self::Displacement(d) => 3 * d.inputs.len(),
        }
    }

    /// How many of them depend on the state: the leading ones.
    pub fn state_input_len(&self) -> usize {
        match self {
            Self::Position => 3,
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

impl ModelConfig {
    /// # Errors
    /// Names the value, what it must be and what it is.
    pub fn check(&self, joints: usize) -> Result<(), ConfigError> {
        let positive = |what, value: f32| check(what, "above 0", value, value > 0.0 && value.is_finite());
        positive("fps", self.fps)?;
        let widths = self.encoder.hidden.iter();
        for &width in widths.chain([&self.encoder.channels, &self.encoder.categories, &self.field.width]) {
            check("a layer's width", "1 to 65536", width, (1..=LARGEST_WIDTH).contains(&width))?;
        }
        let layers = self.field.hidden_layers;
        check("field.hidden_layers", "1 to 64", layers, (1..=64).contains(&layers))?;
        if let Some(skip) = self.field.skip {
            check("field.skip", "from 1 to the last hidden layer", skip, (1..layers).contains(&skip))?;
        }
        for joint in self.motion.contact_joints {
            check("motion.contact_joints", "joints of the skeleton", joint, joint < joints)?;
        }
        if let StateConfig::Displacement(d) = &self.state {
            positive("state.scale_m", d.scale_m)?;
            positive("state.output_limit", d.output_limit)?;
            check("state.memory_s", "0 or more", d.memory_s, d.memory_s >= 0.0 && d.memory_s.is_finite())?;
            check_inputs(&d.inputs)?;
        }
        Ok(())
    }
}

fn check_inputs(inputs: &[PointInput]) -> Result<(), ConfigError> {
    let sorted = inputs.is_sorted_by_key(|input| !input.is_state());
    let expected = "without repetition and with displacement and velocity first";
    let distinct = (1..inputs.len()).all(|i| !inputs[..i].contains(&inputs[i]));
    check("state.inputs", expected, format_args!("{inputs:?}"), sorted && distinct)?;
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
