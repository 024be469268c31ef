//! A whole frame of a neural garment in compute kernels.
//!
//! What [`unic_core::Animator`] does on the CPU is done here by compute kernels through [`wgpu`]:
//! prior, encoder, field, skinning of garment and body, intersection handling, normals. A step uploads the
//! pose, a few kilobytes; the garment stays on the device, in a buffer that can be drawn as it is.
//!
//! ```no_run
//! use std::sync::Arc;
//! use unic_core::{Start, StepInput, Model};
//! use unic_gpu::{GpuAnimator, GpuContext, GpuModel, Precision};
//!
//! # let file: Vec<u8> = Vec::new();
//! let model = Arc::new(Model::from_bytes(&file)?);
//!
//! // The fastest adapter, or `GpuContext::from_device` for a renderer's own device.
//! let context = GpuContext::new()?;
//! let asset = Arc::new(GpuModel::new(&context, Arc::clone(&model), Precision::F32)?);
//! let [mut left, mut right] = [GpuAnimator::new(Arc::clone(&asset))?, GpuAnimator::new(asset)?];
//!
//! // Frame 0, and every frame after a cut; then once a tick of 1 / fps seconds.
//! let mut pose = model.character().skeleton.bind_pose();
//! let input = StepInput { pose: &pose, next_pose: None, ground_height: 0.0, wind: glam::Vec3::ZERO };
//! left.reset(&input, Start::MeanShape)?;
//! pose.trans.z += 0.03;
//! left.step(&StepInput { pose: &pose, next_pose: None, ground_height: 0.0, wind: glam::Vec3::ZERO })?;
//!
//! // Draw it: six f32 a vertex, see `GpuAnimator::VERTEX_ATTRIBUTES`.
//! # fn draw(pass: &mut unic_gpu::wgpu::RenderPass, left: &GpuAnimator) {
//! pass.set_vertex_buffer(0, left.vertex_buffer().slice(..));
//! # }
//! // Or look at it.
//! let first = left.read_back()?.positions[0];
//!
//! // A state goes on where it is taken: on this device, another one, the CPU.
//! right.restore(left.state()?)?;
//! let mut on_cpu = unic_core::Animator::new(model);
//! on_cpu.restore(left.state()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How a frame is computed
//!
//! The motion vectors, of 24 joints or so, are made on the host. [`GpuModel`] holds what all instances
//! share: weights, meshes, compiled kernels. An animator records its dispatches once, and a step submits
//! them:
//!
//! | stage | kernels |
//! |---|---|
//! | `prior`, `encoder` | rows of a matrix times one vector, 32 lanes a row: bound by memory |
//! | `skinning` | one invocation a vertex: its frame, the prior's displacement, the field's inputs |
//! | `field` | a workgroup takes a tile of vertices through all layers; activations stay in workgroup memory, sums in registers, weights pass by in chunks, or both in matrix units; the latent vector is folded into biases, as on the CPU |
//! | `body`, `intersections` | the body is skinned, a tree of boxes refitted from its leaves up, and searched from last frame's answer on |
//! | `positions`, `normals` | one invocation a vertex; sums in a fixed order, so that there are no atomics |
//!
//! # Limits
//!
//! - In [`Precision::F32`] positions are those of the CPU but for rounding: the tests ask for 1 mm, over 60
//!   frames of free running, and find 0.1 mm and less.
//! - The robust handling of intersections moves each vertex as the CPU does; it does not lift faces
//!   that the body pokes through, nor spread corrections over the garment.
//! - Matrix units ([`Precision::F16Matrix`]) are used where they are asked for by
//!   [`GpuContext::with_matrix_units`]: wgpu 30 has cooperative matrices as an experimental feature only.
//! - A field may be as wide as a workgroup's memory allows: 256 in the 16 KiB that every device has, where it does
//!   without matrix units.
//! - [`GpuAnimator::read_back`], [`GpuAnimator::state`] and timings block, which browsers do not allow.

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
pub use peak::MultiplyAdds;
pub use program::StageTime;
pub use wgpu;
