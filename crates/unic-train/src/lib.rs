//! Training of neural garments: from a capture to a model that `unic-core` animates.
//!
//! The only library crate that depends on Burn. The path goes in one direction: a [`Dataset`] opens
//! the clips of a fit and normalises them; a [`PriorTrainer`] fits the prior to them; [`FieldData`]
//! joins both and measures scales; a [`Trainer`] trains the encoder and the deformation field and
//! reports events to its listener; [`Trainer::model`] is the result. A run is one [`Fit`] or two
//! ([`Fit::of_run`]): with validation clips held out, which measures the error on unseen motion,
//! then on all clips.
//!
//! ```
//! # use glam::{Quat, Vec3};
//! # use unic_core::character::{Character, Garment};
//! # use unic_core::{clip::Clip, mesh::TriMesh, skeleton::*, skinning::SkinningWeights};
//! # use unic_io::{CaptureWriter, Manifest, Split, capture::JointReference};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let root = folder.path().join("flag");
//! # let sheet = TriMesh::new(vec![Vec3::Y, Vec3::X + Vec3::Y, Vec3::Y * 2.0], vec![[0, 1, 2]])?;
//! # let weights = SkinningWeights::from_dense(&[1.0, 0.0, 0.5, 0.5, 0.0, 1.0], 3, 2)?;
//! # let skeleton = Skeleton::new(SkeletonParts {
//! #     parents: vec![-1, 0],
//! #     joints: vec![Vec3::Y, Vec3::Y * 2.0],
//! #     ..Default::default()
//! # })?;
//! # let character = Character { body: sheet.clone(), skeleton, weights: weights.clone(), file_mesh: None };
//! # let garment = Garment::new(sheet, weights);
//! # let mut manifest = Manifest::new("flag", 30.0);
//! # manifest.contact_joints = Some([0; 4].map(JointReference::Index));
//! # let attributes = Default::default();
//! # let mut writer = CaptureWriter::create(&root, manifest, &character, &garment, &attributes)?;
//! # let splits = [("one", Split::Train), ("two", Split::Train), ("three", Split::Validation)];
//! # for (name, split) in splits {
//! #     let pose = |t: usize| Pose {
//! #         trans: Vec3::Z * t as f32 * 0.03,
//! #         local: vec![Quat::from_rotation_y(t as f32 * 0.1); 2],
//! #     };
//! #     let poses: Vec<Pose> = (0..16).map(pose).collect();
//! #     let (name, wind) = (name.into(), Vec::new());
//! #     let clip = Clip { name, fps: 30.0, poses, ground_height: 0.0, wind };
//! #     let mut out = writer.begin_clip(&clip, split)?;
//! #     for pose in &clip.poses {
//! #         let positions = garment.rest.vertices.iter().map(|v| *v + pose.trans);
//! #         out.push(&positions.collect::<Vec<_>>())?;
//! #     }
//! #     out.finish()?;
//! # }
//! # writer.finish()?;
//! use unic_train::{Control, Event, FieldData, Fit, Preset, TrainConfig, Trainer};
//!
//! let settings = ["optimiser.steps=3".to_owned(), "model.encoder.hidden=[16]".to_owned()];
//! let config = TrainConfig::preset(Preset::Tiny).with_assignments(&settings)?;
//! let data = FieldData::prepare(unic_io::Capture::open(&root)?, &config, Fit::HeldOut)?;
//! let mut trainer = Trainer::new(data, config)?;
//! trainer.run(None, &mut |event| {
//!     if let Event::Validated { step, rmse, .. } = event {
//!         println!("step {step}: {:.1} mm, free running", 1e3 * rmse);
//!     }
//!     Control::Continue
//! })?;
//! let bytes = trainer.model()?.to_bytes()?;
//! assert!(unic_core::Model::from_bytes(&bytes).is_ok());
//! # Ok(())
//! # }
//! ```
//!
//! | subject | items |
//! |---|---|
//! | settings and presets: `paper`, `standard`, `tiny` | [`TrainConfig`], [`Preset`] |
//! | clips held out, and the fits of a run | [`Fit`], [`Refit`] |
//! | clips of a fit, opened and normalised | [`Dataset`] |
//! | prior: principal components, linear map, recurrence | [`PriorTrainer`], [`FittedPrior`] |
//! | clips with the prior that the field adds to | [`FieldData`] |
//! | windows of one step, and their noise | [`Batch`], [`StepNoise`] |
//! | motion encoder and deformation field | [`Network`], [`PackedField`] |
//! | free running through a window, and its loss | [`Rollout`] |
//! | the training loop, for any network | [`Learner`], [`Training`] |
//! | AdamW | [`update`] |
//! | interruption and resumption | [`Checkpoint`], [`Trainer::resume`] |
//! | a run within a given time | [`Budget`] |
//! | building blocks for networks of one's own | [`layers`] |
//!
//! **Randomness.** Dropout masks, Gumbel noise, windows and perturbations are made here, each
//! number from (seed, [`Stream`], step), and handed to the networks as tensors. So a run repeats on
//! the same machine with the same bytes, for any number of threads, and a resumed run ends where an
//! uninterrupted one would.
//!
//! **Sizes.** W windows of K + 1 frames and n vertices each give field batches of W · n points; the
//! field is pointwise, so any subset of the vertices will do.
//!
//! **Rates.** `cargo run --release -p unic-train --example training_rate` prints them beside the
//! machine's multiply-add peak.
//!
//! **GPUs.** With the cargo features `cuda`, `vulkan` and `metal` a [`Dataset`] prepared for that
//! [`Processor`] trains there: the field is [`composed`] of Burn's operations instead of fused
//! ([`PackedField`]); batches, noise and the update stay on the host, so that a checkpoint goes on
//! anywhere.

mod batch;
mod budget;
mod checkpoint;
mod config;
mod dataset;
mod device;
mod elu_op;
mod error;
mod event;
mod field_data;
mod field_op;
mod fit;
pub mod layers;
mod learner;
mod mirror;
mod network;
mod noise;
mod optimiser;
mod parameters;
mod prior;
mod processor;
mod recurrence;
mod regression;
mod replay;
mod rollout;
mod scales;
mod sizing;
mod skinning;
mod strain;
mod stream;
mod time;
mod trainer;
mod validation;

pub use batch::{Batch, Window};
pub use budget::Budget;
pub use checkpoint::{Checkpoint, Position};
pub use config::{
    BatchConfig, IntersectionConfig, IntersectionRule, LossConfig, ModelSettings, OptimiserConfig,
    PUBLISHED_EPOCHS, Preset, Products, RecurrenceSettings, RecurrenceStart, Refit, RegularisationConfig,
    ReplaySettings, SettingsError, SizingSettings, SkinningSource, StateSettings, TrainConfig,
    ValidationConfig,
};
pub use dataset::{Dataset, MotionVectors};
pub use error::{Quantity, TrainError};
pub use event::{Control, Event, Outcome};
pub use field_data::FieldData;
pub use field_op::{FieldOperation, PackedField, composed};
pub use fit::Fit;
pub use learner::{Averaging, Learner, Listen, Training};
pub use mirror::{MirrorMap, View, mirrored, mirrored_surface, normalisation};
pub use network::{Network, NetworkShape, Parameter, StepNoise, WindowRows};
pub use noise::SmoothNoise;
pub use optimiser::{Moments, update};
pub use prior::{FittedPrior, PriorTrainer, displacements};
pub use processor::Processor;
pub use recurrence::{PretrainedUnit, Pretraining, Watch};
pub use rollout::Rollout;
pub use sizing::{Candidate, Follow, Gain, Sizing, SizingEvent, SizingTrainer, Tried, rungs};
pub use stream::{Stream, generator};
pub use time::TrainingTime;
pub use trainer::{FieldRecord, Pace, Trainer};
pub use validation::{
    Chosen, JUDGED_S, Measured, ShownTrial, Validation, ValidationMotion, free_running_rmse,
};
