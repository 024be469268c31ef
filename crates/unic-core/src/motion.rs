//! The motion vector c_t: what a model knows about the character's motion in one frame.
//!
//! For J joints, the root included, it holds 12 J + 7 numbers: 295 for SMPL's 24 joints, as in
//! the paper (section "Motion representation"). Joint slices leave the root out and keep the
//! skeleton's order; a 6D rotation is the first two rows of the rotation matrix.
//!
//! | slice, for J = 24 | content | [`MotionLayout::Paper`] | [`MotionLayout::Heading`] |
//! |---|---|---|---|
//! | 0-2 | root position | m, sequence frame | (0, height above the ground in m, 0) |
//! | 3-5 | root velocity | m per frame, sequence frame | m/s, heading frame |
//! | 6-11 | root orientation, 6D | from the root to the sequence frame | to the heading frame |
//! | 12-14 | root angular velocity, axis times angle of R_t R_{t−1}ᵀ | rad per frame, sequence frame | rad/s, heading frame |
//! | 15-152 | joint rotations, 6D | to the parent | to the parent |
//! | 153-221 | joint positions | m, sequence frame | m, heading frame, from the root joint |
//! | 222-290 | joint velocities of world positions | m per frame, sequence frame | m/s, heading frame |
//! | 291-294 | contacts, 0 or 1 | squared step below 0.002 m² | slower than 0.25 m/s and lower than at rest + 5 cm |
//!
//! [`MotionLayout::PaperRootRelative`] is the paper's layout with joint positions relative to the root
//! joint of their own frame and a root position of zero.
//!
//! The **sequence frame** is the root's frame in the first frame of the sequence: a vector in this
//! layout stays the same when the whole sequence moves rigidly. The **heading frame** of frame t
//! has its origin at the root joint and is turned about +Y by the [`Heading`](crate::heading): a
//! vector in this layout stays the same when the whole sequence turns about the vertical, moves
//! sideways, or moves up together with its ground.
//!
//! [`MotionState`] makes the vectors one frame at a time, in training as at run time.

mod frame;
mod normalisation;
mod state;
#[cfg(test)]
mod tests;

pub use normalisation::{Normalisation, NormalisationRule, NormalisedElements, ROUNDING_STD};
pub use state::{MotionInput, MotionState};

use crate::{character::Character, skeleton::Skeleton};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use thiserror::Error;

/// Frames and units of the motion vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionLayout {
    /// The published one: frame of the sequence's first root pose, units per frame.
    Paper,
    /// The published layout with positions relative to the root joint of the same frame: none of them
    /// leaves the training range on a long walk.
    PaperRootRelative,
    /// Frame that follows the character about the vertical, SI units.
    Heading,
}

/// Which frames a velocity is a difference of. Angular velocity and contacts follow it too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VelocityScheme {
    /// c_t holds x_{t+1} − x_t, as the authors' release has it. Costs a frame of latency; where the
    /// next pose is not known (live input, the last frame), the backward difference stands in.
    Forward,
    /// c_t holds x_t − x_{t−1}, and v_0 is v_1.
    Backward,
}

/// Which motion vector a model reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Frames and units.
    pub layout: MotionLayout,
    /// Direction of differences.
    pub velocity: VelocityScheme,
    /// Left ankle, left foot, right ankle, right foot.
    pub contact_joints: [usize; 4],
    /// Heights of these joints above the soles in the bind pose, metres. The paper's layout does
    /// not read them.
    pub contact_rest_heights_m: [f32; 4],
}

impl MotionSpec {
    /// For a character that stands on its lowest vertex in the bind pose.
    ///
    /// The skeleton alone does not say where the ground is: joints lie 2 to 8 cm above the soles,
    /// as much as the whole tolerance of a contact.
    ///
    /// # Errors
    /// Contact joints that the skeleton does not have.
    pub fn new(
        layout: MotionLayout,
        velocity: VelocityScheme,
        contact_joints: [usize; 4],
        character: &Character,
    ) -> Result<Self, MotionError> {
        let joints = character.skeleton.joints();
        check_contacts(contact_joints, joints.len())?;
        let vertices = character.body.vertices.iter();
        let soles = vertices.map(|v| v.y).reduce(f32::min);
        let lowest_joint = || joints.iter().map(|j| j.y).fold(f32::INFINITY, f32::min);
        let ground = soles.unwrap_or_else(lowest_joint);
        Ok(Self {
            layout,
            velocity,
            contact_joints,
            contact_rest_heights_m: contact_joints.map(|j| joints[j].y - ground),
        })
    }

    /// What a specification that comes from a file must satisfy.
    ///
    /// # Errors
    /// Contact joints that the skeleton does not have, rest heights that are not finite.
    pub fn check(&self, skeleton: &Skeleton) -> Result<(), MotionError> {
        check_contacts(self.contact_joints, skeleton.len())?;
        match (self.contact_rest_heights_m.iter()).position(|h| !h.is_finite()) {
            None => Ok(()),
            Some(element) => Err(MotionError::NotFinite {
                what: "contact rest height",
                element,
            }),
        }
    }
}

fn check_contacts(contact_joints: [usize; 4], joints: usize) -> Result<(), MotionError> {
    match contact_joints.into_iter().find(|&joint| joint >= joints) {
        None => Ok(()),
        Some(joint) => Err(MotionError::ContactJoint { joint, joints }),
    }
}

/// What is wrong with a motion specification, state or normalisation.
#[derive(Debug, Error, PartialEq)]
pub enum MotionError {
    /// A contact joint beyond the skeleton.
    #[error("motion: contact joint {joint} is not among the {joints} joints")]
    ContactJoint {
        /// The index found.
        joint: usize,
        /// Number of joints.
        joints: usize,
    },
    /// An array of another length.
    #[error("motion: expected {expected} numbers in {what}, found {found}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length for this skeleton.
        expected: usize,
        /// The length found.
        found: usize,
    },
    /// NaN or infinity, or a standard deviation that is not above zero.
    #[error("motion: {what} {element} is not a usable number")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// Index in it.
        element: usize,
    },
}

/// Numbers in the motion vector of a skeleton with J joints, the root included: 12 J + 7.
pub fn motion_len(joints: usize) -> usize {
    12 * joints + 7
}

/// Where each part of the motion vector lies.
///
/// ```
/// use unic_core::motion::{MotionSlices, motion_len};
/// let slices = MotionSlices::new(24);
/// assert_eq!(slices.joint_positions, 153..222);
/// assert_eq!(slices.contacts.end, motion_len(24));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionSlices {
    /// 3 numbers.
    pub root_position: Range<usize>,
    /// 3 numbers.
    pub root_velocity: Range<usize>,
    /// 6 numbers.
    pub root_orientation: Range<usize>,
    /// 3 numbers.
    pub root_angular_velocity: Range<usize>,
    /// 6 numbers a joint other than the root.
    pub joint_rotations: Range<usize>,
    /// 3 numbers a joint other than the root.
    pub joint_positions: Range<usize>,
    /// 3 numbers a joint other than the root.
    pub joint_velocities: Range<usize>,
    /// 4 numbers.
    pub contacts: Range<usize>,
}

impl MotionSlices {
    /// For a skeleton with this many joints, the root included.
    pub fn new(joints: usize) -> Self {
        let local = joints.saturating_sub(1);
        let mut end = 0;
        let mut next = |len: usize| {
            end += len;
            end - len..end
        };
        Self {
            root_position: next(3),
            root_velocity: next(3),
            root_orientation: next(6),
            root_angular_velocity: next(3),
            joint_rotations: next(6 * local),
            joint_positions: next(3 * local),
            joint_velocities: next(3 * local),
            contacts: next(4),
        }
    }

    /// The parts that a [`Normalisation`] scales: positions and velocities (0-5, 12-14 and 153-290
    /// for 24 joints). Rotations and contacts are of order one as they are.
    pub fn normalised(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        [
            self.root_position.start..self.root_velocity.end,
            self.root_angular_velocity.clone(),
            self.joint_positions.start..self.joint_velocities.end,
        ]
        .into_iter()
    }
}
