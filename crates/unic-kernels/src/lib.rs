//! CPU kernels of training: the garment field's fused forward and backward pass, and AdamW.
//!
//! The field (arXiv 2603.25580) is a multilayer perceptron. It is applied to each point of a
//! garment separately, with one latent vector per frame as further input. Most of the training time
//! is spent in it.
//!
//! [`Field`] takes a tile of points through all layers while their activations stay in cache. The
//! latent's contribution is the same for all points of a frame: it is folded into one bias per
//! frame, so that the cost of a point does not depend on the latent's length. No machine-learning
//! framework is involved. All data are slices of f32, which a framework can wrap as one
//! differentiable operation.
//!
//! ```
//! use unic_kernels::*;
//!
//! let shape = FieldShape {
//!     point_inputs: 3,
//!     latent: 4,
//!     hidden: 32,
//!     hidden_layers: 2,
//!     skip: Some(1),
//!     outputs: 3,
//! };
//! let mut parameters = vec![0.01; shape.parameter_count()];
//! let mut field = Field::new(shape)?;
//! field.load(&parameters)?;
//!
//! // Two frames of 50 points.
//! let batch = Batch { points: &[0.5; 2 * 50 * 3], latents: &[1.0; 2 * 4], points_per_group: 50 };
//! let mut outputs = vec![0.0; 2 * 50 * 3];
//! let mut saved = SavedActivations::default();
//! field.forward(&batch, &mut outputs, &mut saved)?;
//!
//! // The loss is half the sum of squares, so its gradient is the output.
//! let (mut points, mut latents) = (vec![0.0; 300], vec![0.0; 8]);
//! let mut gradient = vec![0.0; parameters.len()];
//! let gradients = Gradients {
//!     points: &mut points,
//!     latents: &mut latents,
//!     parameters: &mut gradient,
//! };
//! field.backward(&batch, &saved, &outputs, gradients, &mut BackwardScratch::default())?;
//!
//! let (mut m, mut v) = (vec![0.0; parameters.len()], vec![0.0; parameters.len()]);
//! let scale = (1.0 / global_norm(&[&gradient])).min(1.0) as f32;
//! adamw_step(&mut parameters, &gradient, &mut m, &mut v, &AdamW::default(), 1, scale)?;
//! # Ok::<(), KernelError>(())
//! ```
//!
//! **Objects.** [`Field`] is an asset: parameters packed for the processor. [`SavedActivations`]
//! are the state that a forward pass keeps for its backward pass. [`BackwardScratch`] can be
//! discarded at any time.
//!
//! **Determinism.** Results have the same bytes for any number of threads and for every
//! [`InstructionSet`] except [`InstructionSet::Amx`]. That set rounds factors to bf16 and is used
//! on request only. Work runs on the current rayon pool.
//!
//! **Throughput.** `cargo run --release -p unic-kernels --example field_rate` prints the throughput
//! and compares it with [`fma_peak`].

mod adamw;
#[cfg(target_arch = "x86_64")]
mod amx;
mod backward;
mod batch;
mod buffer;
mod error;
mod field;
mod layer;
mod microkernels;
mod panels;
mod peak;
mod product;
mod reduce;
mod saved;
mod shape;
mod simd;

pub use adamw::{AdamW, adamw_step, global_norm};
pub use backward::{BackwardScratch, Gradients};
pub use batch::Batch;
pub use error::KernelError;
pub use field::Field;
pub use peak::fma_peak;
pub use saved::{Retention, SavedActivations};
pub use shape::{FieldShape, LinearMap};
pub use simd::InstructionSet;
