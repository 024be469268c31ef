//! Small synthetic captures for the tests of other crates, which have it as a development
//! dependency.
//!
//! - A [`Figure`] is a character with its garment.
//! - A [`Take`] is a motion with the positions of the garment.
//! - [`write_capture`] writes takes as a capture.
//! - [`Figure::tube`] is a symmetric figure in a tube. In a [`take`] it turns, leans and walks, and
//!   the lower rings of the tube follow the hip with a delay. It takes a few milliseconds.
//! - [`rod`] is a figure of two joints as FBX and USD files.
//! - [`Figure::mixamo`] wears the same tube on Mixamo's 65 joints, fingers included.
//!
//! ```
//! use unic_io::Split;
//! use unic_testdata::{Figure, capture, take};
//!
//! let figure = Figure::tube();
//! let takes = [(take("one", 0, 24), Split::Train), (take("two", 1, 24), Split::Test)];
//! let (_folder, capture) = capture(&figure, &takes);
//! assert_eq!(capture.clip_names(Split::Test), ["two"]);
//! assert_eq!(capture.garment.rest.vertices.len(), unic_testdata::VERTICES);
//! ```

#![allow(
    clippy::unwrap_used,
    reason = "a set-up that fails is a test that fails; nothing else links this crate"
)]

mod capture;
mod mixamo;
mod motion;
pub mod rod;
mod tube;

pub use capture::{Figure, Take, capture, write_capture};
pub use mixamo::{MIXAMO_JOINTS, mixamo_clip};
pub use motion::{FPS, clip, take};
pub use tube::{BODY_VERTICES, JOINTS, VERTICES, opposite};
