//! CPU kernels of training: the garment field's fused forward and backward, and AdamW.
//!
//! The field (arXiv 2603.25580) is a perceptron that is applied to every point of a garment alone and driven by one
//! latent per frame. Training spends its time there. [`Field`] takes a tile of points through all layers while their
//! activations stay in cache; the latent's share of the maps that take it is folded into one bias a frame, exactly, so
//! a point's cost does not depend on the latent's length. No machine-learning framework is involved: everything is
//! slices of f32, and whoever owns tensors wraps it as one differentiable operation.
//!
//! ```
//! use unic_kernels::*;
//!
//! let shape = FieldShape { point_inputs: 3, latent: 4, hidden: 32, hidden_layers: 2, skip: Some(1), outputs: 3 };
//! let mut parameters = vec![0.01; shape.parameter_count()];
//! let mut field = Field::new(shape)?;
//! field.load(&parameters)?;
//!
//! // Two frames of 50 points.
//! let batch = Batch { points: &[0.5; 2 * 50 * 3], latents: &[1.0; 2 * 4], points_per_group: 50 };
//! let mut outputs = vec![0.0; 2 * 50 * 3];
//! let mut saved = Saved::default();
//! field.forward(&batch, &mut outputs, &mut saved)?;
//!
//! // The loss is half the sum of squares, so its gradient is the output.
//! let (mut points, mut latents, mut gradient) = (vec![0.0; 300], vec![0.0; 8], vec![0.0; parameters.len()]);
//! let gradients = Gradients { points: &mut points, latents: &mut latents, parameters: &mut gradient };
//! field.backward(&batch, &saved, &outputs, gradients, &mut BackwardScratch::default())?;
//!
//! let (mut m, mut v) = (vec![0.0; parameters.len()], vec![0.0; parameters.len()]);
//! let scale = (1.0 / global_norm(&[&gradient])).min(1.0) as f32;
//! adamw_step(&mut parameters, &gradient, &mut m, &mut v, &AdamW::default(), 1, scale)?;
//! # Ok::<(), KernelError>(())
//! ```
//!
//! Three kinds of object: [`Field`] is the asset (parameters packed for the processor), [`Saved`] is what one forward
//! keeps for its backward, [`BackwardScratch`] can be thrown away at any time.
//!
//! **Determinism.** Results have the same bytes for any number of threads and for every [`InstructionSet`] but
//! [`InstructionSet::Amx`], which rounds factors to bf16 and is used where it is asked for alone. Work runs
//! on the current rayon pool.
//!
//! **Rates.** `cargo run --release -p unic-kernels --example field_rate` prints them beside [`fma_peak`].

mod adamw;
#[cfg(target_arch = "x86_64")]
mod amx;
mod backward;
mod batch;
mod blocks;
mod buffer;
mod error;
mod field;
mod lanes;
mod layer;
mod panels;
mod peak;
mod product;
mod reduce;
mod saved;
mod shape;

pub use adamw::{AdamW, adamw_step, global_norm};
pub use backward::{BackwardScratch, Gradients};
pub use batch::Batch;
pub use error::KernelError;
pub use field::Field;
pub use lanes::InstructionSet;
pub use peak::fma_peak;
pub use saved::{Retention, Saved};
pub use shape::{FieldShape, LinearMap};
