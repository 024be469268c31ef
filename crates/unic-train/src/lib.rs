//! Training of neural garments.

mod batch;
mod checkpoint;
mod config;
mod correction;
mod dataset;
mod error;
mod field_op;
mod mirror;
mod network;
mod noise;
mod optimiser;
mod rollout;
mod stream;
mod trainer;
mod validation;

pub use batch::{Batch, Window};
pub use checkpoint::{Checkpoint, Progress};
pub use config::{
    BatchConfig, IntersectionConfig, Keep, LossConfig, ModelSettings, OptimiserConfig, Preset,
    RegularisationConfig, SettingsError, StateSettings, TrainConfig,
};
pub use correction::{Bodies, Correction};
pub use dataset::{Dataset, MotionVectors};
pub use error::TrainError;
pub use field_op::{composed, fused};
pub use mirror::{MirrorMap, mirrored};
pub use network::{Network, NetworkShape, Parameter, StepNoise};
pub use noise::SmoothNoise;
pub use optimiser::{Moments, update};
pub use rollout::Rollout;
pub use stream::{Stream, generator};
pub use trainer::{Control, Event, Outcome, Trainer};
pub use validation::free_running_rmse;
