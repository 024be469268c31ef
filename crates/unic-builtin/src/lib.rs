//! A procedural human, garments and motion, for use without any files.
//!
//! Everything is made from parameters. Nothing is read from a file, and the same parameters give
//! the same bytes.
//!
//! ```
//! use unic_builtin::{garments::TShirt, human::{HumanParameters, human}};
//!
//! // A skinned human in a T-pose, its 24 joints in SMPL's order.
//! let character = human(&HumanParameters::default())?;
//!
//! // A garment fits the body that it is made for, which may also come from a file.
//! let shirt = TShirt { sleeve_m: 0.16, ..TShirt::default() }.make(&character)?;
//! let sleeve = shirt.part("sleeve_left").map(|part| shirt.vertices_of(part).count());
//! assert!(sleeve > Some(100));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! - [`human`]: the body, from height, shoulder width and girths.
//! - [`garments`]: T-shirt, skirts, dress and robe for any character with SMPL's joints, and their
//!   building blocks: slices of the body, grids of cloth, seams.
//! - [`motion`]: clips for the same skeleton.
//! - [`scale`]: models with random weights for garments of any size, to measure times with.
//!
//! Lengths are in metres. +Y is up, characters face +Z, and their left is +X. Garments are in the
//! character's bind-pose space.

pub mod garments;
pub mod human;
mod implicit;
pub mod motion;
pub mod scale;
mod side;
