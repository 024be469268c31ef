//! Training of neural garments: from a capture to a model that `unic-core` animates.
//!
//! The only crate that knows Burn. A run is one [`Fit`] or two ([`Fit::of_run`]): with validation clips
//! held out, which tells the error on unseen motion, then on all clips. A [`Dataset`] opens the clips of a
//! fit and measures what a model needs of them; a [`Trainer`] runs a [`TrainConfig`] on it and tells its
//! listener what happens; [`Trainer::model`] is the result.
//!
//! ```
//! # use glam::{Quat, Vec3};
//! # use unic_core::{character::{Character, Garment}, clip::Clip, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
//! # use unic_io::{CaptureWriter, Manifest, Split, capture::JointReference};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let root = folder.path().join("flag");
//! # let sheet = TriMesh::new(vec![Vec3::Y, Vec3::X + Vec3::Y, Vec3::Y * 2.0], vec![[0, 1, 2]])?;
//! # let weights = SkinningWeights::from_dense(&[1.0, 0.0, 0.5, 0.5, 0.0, 1.0], 3, 2)?;
//! # let skeleton = Skeleton::new(SkeletonParts { parents: vec![-1, 0], joints: vec![Vec3::Y, Vec3::Y * 2.0], ..Default::default() })?;
//! # let character = Character { body: sheet.clone(), skeleton, weights: weights.clone() };
//! # let garment = Garment::new(sheet, weights);
//! # let mut manifest = Manifest::new("flag", 30.0);
//! # manifest.contact_joints = Some([0; 4].map(JointReference::Index));
//! # let mut writer = CaptureWriter::create(&root, manifest, &character, &garment, &Default::default())?;
//! # for (name, split) in [("one", Split::Train), ("two", Split::Train), ("three", Split::Validation)] {
//! #     let pose = |t: usize| Pose { trans: Vec3::Z * t as f32 * 0.03, local: vec![Quat::from_rotation_y(t as f32 * 0.1); 2] };
//! #     let poses: Vec<Pose> = (0..16).map(pose).collect();
//! #     let clip = Clip { name: name.into(), fps: 30.0, poses, ground_height: 0.0, wind: Vec::new() };
//! #     let mut out = writer.begin_clip(&clip, split)?;
//! #     for pose in &clip.poses {
//! #         out.push(&garment.rest.vertices.iter().map(|v| *v + pose.trans).collect::<Vec<_>>())?;
//! #     }
//! #     out.finish()?;
//! # }
//! # writer.finish()?;
//! use unic_train::{Control, Dataset, Event, Fit, Preset, TrainConfig, Trainer};
//!
//! let settings = ["optimiser.steps=3".to_owned(), "model.encoder.hidden=[16]".to_owned()];
//! let config = TrainConfig::preset(Preset::Tiny).with_assignments(&settings)?;
//! let data = Dataset::new(unic_io::Capture::open(&root)?, &config, Fit::HeldOut)?;
//! let mut trainer = Trainer::new(data, config)?;
//! trainer.run(None, &mut |event| {
//!     if let Event::Validated { step, rmse, .. } = event {
//!         println!("step {step}: {:.1} mm, free running", 1e3 * rmse);
//!     }
//!     Control::Continue
//! })?;
//! let bytes = trainer.model()?.to_bytes()?;
//! assert!(unic_core::model::Model::from_bytes(&bytes).is_ok());
//! # Ok(())
//! # }
//! ```
//!
//! | what | where |
//! |---|---|
//! | settings and presets: `paper`, `standard`, `tiny` | [`TrainConfig`], [`Preset`] |
//! | which clips are held out, and when | [`Fit`], [`Refit`] |
//! | one step's windows, and the noise on them | [`Batch`], [`StepNoise`] |
//! | motion encoder and deformation field | [`Network`], [`PackedField`] |
//! | free running through a window, and its loss | [`Rollout`], [`Correction`] |
//! | where the garment hangs before the field adds to it | [`fit_prior`] |
//! | AdamW | [`update`] |
//! | networks of other methods to compare with | [`RivalTrainer`], [`RivalKind`] |
//! | stop and go on | [`Checkpoint`], [`Trainer::resume`] |
//!
//! **Randomness.** Dropout masks, Gumbel noise, windows and perturbations are made here, each number
//! from (seed, [`Stream`], step), and handed to the networks as tensors. So a run repeats on the same
//! machine with the same bytes, for any number of threads, and a resumed run ends where an
//! uninterrupted one would.
//!
//! **Sizes.** W windows of K + 1 frames and n vertices each give field batches of W · n points; the field
//! is pointwise, so any subset of the vertices will do.
//!
//! **Rates.** `cargo run --release -p unic-train --example training_rate` prints them beside the machine's
//! multiply-add peak.
//!
//! **GPUs.** With the cargo features `cuda`, `vulkan` and `metal` a [`Dataset`] prepared for that [`Processor`] trains there:
//! the field is [`composed`] of Burn's operations instead of fused ([`PackedField`]); batches, noise and the update
//! stay on the host, so that a checkpoint goes on anywhere.

mod batch;
mod checkpoint;
mod config;
mod correction;
mod dataset;
mod elu_op;
mod error;
mod event;
mod field_op;
mod fit;
mod mirror;
mod network;
mod noise;
mod optimiser;
mod prior;
mod processor;
mod recurrence;
mod rival;
mod rollout;
mod scales;
mod stream;
mod time;
mod trainer;
mod validation;

pub use batch::{Batch, Window};
pub use checkpoint::{Checkpoint, Progress};
pub use config::{
    BatchConfig, IntersectionConfig, IntersectionRule, Keep, LossConfig, ModelSettings, OptimiserConfig,
    PUBLISHED_EPOCHS, Preset, Products, RecurrenceSettings, Refit, RegularisationConfig, SettingsError,
    StateSettings, TrainConfig, ValidationConfig,
};
pub use correction::{Bodies, Correction};
pub use dataset::{Dataset, MotionVectors};
pub use error::TrainError;
pub use event::{Control, Event, Outcome};
pub use field_op::{FieldOperation, PackedField, composed};
pub use fit::Fit;
pub use mirror::{MirrorMap, View, mirrored};
pub use network::{Network, NetworkShape, Parameter, StepNoise};
pub use noise::SmoothNoise;
pub use optimiser::{Moments, update};
pub use prior::{FittedPrior, PriorSettings, fit_prior};
pub use processor::Processor;
pub use recurrence::{MOST_FOLDS, Watch};
pub use rival::{
    GlobalFeatureSettings, MotionElements, RivalConfig, RivalKind, RivalPredictor, RivalTrainer,
    SpaceSettings, SurfaceKind,
};
pub use rollout::Rollout;
pub use stream::{Stream, generator};
pub use time::TrainingTime;
pub use trainer::{Pace, Trainer};
pub use validation::{JUDGED_S, Validation, ValidationMotion, free_running_rmse};
