//! Errors of a training run.

use crate::processor::Processor;
use std::{fmt, path::PathBuf};
use thiserror::Error;
use unic_core::printable::printable_excerpt;

/// Error of a training run, one sentence each.
#[derive(Debug, Error)]
pub enum TrainError {
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] unic_io::Error),
    /// A capture without training clips.
    #[error("{capture}: expected at least one clip in splits.train, found none")]
    NoClips {
        /// The capture's folder.
        capture: PathBuf,
    },
    /// Clips too short to train on.
    #[error("{capture}: expected training clips of at least 2 frames, found one of {frames}")]
    ShortClip {
        /// The capture's folder.
        capture: PathBuf,
        /// Frames of the shortest clip.
        frames: usize,
    },
    /// Captures or settings that no unit can be pretrained on.
    #[error("pretraining: expected garments that move in the same motion of one human, found {0}")]
    Pretraining(&'static str),
    /// Bytes that are no pretrained unit.
    #[error("expected the tensors of a pretrained unit, found {}", printable_excerpt(.0))]
    PretrainedUnit(String),
    /// Settings out of range or unreadable.
    #[error(transparent)]
    Settings(#[from] crate::config::SettingsError),
    /// Contradictory or out-of-range model configuration.
    #[error(transparent)]
    Config(#[from] unic_core::config::ConfigError),
    /// Motion vectors that cannot be made.
    #[error(transparent)]
    Motion(#[from] unic_core::motion::MotionError),
    /// Parts that do not fit together.
    #[error(transparent)]
    Model(#[from] unic_core::model::ModelError),
    /// Virtual bones without weights.
    #[error(transparent)]
    Weights(#[from] unic_core::skinning::WeightsError),
    /// A garment without a surface.
    #[error(transparent)]
    Surface(#[from] unic_core::surface_map::SurfaceMapError),
    /// Layers of other sizes than the network's.
    #[error(transparent)]
    Layer(#[from] unic_core::network::LayerError),
    /// A model that cannot be written.
    #[error(transparent)]
    ModelFile(#[from] unic_core::ModelFileError),
    /// A rollout that the animator refuses.
    #[error("validation: {0}")]
    Animator(#[from] unic_core::animator::AnimatorError),
    /// A garment whose wrinkles cannot be told from its shape.
    #[error("{0}; settings with replay.at_inference = false do without wrinkles")]
    Wrinkles(unic_eval::Error),
    /// Sizes that the field's kernels refuse.
    #[error(transparent)]
    Kernel(#[from] unic_kernels::KernelError),
    /// A loss or a gradient that is not finite.
    #[error(
        "the training of the {network} diverged: the {quantity} of step {step} is {value}; try a smaller \
         optimiser.learning_rate or an optimiser.clip_norm such as 1"
    )]
    Diverged {
        /// Name of the network.
        network: &'static str,
        /// The number that is not finite.
        quantity: Quantity,
        /// The step, counted from 0.
        step: u64,
        /// The number's value.
        value: f64,
    },
    /// A processor that the program was built without.
    #[error("expected a program built with the cargo feature `{processor}`, found one without")]
    NotBuilt {
        /// Requested processor.
        processor: Processor,
    },
    /// A processor that the machine does not have.
    #[error(
        "expected a device that computes with {processor}, found {}",
        printable_excerpt(found)
    )]
    Processor {
        /// Requested processor.
        processor: Processor,
        /// Message of the driver, or `none`.
        found: String,
    },
    /// Motion vectors of another layout or velocity than the settings have.
    #[error("expected motion vectors with {expected}, found {found}")]
    MotionSpec {
        /// Layout and velocity of the settings.
        expected: String,
        /// Layout and velocity of the motion vectors.
        found: String,
    },
    /// Products that a processor does not have.
    #[error(
        "expected a CPU with matrix units (Intel AMX) for optimiser.products = \"bf16\", found {processor} without; \
         take \"f32\""
    )]
    Products {
        /// Requested processor.
        processor: Processor,
    },
    /// A callback stopped the training before there was anything to save.
    #[error("stopped before there was anything to save")]
    Stopped,
    /// A checkpoint of another run, or damaged.
    #[error(
        "{path}: expected a checkpoint of this run, found {}",
        printable_excerpt(found)
    )]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// Description of the file's contents.
        found: String,
    },
}

/// A number of a training step that must be finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The loss.
    Loss,
    /// Global norm of the gradient, before clipping.
    GradientNorm,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Loss => "loss",
            Self::GradientNorm => "gradient's norm",
        })
    }
}
