//! Neural garments on GPUs: a complete frame in compute kernels.
//!
//! Compute kernels through [`wgpu`] do here what [`unic_core::Animator`] does on the CPU: prior,
//! encoder, field, skinning of garment and body, strain projection, intersection handling, normals.
//! A step uploads the pose, a few kilobytes. The garment stays on the device, in a buffer that a
//! renderer can draw.
//!
//! ```no_run
//! use std::sync::Arc;
//! use glam::Vec3;
//! use unic_core::{Model, Start, StepInput};
//! use unic_gpu::{GpuAnimator, GpuContext, GpuModel, Precision};
//!
//! # let file: Vec<u8> = Vec::new();
//! let model = Arc::new(Model::from_bytes(&file)?);
//!
//! // The fastest adapter, or `GpuContext::from_device` for a renderer's own device.
//! let context = GpuContext::new()?;
//! let asset = Arc::new(GpuModel::new(&context, Arc::clone(&model), Precision::F32)?);
//! let mut left = GpuAnimator::new(Arc::clone(&asset))?;
//! let mut right = GpuAnimator::new(asset)?;
//!
//! // Reset at frame 0 and after every cut; then step once a tick of 1 / fps seconds.
//! let mut pose = model.character().skeleton.bind_pose();
//! let wind = Vec3::ZERO;
//! let input = StepInput { pose: &pose, next_pose: None, ground_height: 0.0, wind };
//! left.reset(&input, Start::MeanShape)?;
//! pose.trans.z += 0.03;
//! left.step(&StepInput { pose: &pose, next_pose: None, ground_height: 0.0, wind })?;
//!
//! // Draw the garment: six f32 a vertex, see `GpuAnimator::VERTEX_ATTRIBUTES`.
//! # fn draw(pass: &mut unic_gpu::wgpu::RenderPass, left: &GpuAnimator) {
//! pass.set_vertex_buffer(0, left.vertex_buffer().slice(..));
//! # }
//! // Or copy it to the host.
//! let first = left.read_back()?.positions[0];
//!
//! // A saved state continues on this device, on another one, or on the CPU.
//! right.restore(left.state()?)?;
//! let mut on_cpu = unic_core::Animator::new(model);
//! on_cpu.restore(left.state()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How a frame is computed
//!
//! The host computes the motion vectors, a few hundred numbers. [`GpuModel`] holds the data that
//! all instances share: weights, meshes, compiled kernels. An animator records its dispatches once,
//! and a step submits them:
//!
//! | stage | kernels |
//! |---|---|
//! | `prior`, `encoder` | matrix times one vector, 32 invocations a row: bound by memory |
//! | `skinning` | one invocation a vertex: its frame, its prior, the field's inputs |
//! | `field` | one workgroup a tile of vertices, through all layers |
//! | `body` | skins the body and refits a tree of boxes from its leaves up |
//! | `projection` | one workgroup a patch of vertices, through all constraints of a sweep |
//! | `intersections` | one invocation a vertex: searches the tree from the last frame's answer on; depths of the body's vertices are maxima by atomics |
//! | `positions`, `normals` | one invocation a vertex; sums in a fixed order, without atomics |
//!
//! In the field's kernel activations stay in workgroup memory and sums in registers or matrix
//! units, while weights are loaded in chunks. Products with the latent vector are folded into the
//! biases, as on the CPU.
//!
//! Constraints of the [strain projection](unic_core::projection) that have one colour share no
//! vertex. A sweep takes one or a few dispatches: a workgroup holds its patch in workgroup memory,
//! and solves all constraints, colour by colour, on which the patch depends. So constraints near the
//! border of a patch are solved by several workgroups, and positions are those of the CPU's order.
//! Models without a projection have no such stage. Pushes into the
//! [order of the cloth](unic_core::projection::order) take one invocation a vertex, which searches
//! buckets of cells; their sums are integers, so that the order in a bucket changes nothing. After
//! the robust handling of intersections the stage `intersections` also brings edges back towards
//! their limits, smooths the pushes, and pushes a second time.
//!
//! # Limits
//!
//! - In [`Precision::F32`] positions differ from the CPU's by rounding only. The tests require 1 mm
//!   over 60 frames of free running, and find 0.1 mm and less.
//! - The robust handling of intersections pushes each vertex as the CPU does, and keeps layers of
//!   shown cloth in order. It does not sink vertices out of parts that may not push them, lift faces
//!   that the body pokes through, or spread corrections over the garment. Raised layers are pushed
//!   out of other parts by the second push alone. Where two body faces are equally near to a vertex,
//!   rounding decides which of them pushes it. It also decides for pairs of layers whose distances at
//!   rest are those from which they count.
//! - After these pushes the [strain projection](unic_core::projection) relaxes edges and hinges in the
//!   CPU's sweeps and planes. It starts from positions without the parts named above, so shown positions
//!   near the body differ from the CPU's. States and offsets differ where vertices sink on the CPU
//!   and the handling corrects the state.
//! - Matrix units ([`Precision::F16Matrix`]) are used only on request, by
//!   [`GpuContext::with_matrix_units`]: cooperative matrices are an experimental feature of wgpu
//!   30.
//! - Workgroup memory limits the width of a field. Without matrix units, the 16 KiB of every device
//!   suffice for a width of 256.
//! - [`GpuAnimator::read_back`], [`GpuAnimator::state`] and timings block, which browsers do not
//!   allow.

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
mod projection;
mod start_memory;
mod tree;

pub use animator::{GarmentCopy, GpuAnimator};
pub use context::GpuContext;
pub use error::GpuError;
pub use model::{GpuModel, Precision};
pub use peak::MultiplyAdds;
pub use program::StageTime;
pub use wgpu;
