//! BVH motion files: any skeleton, any channels.
//!
//! Format: Biovision's, as described by Meredith and Maddock 2001, "Motion Capture File Formats
//! Explained". The file states neither its unit of length nor its up axis; [`crate::retarget`]
//! estimates both.
//!
//! In the zero pose (all rotations zero) the axes of every joint are those of the world. The local
//! rotation of a joint is the product of its channels' rotations, in the order of the file: each
//! channel rotates about an axis that the channels before it have rotated. A position channel
//! replaces its component of the joint's offset.
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
mod write;

pub(crate) use parse::is_bvh;
pub use write::write_bvh;

use crate::frame_rate::whole_rate;
use glam::{EulerRot, Vec3};
use unic_core::transform::Rigid;

/// A skeleton and its motion, in the unit and axes of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Bvh {
    joints: Vec<BvhJoint>,
    /// Seconds from one frame to the next.
    frame_time: f64,
    /// Number of channels of all joints: the length of a frame.
    channels: usize,
    /// Channel values, frame after frame: positions in the file's unit, rotations in degrees.
    values: Vec<f32>,
}

/// A joint of a [`Bvh`]. Parents precede their children.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// Name in the file, without surrounding whitespace; may contain spaces.
    pub name: String,
    /// Index of the parent; the root has none.
    pub parent: Option<usize>,
    /// Displacement from the parent joint in the zero pose, in the file's unit.
    pub offset: Vec3,
    /// Channels in the order of the file.
    pub channels: Vec<Channel>,
    /// Offsets of the end sites, the ends of the bones of a leaf joint.
    pub end_sites: Vec<Vec3>,
    /// Index of the first channel's number in a frame.
    first_channel: usize,
}

/// Meaning of one number of a frame.
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

/// A joint of another format, for [`Bvh::from_rest`].
#[derive(Clone, Debug)]
pub(crate) struct RestJoint {
    pub(crate) name: String,
    /// Index of the parent, which precedes the joint; the first joint is the only one without.
    pub(crate) parent: Option<usize>,
    /// Position in the rest pose, world space.
    pub(crate) position: Vec3,
}

/// Channels of every joint of [`Bvh::from_rest`].
const REST_CHANNELS: [Channel; 6] = [
    Channel::Position(Axis::X),
    Channel::Position(Axis::Y),
    Channel::Position(Axis::Z),
    Channel::Rotation(Axis::Z),
    Channel::Rotation(Axis::X),
    Channel::Rotation(Axis::Y),
];

impl Bvh {
    /// Makes a skeleton whose zero pose is a rest pose, with `frames` of [`push_frame`].
    ///
    /// [`push_frame`]: Self::push_frame
    pub(crate) fn from_rest(joints: Vec<RestJoint>, fps: f32, frames: Vec<f32>) -> Self {
        let offset = |joint: &RestJoint| match joint.parent {
            Some(parent) => joint.position - joints[parent].position,
            None => joint.position,
        };
        let joint = |(index, joint): (usize, &RestJoint)| BvhJoint {
            name: joint.name.clone(),
            parent: joint.parent,
            offset: offset(joint),
            channels: REST_CHANNELS.to_vec(),
            end_sites: Vec::new(),
            first_channel: REST_CHANNELS.len() * index,
        };
        Self {
            channels: REST_CHANNELS.len() * joints.len(),
            joints: joints.iter().enumerate().map(joint).collect(),
            frame_time: 1.0 / f64::from(fps),
            values: frames,
        }
    }

    /// Appends the channels of a frame to `frames`. `world` has for each joint its rotation from the
    /// rest pose and its position, world space.
    pub(crate) fn push_frame(joints: &[RestJoint], world: &[Rigid], frames: &mut Vec<f32>) {
        for (joint, own) in joints.iter().zip(world) {
            let local = match joint.parent {
                Some(parent) => world[parent].inverse() * *own,
                None => *own,
            };
            let (z, x, y) = local.rotation.to_euler(EulerRot::ZXY);
            frames.extend(local.translation.to_array());
            frames.extend([z, x, y].map(f32::to_degrees));
        }
    }

    /// Joints; the root is first, and parents precede their children.
    pub fn joints(&self) -> &[BvhJoint] {
        &self.joints
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        // A skeleton without channels has no frames either.
        self.values.len() / self.channels.max(1)
    }

    /// Returns whether there are no frames, only a skeleton.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Number of channels of all joints: the length of a frame.
    pub fn channel_count(&self) -> usize {
        self.channels
    }

    /// Frames per second. A rate within 0.02 % of a whole number is rounded to it, because files
    /// hold few digits of the frame time: .0083333 s is 120 fps.
    pub fn fps(&self) -> f32 {
        whole_rate(1.0 / self.frame_time) as f32
    }
}
