//! Configuration of a model: sizes, and the meaning of its numbers.
//!
//! For training, which writes it into the model file, and for engines, which read the frame rate
//! and choose the intersection handling. Settings of training (learning rate, noise, unrolling) are
//! not part of it.

#[cfg(test)]
mod tests;

use crate::motion::MotionSpec;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Configuration of a model, stored in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelConfig {
    /// Ticks of the garment per second; the frame rate of training.
    pub fps: f32,
    /// Motion vector that the networks read.
    pub motion: MotionSpec,
    /// Sizes of the motion encoder.
    pub encoder: EncoderConfig,
    /// Sizes of the deformation field.
    pub field: FieldConfig,
    /// State of a vertex: the field's inputs, and what its output changes.
    pub state: StateConfig,
    /// Handling of vertices inside the body; an animator can replace it.
    pub intersection: IntersectionMode,
    /// Strain projection of the shown garment, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub projection: Option<ProjectionConfig>,
}

/// Settings of the [strain projection](crate::projection).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectionConfig {
    /// Gauss-Seidel sweeps over the chords of each coarse level in a tick, before the edges. There
    /// are no levels where it is 0, as in files that were written before there were any.
    #[serde(default)]
    pub coarse_sweeps: usize,
    /// Gauss-Seidel sweeps over all edges in a tick.
    pub sweeps: usize,
    /// Number of these sweeps that are followed by one over all hinges and free edges. Unless it is 0,
    /// the moves of coarse levels and of intersection handling are smoothed, too.
    pub bending_sweeps: usize,
    /// Share of the bending of an offset, or of a move by intersection handling, that a sweep over the
    /// hinges removes, 0 to 1. Free edges and coarse levels lose half of theirs whatever it is.
    pub bending: f32,
    /// Least distance of vertices along the smoothed cloth, in mean edge lengths at rest, that pushes
    /// restore, see [`projection::order`](crate::projection::order). No pushes where it is 0, as in
    /// files that were written before there were any.
    #[serde(default)]
    pub order: f32,
    /// Least distance between layers of cloth that lie on each other at rest, in mean edge lengths at
    /// rest, that pushes restore, see [`projection::order`](crate::projection::order). Layers that are
    /// closer at rest are not pushed. No pushes where it is 0, as in files that were written before there
    /// were any.
    #[serde(default)]
    pub layers: f32,
    /// Time constant of an offset's return to the prediction, seconds.
    pub pull_s: f32,
    /// Time constant of an offset's velocity, seconds.
    pub carry_s: f32,
    /// Largest offset, metres.
    pub radius_m: f32,
}

impl Default for ProjectionConfig {
    /// Settings that were chosen on motions left out of training (docs/lab/projection.md).
    fn default() -> Self {
        Self {
            coarse_sweeps: 4,
            sweeps: 12,
            bending_sweeps: 6,
            bending: 0.6,
            order: 0.0,
            layers: 0.15,
            pull_s: 0.2,
            carry_s: 0.3,
            radius_m: 0.08,
        }
    }
}

impl ProjectionConfig {
    /// Largest number of sweeps. Without a limit a damaged file could stop an animator.
    pub const MOST_SWEEPS: usize = 1000;

    /// Smallest order above 0. Cells of a search for closer vertices would be too small.
    pub const LEAST_ORDER: f32 = 0.05;

    /// Largest distance between layers: others are not near each other.
    pub const MOST_LAYERS: f32 = 0.5;

    /// Number of sweeps over all hinges and free edges in a tick.
    pub fn hinge_sweeps(&self) -> usize {
        self.bending_sweeps.min(self.sweeps)
    }

    /// Returns whether a value of [`ProjectionConfig::order`] is accepted.
    pub fn is_order(order: f32) -> bool {
        order == 0.0 || (Self::LEAST_ORDER..=1.0).contains(&order)
    }

    /// Returns whether a value of [`ProjectionConfig::layers`] is accepted.
    pub fn is_layers(layers: f32) -> bool {
        (0.0..=Self::MOST_LAYERS).contains(&layers)
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first value that is not accepted.
    pub fn check(&self) -> Result<(), ConfigError> {
        let sweeps = |what, found: usize| check(what, "up to 1000", found, found <= Self::MOST_SWEEPS);
        sweeps("projection.coarse_sweeps", self.coarse_sweeps)?;
        sweeps("projection.sweeps", self.sweeps)?;
        sweeps("projection.bending_sweeps", self.bending_sweeps)?;
        let (what, share) = ("projection.bending", self.bending);
        check(what, "0 to 1", share, (0.0..=1.0).contains(&share))?;
        let (what, order) = ("projection.order", self.order);
        check(what, "0, or 0.05 to 1", order, Self::is_order(order))?;
        let (what, layers) = ("projection.layers", self.layers);
        check(what, "0 to 0.5", layers, Self::is_layers(layers))?;
        let positive = |what, value: f32| check(what, "above 0", value, value > 0.0 && value.is_finite());
        positive("projection.pull_s", self.pull_s)?;
        positive("projection.carry_s", self.carry_s)?;
        positive("projection.radius_m", self.radius_m)
    }
}

/// Sizes of the categorical motion encoder: linear maps with ELU between them, then one category a
/// channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderConfig {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Number of channels D_h, each of which picks one category.
    pub channels: usize,
    /// Number of categories D_w of each channel.
    pub categories: usize,
    /// Encoding of the picked categories in the latent vector.
    #[serde(default)]
    pub code: LatentCode,
}

/// Encoding of the picked categories in the latent vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LatentCode {
    /// The picked logit, one number a channel, as in the authors' release.
    #[default]
    PickedLogit,
    /// A one-hot vector of `categories` numbers a channel, trained by Gumbel-Softmax with
    /// straight-through gradients (Jang et al. 2017).
    OneHot,
}

impl EncoderConfig {
    /// Length of the latent vector, which the field reads.
    pub fn latent_len(&self) -> usize {
        match self.code {
            LatentCode::PickedLogit => self.channels,
            LatentCode::OneHot => self.channels * self.categories,
        }
    }

    /// Lists the widths from input to output: `inputs`, the hidden layers, channels × categories.
    pub fn widths(&self, inputs: usize) -> Vec<usize> {
        let logits = self.channels * self.categories;
        let hidden = self.hidden.iter().copied();
        std::iter::once(inputs).chain(hidden).chain([logits]).collect()
    }
}

/// Sizes of the deformation field, a ReLU network with a linear last layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldConfig {
    /// Width of the hidden layers.
    pub width: usize,
    /// Number of hidden layers.
    pub hidden_layers: usize,
    /// Hidden layer, counted from 0, that reads the input again beside the previous layer's output.
    pub skip: Option<usize>,
}

/// State of one vertex, and the effect of the field's output on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum StateConfig {
    /// Position v relative to the root joint, as in the paper: v_t = v_{t−1} + field(v_{t−1}, z).
    ///
    /// [`MotionState::world_from_state`](crate::motion::MotionState::world_from_state) is its
    /// coordinate frame.
    RootRelative,
    /// Displacement from the skinned prior.
    Displacement(DisplacementConfig),
}

/// Configuration of a state that is a displacement d from the prior, in the rotated frame of each
/// vertex.
///
/// Positions are x_i = LBS_i(rest) + R_i (p_i + d_i), with the model's
/// [`Prior`](crate::prior::Prior) p. A tick is d_t = γ d_{t−1} + s · field(...) with the decay
/// γ = exp(−dt / memory).
///
/// The field's output is bounded in length by `output_limit`, so that
/// |d_t| ≤ γ^t |d_0| + s · output_limit / (1 − γ) for ever. With an `excursion_m` the field is zero,
/// and |d_t| ≤ |d_0|.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisplacementConfig {
    /// Time constant of the decay, seconds; 0 makes the displacement a function of the motion
    /// alone.
    pub memory_s: f32,
    /// Excursion of the predicted garment within which a given garment stays as it lies, metres; see
    /// [`StartMemory`](crate::animator::StartMemory). Without one, given displacements fade with
    /// `memory_s` alone. Only models whose field is zero have one: what a field adds has to decay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub excursion_m: Option<f32>,
    /// Unit s of the field's output and of its displacement inputs, metres.
    pub scale_m: f32,
    /// Largest length of the field's output, in units of `scale_m`.
    pub output_limit: f32,
    /// Inputs of the field beside the latent vector, in this order.
    pub inputs: Vec<PointInput>,
}

/// Input of the field at a vertex: three numbers in the vertex's own rotated frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointInput {
    /// Displacement d_{t−1} / s.
    Displacement,
    /// Velocity (d_{t−1} − d_{t−2}) / (s · 3 frames). It makes the state second-order, without
    /// which a garment cannot oscillate.
    Velocity,
    /// Rest position, scaled to the bounding box. It separates layers that touch.
    Rest,
    /// World up, Rᵀ·(0, 1, 0): the direction of gravity.
    Up,
    /// Velocity of the skinned point, in units of 2 m/s.
    SkinVelocity,
}

impl PointInput {
    /// Returns true for inputs that depend on the state, through which gradients flow.
    pub fn is_state(self) -> bool {
        matches!(self, Self::Displacement | Self::Velocity)
    }
}

impl DisplacementConfig {
    /// Returns the decay γ of a tick of `dt` seconds.
    pub fn decay(&self, dt: f32) -> f32 {
        if self.memory_s > 0.0 {
            (-dt / self.memory_s).exp()
        } else {
            0.0
        }
    }
}

impl StateConfig {
    /// Number of the field's inputs at a vertex.
    pub fn input_len(&self) -> usize {
        match self {
            Self::RootRelative => 3,
            Self::Displacement(d) => 3 * d.inputs.len(),
        }
    }

    /// Number of the leading inputs at a vertex, which depend on the state.
    pub fn state_input_len(&self) -> usize {
        match self {
            Self::RootRelative => 3,
            Self::Displacement(d) => 3 * d.inputs.iter().filter(|i| i.is_state()).count(),
        }
    }
}

/// Handling of garment vertices inside the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum IntersectionMode {
    /// Vertices inside the body stay there.
    Off,
    /// Published rule: a vertex below the tangent plane of its nearest body vertex b is moved to
    /// b + relaxation · n.
    Paper {
        /// Relaxation r, metres; 0.005 in the paper.
        relaxation_m: f32,
    },
    /// Rule of this project: a vertex is moved the shortest way to `margin_m` over the closest
    /// triangle, among the body parts that may push it. Deep inside the body a shown vertex first
    /// moves towards its skinned position. Layers of fine cloth keep their order. Faces that the body
    /// pokes through are lifted, and corrections spread to neighbours.
    Robust {
        /// Least height of vertices over the skin, metres. After the last sweeps of a strain projection
        /// vertices are pushed to [`LAST_MARGIN_SHARE`](crate::intersection::LAST_MARGIN_SHARE) of it.
        margin_m: f32,
        /// Positions that are corrected.
        #[serde(default)]
        corrects: Corrects,
    },
}

/// Positions that [`IntersectionMode::Robust`] corrects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Corrects {
    /// The shown positions alone. The state continues as if there were no body, so that a
    /// correction ends with the contact.
    #[default]
    Display,
    /// The state, vertex by vertex, and then the shown positions. For models that are trained with
    /// corrections.
    State,
}

/// Error: a configuration that no network can be built from.
#[derive(Debug, Error, PartialEq)]
#[error("model configuration: {what} must be {expected}, found {found}")]
pub struct ConfigError {
    /// Name of the value.
    pub what: &'static str,
    /// Values that are accepted.
    pub expected: String,
    /// Value that was found.
    pub found: String,
}

/// Largest width of a layer. Without a limit a damaged file could ask for terabytes.
const LARGEST_WIDTH: usize = 1 << 16;
/// Largest frame rate. Accelerations are differences over dt², which f32 cannot represent for
/// shorter ticks.
const FASTEST_FPS: f32 = 10_000.0;

impl ModelConfig {
    /// Checks all values, for a skeleton of `joints` joints.
    ///
    /// # Errors
    /// The first value that is not accepted.
    pub fn check(&self, joints: usize) -> Result<(), ConfigError> {
        // Every comparison below is false for NaN, which is therefore refused.
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
            // A very long memory rounds to a decay of 1: an integrator, whose errors grow without
            // bound.
            let decays = d.memory_s >= 0.0 && d.decay(1.0 / self.fps) < 1.0;
            check(
                "state.memory_s",
                "0 or more, and short enough to forget",
                d.memory_s,
                decays,
            )?;
            if let Some(within) = d.excursion_m {
                positive("state.excursion_m", within)?;
            }
            check_inputs(&d.inputs)?;
        }
        if let Some(projection) = &self.projection {
            projection.check()?;
        }
        self.intersection.check()
    }
}

impl IntersectionMode {
    /// Relaxation r of the paper (section 3.3), metres.
    pub const RELAXATION_M: f32 = 0.005;
    /// Distance of simulated cloth from the skin, metres.
    pub const MARGIN_M: f32 = 0.003;

    /// Returns whether the mode moves the vertices of a state, and not only those that are shown.
    pub fn corrects_state(self) -> bool {
        match self {
            Self::Off => false,
            Self::Paper { .. } => true,
            Self::Robust { corrects, .. } => corrects == Corrects::State,
        }
    }

    /// Checks the mode's lengths.
    ///
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

/// Checks that inputs which depend on the state come first, for gradients are taken of a prefix.
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
