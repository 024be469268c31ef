//! BVH motion files: any skeleton, any channels.
//!
//! Format: Biovision's, as described by Meredith and Maddock 2001, "Motion Capture File Formats
//! Explained". Offsets and positions are in whatever unit and up axis the file's author used, and
//! nothing in the file says which; see [`retarget`](crate::retarget) for how they are told.
//!
//! In the zero pose (all rotations zero) every joint's axes are the world's. A rotation channel
//! turns about an axis that the channels before it have turned: the local rotation is the product
//! of the channels' rotations in the order of the file. A position channel replaces its component
//! of the joint's offset.
//!
//! ```
//! use glam::Vec3;
//! use unic_io::Bvh;
//!
//! # fn main() -> unic_io::Result<()> {
//! let text = "
//! HIERARCHY
//! ROOT hip { OFFSET 0 0 0 CHANNELS 4 Xposition Yposition Zposition Zrotation
//!   JOINT knee { OFFSET 1 0 0 CHANNELS 0 End Site { OFFSET 1 0 0 } } }
//! MOTION
//! Frames: 1
//! Frame Time: 0.01
//! 0 5 0 90
//! ";
//! let bvh = Bvh::parse("walk.bvh".as_ref(), text.as_bytes())?;
//! let mut world = Vec::new();
//! bvh.world_from_joint(0, &mut world);
//! assert!(world[1].translation.distance(Vec3::new(0.0, 6.0, 0.0)) < 1e-6);
//! # Ok(())
//! # }
//! ```

mod parse;
mod pose;
mod tokens;

use crate::error::{Error, Result};
use glam::Vec3;
use std::path::Path;

/// A skeleton and its motion, in the file's own unit and axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    joints: Vec<BvhJoint>,
    frame_time: f64,
    /// Numbers a frame.
    channels: usize,
    /// Frames × channels.
    values: Vec<f32>,
}

/// A joint of a [`Bvh`]; parents stand before their children.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// As in the file, without surrounding whitespace; may contain spaces.
    pub name: String,
    /// Index of the parent; the root has none.
    pub parent: Option<usize>,
    /// From the parent joint in the zero pose, in the file's unit.
    pub offset: Vec3,
    /// In the order of the file.
    pub channels: Vec<Channel>,
    /// Offsets of the end sites: where the bones of a leaf end.
    pub end_sites: Vec<Vec3>,
    /// Index of the first channel's number in a frame.
    first_channel: usize,
}

/// What one number of a frame means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Component of the translation from the parent, in the file's unit.
    Position(Axis),
    /// Rotation in degrees about an axis.
    Rotation(Axis),
}

/// Coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// (1, 0, 0).
    X,
    /// (0, 1, 0).
    Y,
    /// (0, 0, 1).
    Z,
}

impl Axis {
    /// Index of the component.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Unit vector.
    pub fn vector(self) -> Vec3 {
        Vec3::AXES[self as usize]
    }
}

impl Bvh {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, or is none that [`parse`](Self::parse) accepts.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
        Self::parse(path, &bytes)
    }

    /// Parses a file's content; `path` is for errors alone. Bytes that are no UTF-8 are allowed in
    /// names.
    ///
    /// # Errors
    /// A sentence with the line, what was expected and what was found: words or numbers in the wrong
    /// place, unknown channels, braces that do not match, joints of one name, numbers that are not
    /// finite, a frame time that is no frame rate from 1 to 1000, another count of numbers than
    /// frames × channels.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        parse::parse(path, &String::from_utf8_lossy(bytes))
    }

    /// Joints, parents before children, the root first.
    pub fn joints(&self) -> &[BvhJoint] {
        &self.joints
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.values.len() / self.channels.max(1)
    }

    /// No frames at all: a skeleton alone.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Numbers a frame.
    pub fn channel_count(&self) -> usize {
        self.channels
    }

    /// Frames per second. Frame times are written with few digits: a rate within 0.02 % of a whole
    /// number is that number (.0083333 s is 120 fps).
    pub fn fps(&self) -> f32 {
        let fps = 1.0 / self.frame_time;
        let whole = fps.round();
        let is_whole = (fps - whole).abs() < 2e-4 * whole;
        (if is_whole { whole } else { fps }) as f32
    }
}
