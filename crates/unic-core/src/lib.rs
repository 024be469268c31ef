//! What an engine links to wear a neural garment.
//!
//! A trained [`Model`](model::Model) is read from the bytes of its file and shared by any number of
//! [`Animator`](animator::Animator)s. Each of them takes a pose a tick and gives back the garment's
//! world positions and normals; nothing is simulated, and a saved state goes on to the same bytes.
//!
//! ```
//! use std::sync::Arc;
//! use unic_core::{animator::{Animator, Start, StepInput}, model::Model, skeleton::Pose};
//! # use glam::Vec3;
//! # use unic_core::{
//! #     character::{Character, Garment}, config::*, features::RestBox, mesh::TriMesh,
//! #     model::{About, ModelParts}, motion::*, network::Linear, prior::Prior,
//! #     skeleton::{Skeleton, SkeletonParts}, skinning::SkinningWeights,
//! # };
//! # fn linear(inputs: usize, outputs: usize) -> Linear {
//! #     Linear { inputs, outputs, weight: vec![0.01; inputs * outputs], bias: vec![0.1; outputs] }
//! # }
//! # fn parts() -> Result<ModelParts, Box<dyn std::error::Error>> {
//! #     let joints = vec![Vec3::Y, Vec3::Y * 0.1];
//! #     let skeleton = Skeleton::new(SkeletonParts { parents: vec![-1, 0], joints, ..Default::default() })?;
//! #     let mesh = TriMesh::new(vec![Vec3::Y, Vec3::Y + Vec3::X, Vec3::Y * 0.5], vec![[0, 1, 2]])?;
//! #     let weights = SkinningWeights::from_dense(&[1.0, 0.0, 1.0, 0.0, 0.5, 0.5], 3, 2)?;
//! #     let character = Character { body: mesh.clone(), skeleton, weights: weights.clone() };
//! #     let inputs = vec![PointInput::Displacement, PointInput::Velocity, PointInput::Rest];
//! #     let state = DisplacementConfig { memory_s: 0.1, scale_m: 0.05, output_limit: 3.0, inputs };
//! #     let pair = 2 * motion_len(2);
//! #     Ok(ModelParts {
//! #         config: ModelConfig {
//! #             fps: 30.0,
//! #             motion: MotionSpec::new(MotionLayout::Heading, VelocityScheme::Backward, [1; 4], &character)?,
//! #             encoder: EncoderConfig { hidden: vec![4], channels: 2, categories: 3, code: LatentCode::PickedLogit },
//! #             field: FieldConfig { width: 8, hidden_layers: 2, skip: Some(1) },
//! #             state: StateConfig::Displacement(state),
//! #             intersection: IntersectionMode::Off,
//! #         },
//! #         character,
//! #         rest_box: RestBox::of(&mesh.vertices),
//! #         prior: Prior::constant(vec![Vec3::ZERO; 3], pair),
//! #         garment: Garment::new(mesh, weights),
//! #         normalisation: Normalisation::identity(2),
//! #         encoder: vec![linear(pair, 4), linear(4, 6)],
//! #         field: vec![linear(11, 8), linear(19, 8), linear(8, 3)],
//! #         about: About::default(),
//! #     })
//! # }
//! # let file: Vec<u8> = Model::new(parts()?)?.to_bytes()?;
//!
//! let model = Arc::new(Model::from_bytes(&file)?);
//! let [mut left, mut right] = [(); 2].map(|()| Animator::new(Arc::clone(&model)));
//!
//! // Frame 0, and every frame after a cut: the garment hangs as it does on average.
//! let mut pose = model.character().skeleton.bind_pose();
//! fn input(pose: &Pose) -> StepInput<'_> {
//!     StepInput { pose, next_pose: None, ground_height: 0.0, wind: Vec3::ZERO }
//! }
//! left.reset(&input(&pose), Start::MeanShape)?;
//! // Or where somebody else has put it.
//! let hanging = left.garment().positions.to_vec();
//! right.reset(&input(&pose), Start::Positions(&hanging))?;
//!
//! // Then once a tick of 1 / fps seconds.
//! pose.trans.z += 0.03;
//! let frame = left.step(&input(&pose))?;
//! assert_eq!(frame.positions.len(), model.vertex_count());
//! assert!((frame.normals[0].length() - 1.0).abs() < 1e-5);
//! let frame = frame.positions.to_vec();
//! assert_eq!(right.step(&input(&pose))?.positions, frame);
//!
//! // A state can be kept, serialised and gone on with.
//! let saved = left.state().clone();
//! pose.trans.z += 0.03;
//! let ahead = left.step(&input(&pose))?.positions.to_vec();
//! left.restore(saved)?;
//! assert_eq!(left.garment().positions, frame);
//! assert_eq!(left.step(&input(&pose))?.positions, ahead);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where things are
//!
//! - [`skeleton`], [`transform`], [`clip`], [`heading`], [`motion`]: poses, forward kinematics, and the
//!   motion vector that the networks read.
//! - [`mesh`], [`skinning`], [`weights`], [`character`]: the body and the garment, and how the skeleton
//!   carries them. [`topology`], [`subdivide`], [`surface_map`]: other meshes of the same garment.
//! - [`closest`], [`surface`], [`intersection`], [`folds`]: nearest points, inside and outside, and where
//!   a body touches itself.
//! - [`config`], [`features`], [`prior`], [`recurrence`], [`network`]: what a model is made of. [`features`] is used by
//!   training too, so that both read the same numbers.
//! - [`model`], [`animator`], [`sampling`]: the trained asset, its instances, and fewer vertices for speed.
//! - [`parallel`]: the threads that all of it runs on, an engine's own if it likes.
//!
//! # Conventions
//!
//! Right-handed, +Y up, a character faces +Z; metres, seconds, radians, f32. Transforms are named so
//! that products read: `world_from_joint * joint_from_point`. Rest shapes are in the character's
//! bind-pose space; every position that goes into or comes out of an animator is in world space.
//!
//! Three kinds of object are never mixed: an **asset** ([`model::Model`]) is immutable and shared, a
//! **state** ([`animator::AnimatorState`]) is all that the next step depends on, and scratch, private to
//! the animator, can be rebuilt from the two at any time. The same inputs give the same bytes for any
//! number of threads, on machines of one instruction set.
//!
//! # Limits
//!
//! A model knows one character's proportions and one garment. It ticks at its own frame rate
//! ([`config::ModelConfig::fps`]); other rates are interpolated outside.

pub mod animator;
mod bvh;
pub mod character;
pub mod clip;
pub mod closest;
pub mod collider;
pub mod config;
mod diffusion;
pub mod features;
pub mod folds;
pub mod heading;
pub mod intersection;
pub mod mesh;
pub mod model;
mod model_file;
pub mod motion;
pub mod network;
pub mod parallel;
pub mod prior;
pub mod recurrence;
pub mod sampling;
#[cfg(test)]
mod shapes;
#[doc(hidden)]
pub mod shown;
pub mod skeleton;
pub mod skinning;
pub mod subdivide;
pub mod surface;
pub mod surface_map;
pub mod topology;
pub mod transform;
mod triangle;
pub mod weights;

pub use model_file::{FORMAT_VERSION, Integrity, ModelFileError, verify_checksum};

// The page's snippets compile against this crate.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/embedding.md")]
struct Embedding;
