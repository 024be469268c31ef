//! Small synthetic captures for the tests of the other crates; a development dependency alone.
//!
//! A [`Figure`] is a character and its garment, a [`Take`] a motion with the garment on it; takes are
//! written as a capture by [`write_capture`]. [`Figure::tube`] is a symmetric figure in a tube whose
//! lower rings swing after the hip ([`take`]): it turns, leans, walks and remembers, in a few
//! milliseconds. [`Figure::mixamo`] wears the same tube on 65 joints, fingers included, named as Mixamo does.
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
mod tube;

pub use capture::{Figure, Take, capture, write_capture};
pub use mixamo::{MIXAMO_JOINTS, mixamo_clip};
pub use motion::{FPS, clip, take};
pub use tube::{BODY_VERTICES, JOINTS, VERTICES, opposite};
