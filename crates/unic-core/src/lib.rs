//! Runtime of neural garments: everything that a game engine links to wear them.
//!
//! A trained [`Model`] is read from the bytes of its file and shared by any number of
//! [`Animator`]s. An animator takes the pose of a character once a tick and returns the world
//! positions and normals of its garment. Nothing is simulated.
//!
//! # Tour
//!
//! A model is immutable. An animator is one garment in motion: [`reset`](Animator::reset) it at the
//! first frame and after every cut, then [`step`](Animator::step) it once a tick.
//!
//! ```
//! use std::sync::Arc;
//! use unic_core::{Animator, Model, Pose, Start, StepInput};
//! # mod tour { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/tour_model.rs")); }
//! # let file = tour::file()?;
//!
//! let model = Arc::new(Model::from_bytes(&file)?);
//! let mut garment = Animator::new(Arc::clone(&model));
//!
//! fn input(pose: &Pose) -> StepInput<'_> {
//!     StepInput { pose, next_pose: None, ground_height: 0.0, wind: glam::Vec3::ZERO }
//! }
//! let mut pose = model.character().skeleton.bind_pose();
//! garment.reset(&input(&pose), Start::MeanShape)?;
//!
//! // A tick is 1 / fps seconds of the model, whatever the rate of the display is.
//! assert_eq!(model.config().fps, 30.0);
//! for _ in 0..3 {
//!     pose.trans.z += 0.03;
//!     let frame = garment.step(&input(&pose))?;
//!     assert_eq!(frame.positions.len(), model.vertex_count());
//!     assert!((frame.normals[0].length() - 1.0).abs() < 1e-5);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`AnimatorState`] is everything that the next step depends on. A state that is saved and
//! restored continues with the same bytes. [`Start::Positions`] takes over a garment from a
//! simulation or from a cache instead.
//!
//! ```
//! # use std::sync::Arc;
//! # use unic_core::{Animator, AnimatorState, Model, Start};
//! # mod tour { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/tour_model.rs")); }
//! # let model = Arc::new(Model::from_bytes(&tour::file()?)?);
//! # let mut pose = model.character().skeleton.bind_pose();
//! # let mut garment = Animator::new(Arc::clone(&model));
//! # let input = tour::input(&pose);
//! # garment.reset(&input, Start::MeanShape)?;
//! # pose.trans.z += 0.03;
//! # let input = tour::input(&pose);
//! let saved: AnimatorState = garment.state().clone(); // or serialise it with serde
//! let ahead = garment.step(&input)?.positions.to_vec();
//! garment.restore(saved)?;
//! assert_eq!(garment.step(&input)?.positions, ahead);
//!
//! let mut other = Animator::new(model);
//! other.reset(&input, Start::Positions(&ahead))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The display shows more frames than the garment ticks. [`TickInterpolator`] puts the garment on
//! the pose of the moment, so that cloth follows a body that moves between two ticks. [`TickClock`]
//! says in which frames the garment ticks. [`LiveGarment`] is the three together, for an engine that
//! has a pose and a time in every frame.
//!
//! ```
//! # use std::sync::Arc;
//! # use unic_core::{Animator, Model, Start, TickInterpolator};
//! # mod tour { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/tour_model.rs")); }
//! # let model = Arc::new(Model::from_bytes(&tour::file()?)?);
//! # let pose = model.character().skeleton.bind_pose();
//! # let mut garment = Animator::new(Arc::clone(&model));
//! # let input = tour::input(&pose);
//! let mut display = TickInterpolator::default();
//! garment.reset(&input, Start::MeanShape)?;
//! display.cut(&garment); // after every reset
//! garment.step(&input)?;
//! display.tick(&garment); // after every step
//!
//! let elapsed_share = 0.25; // of the time between the last two ticks
//! let frame = display.show(&garment, &pose, elapsed_share)?;
//! assert_eq!(frame.positions.len(), model.vertex_count());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Settings of a model are chosen when it is loaded, those of an animator at any time.
//! [`Precision`] and sampling make steps faster. [`IntersectionMode`] keeps vertices out of the
//! body, [`Collider`]s are the ground and props, [`Layers`] keep one part of a garment over
//! another, [`Threads`] are the engine's own workers.
//!
//! ```
//! # use std::sync::Arc;
//! use unic_core::{Animator, Collider, Corrects, IntersectionMode, Model, Precision};
//! # use unic_core::parallel::Serial;
//! # mod tour { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/tour_model.rs")); }
//! # let file = tour::file()?;
//!
//! let model = Model::from_bytes(&file)?
//!     .with_precision(Precision::Bf16) // number format of the networks
//!     .with_sampling(0.5)?; // the networks see half of the vertices
//! let mut garment = Animator::new(Arc::new(model));
//! garment.set_intersection(IntersectionMode::Robust {
//!     margin_m: IntersectionMode::MARGIN_M,
//!     corrects: Corrects::Display,
//! });
//! garment.set_colliders([Collider::ground(0.0)]);
//! garment.set_threads(Arc::new(Serial));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! The names at the crate's root are all that most engines need. Modules hold the rest:
//!
//! - **Engines**: [`animator`], [`model`], [`config`], [`skeleton`], [`rig`], [`clip`],
//!   [`collider`], [`intersection`], [`parallel`].
//! - **Training and evaluation**, which share these definitions with the animator: [`motion`],
//!   [`heading`], [`features`], [`network`], [`prior`], [`recurrence`], [`weights`], [`sampling`],
//!   [`projection`].
//! - **Tools** that make, inspect and convert characters, garments and models: [`model_file`],
//!   [`character`], [`mesh`], [`skinning`], [`transform`], [`topology`], [`subdivide`],
//!   [`surface_map`], [`diffusion`], [`closest`], [`surface`], [`folds`], [`colouring`],
//!   [`simd`].
//!
//! # Conventions
//!
//! Right-handed, +Y up, a character faces +Z; metres, seconds, radians, f32. Transforms are named
//! so that products read: `world_from_joint * joint_from_point`. Rest shapes are in the character's
//! bind-pose space. Every position that goes into or comes out of an animator is in world space.
//!
//! Three kinds of object are never mixed. An **asset** ([`Model`]) is immutable and shared. A
//! **state** ([`AnimatorState`]) is everything that the next step depends on. **Scratch** memory is
//! private to an animator and can be rebuilt from the two at any time.
//!
//! The same inputs give the same bytes for any number of threads, on machines of one instruction
//! set.
//!
//! # Limits
//!
//! A model knows one character's proportions and one garment. It ticks at its own frame rate
//! ([`config::ModelConfig::fps`]).

mod aabb_tree;
pub mod animator;
mod bounds;
pub mod character;
pub mod clip;
pub mod closest;
pub mod collider;
pub mod colouring;
pub mod config;
pub mod diffusion;
pub mod features;
pub mod folds;
pub mod heading;
pub mod intersection;
pub mod leg;
pub mod mesh;
pub mod model;
pub mod model_file;
pub mod motion;
pub mod motion_matching;
pub mod network;
pub mod parallel;
mod precision_errors;
#[doc(hidden)]
pub mod printable;
pub mod prior;
pub mod projection;
pub mod recurrence;
pub mod replay;
pub mod rig;
pub mod sampling;
pub mod simd;
pub mod skeleton;
pub mod skinning;
pub mod subdivide;
pub mod surface;
pub mod surface_map;
#[cfg(test)]
mod test_meshes;
pub mod topology;
pub mod transform;
mod triangle;
pub mod weights;

pub use animator::{
    Animator, AnimatorError, AnimatorState, GarmentFrame, LiveGarment, Start, StepInput, Surroundings,
    TickClock, TickInterpolator,
};
pub use collider::Collider;
pub use config::{Corrects, IntersectionMode};
pub use intersection::Layers;
pub use model::Model;
pub use model_file::ModelFileError;
pub use network::{CodeSampling, Precision};
pub use parallel::Threads;
pub use precision_errors::PrecisionErrors;
pub use skeleton::Pose;

// The page's snippets compile against this crate.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guides/embed.md")]
struct Embedding;
