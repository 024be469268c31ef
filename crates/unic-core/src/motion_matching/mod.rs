//! Motion matching: a character that follows commands by playing the frames of a motion database.
//!
//! After Clavet 2016, "Motion Matching and the Road to Next-Gen Animation", and the simulation
//! object, springs and adjustment of D. Holden's public demonstration.
//!
//! - A [`Database`] is an asset: clips as flat arrays, normalised features of every frame, and a
//!   search index. It is built from [`TaggedClip`]s or read from the bytes of a file.
//! - A [`Controller`] is one character. Each [`step`](Controller::step) takes a [`Command`], which
//!   moves a [`SimulatedObject`] on springs. A search finds the frame whose pose continues the
//!   present one and whose future follows the object. The pose is blended by inertialisation, the
//!   root is adjusted towards the object, and standing feet are locked.
//! - A [`ControllerState`] is a value: saved and restored, it continues with the same bytes.
//! - A [`PoseInterpolator`] shows poses between the ticks, whose rate is that of the database.
//!
//! The pose goes into an [`Animator`](crate::Animator), which takes all velocities that the garment
//! sees from successive poses. A switch between clips is therefore as smooth for the garment as for
//! the body.

mod build;
mod command;
mod content;
mod controller;
mod database;
mod display;
mod error;
mod features;
mod feet;
mod file;
mod index;
mod inertia;
mod mirror;
mod object;
mod root;
mod search;
mod settings;
mod spring;
mod state;
mod track;

pub use build::{TagRange, TaggedClip};
pub use command::{Command, Facing, MouseButtons, MouseControl};
pub use controller::{Clamping, Controller, ControllerError, SearchOutcome, StepReport};
pub use database::{Database, DatabaseSettings, StoredClip, View};
pub use display::PoseInterpolator;
pub use error::DatabaseError;
pub use features::{Feature, FeatureGroup, FeatureScale, standard_groups};
pub use feet::{FootHold, FootState};
pub use file::{ChecksumRule, DatabaseFileError, FORMAT_VERSION, MAGIC};
pub use index::SearchScratch;
pub use inertia::PoseOffset;
pub use object::SimulatedObject;
pub use root::{RootFrame, direction_of, horizontal, wrapped, yaw_of};
pub use search::{Continuing, Match, Query, TagFilter};
pub use settings::ControllerSettings;
pub use spring::{Driven, Moving, Spring, SpringValue};
pub use state::ControllerState;
