//! A whole frame of a neural garment on any GPU.

mod animator;
mod body;
mod context;
mod dense;
mod error;
mod field;
mod garment;
mod kernel;
mod mesh;
mod model;
mod motion;
mod peak;
mod program;
mod tree;

pub use animator::{GarmentCopy, GpuAnimator};
pub use context::GpuContext;
pub use error::GpuError;
pub use model::{GpuModel, Precision};
pub use peak::multiply_add_peak;
pub use program::StageTime;
pub use wgpu;
