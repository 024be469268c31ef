//! Motion vector c_t: the character's motion in one frame, as the networks read it.
//!
//! For training and evaluation, which make the vectors by the same code as the animator.
//!
//! A skeleton of J joints, the root included, has a vector of 12 J + 7 numbers, and more with
//! springs: 295 for SMPL's 24 joints, as in the paper (section "Motion representation"). Joint
//! slices leave the root out and keep the skeleton's order. A 6D rotation is the first two rows of
//! the rotation matrix.
//!
//! | slice (J = 24) | content | layout `Paper` | layout `Heading` |
//! |---|---|---|---|
//! | 0-2 | root position | m | (0, height above the ground in m, 0) |
//! | 3-5 | root velocity | m per frame | m/s |
//! | 6-11 | root orientation, 6D | root to sequence frame | root to heading frame |
//! | 12-14 | root angular velocity | rad per frame | rad/s |
//! | 15-152 | joint rotations, 6D | joint to parent | joint to parent |
//! | 153-221 | joint positions | m | m, from the root joint |
//! | 222-290 | joint velocities | m per frame | m/s |
//! | 291-294 | contacts, 0 or 1 | squared step < 0.002 m² | < 0.25 m/s, < 5 cm over rest height |
//! | from 295 | offsets of [`JointSprings`] times ω, if any | m/s, joint's frame | m/s, joint's frame |
//!
//! Vectors of layout `Paper` are in the sequence frame, those of layout `Heading` in the heading
//! frame. Velocities are differences of world positions. The angular velocity is axis times angle
//! of R_t R_{t−1}ᵀ.
//!
//! [`MotionLayout::PaperRootRelative`] is the paper's layout with joint positions relative to the
//! root joint of their own frame and a root position of zero.
//!
//! The **sequence frame** is the frame of the root joint in the first frame of the sequence.
//! Vectors in it are invariant to a rigid motion of the whole sequence.
//!
//! The **heading frame** of frame t has its origin at the root joint and is turned about +Y by the
//! [`Heading`](crate::heading). Vectors in it are invariant to a rotation of the whole sequence
//! about the vertical, to horizontal translation, and to vertical translation together with the
//! ground.
//!
//! [`MotionState`] makes the vectors, one frame at a time.

mod frame;
mod normalisation;
mod springs;
mod state;
#[cfg(test)]
mod tests;

pub use frame::{CONTACT_HEIGHT_M, CONTACT_SPEED_M_S, PAPER_CONTACT_STEP_SQUARED_M2};
pub use normalisation::{Normalisation, NormalisationRule, NormalisedElements, ROUNDING_STD};
pub use springs::{DAMPING_RATIOS, FREQUENCIES_HZ, JointSprings, Spring, SpringDamping};
pub use state::{MotionInput, MotionState};

use crate::{character::Character, skeleton::Skeleton};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use thiserror::Error;

/// Coordinate frame and units of the motion vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionLayout {
    /// Published layout: sequence frame, units per frame.
    Paper,
    /// Published layout with positions relative to the root joint of the same frame. They stay
    /// within the range of training on a walk of any length.
    PaperRootRelative,
    /// Heading frame, SI units.
    Heading,
}

/// Direction of the finite differences that velocities, angular velocity and contacts are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VelocityScheme {
    /// Forward difference x_{t+1} − x_t, as in the authors' release; costs a frame of latency.
    /// Where the next pose is not known (live input, the last frame), the backward difference
    /// replaces it.
    Forward,
    /// Backward difference x_t − x_{t−1}; v_0 is v_1.
    Backward,
}

/// Definition of the motion vector that a model reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Coordinate frame and units.
    pub layout: MotionLayout,
    /// Direction of finite differences.
    pub velocity: VelocityScheme,
    /// Joints whose contact with the ground is detected: left ankle, left foot, right ankle, right
    /// foot.
    pub contact_joints: [usize; 4],
    /// Heights of the contact joints above the soles in the bind pose, metres. The paper's layouts
    /// do not read them.
    pub contact_rest_heights_m: [f32; 4],
    /// Springs whose offsets the vector holds. The published method has none.
    #[serde(default, skip_serializing_if = "JointSprings::is_empty")]
    pub springs: JointSprings,
}

impl MotionSpec {
    /// Makes the definition for a character that stands on its lowest vertex in the bind pose.
    ///
    /// The contact joints' heights are measured from the body's mesh. Joints lie 2 to 8 cm above
    /// the soles, as much as the tolerance of a contact, so that the skeleton alone does not give
    /// them.
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
        // A character without a body stands on its lowest joint.
        let lowest_joint = || joints.iter().map(|j| j.y).fold(f32::INFINITY, f32::min);
        let ground = soles.unwrap_or_else(lowest_joint);
        Ok(Self {
            layout,
            velocity,
            contact_joints,
            contact_rest_heights_m: contact_joints.map(|j| joints[j].y - ground),
            springs: JointSprings::default(),
        })
    }

    /// Length of the motion vector of a skeleton with this many joints, the root included:
    /// [`motion_len`] and the numbers of the springs.
    pub fn len(&self, joints: usize) -> usize {
        motion_len(joints) + self.springs.numbers()
    }

    /// Checks a definition that comes from a file.
    ///
    /// # Errors
    /// Contact joints or joints of springs that the skeleton does not have, rest heights that are
    /// not finite, springs out of range.
    pub fn check(&self, skeleton: &Skeleton) -> Result<(), MotionError> {
        check_contacts(self.contact_joints, skeleton.len())?;
        self.springs.check(skeleton)?;
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

/// Error: an unusable motion specification, state or normalisation.
#[derive(Debug, Error, PartialEq)]
pub enum MotionError {
    /// A contact joint that the skeleton does not have.
    #[error("motion: contact joint {joint} is not among the {joints} joints")]
    ContactJoint {
        /// Index of the contact joint.
        joint: usize,
        /// Number of joints of the skeleton.
        joints: usize,
    },
    /// A joint with springs that the skeleton does not have.
    #[error("motion: joint {joint} of a spring is not among the {joints} joints")]
    SpringJoint {
        /// Index of the joint.
        joint: usize,
        /// Number of joints of the skeleton.
        joints: usize,
    },
    /// A spring out of range.
    #[error(
        "motion: expected springs of {FREQUENCIES_HZ:?} Hz with damping ratios of {DAMPING_RATIOS:?}, found \
         {frequency_hz} Hz and {damping_ratio}"
    )]
    Spring {
        /// Natural frequency, Hz.
        frequency_hz: f32,
        /// Damping ratio.
        damping_ratio: f32,
    },
    /// An array of another length.
    #[error("motion: expected {expected} numbers in {what}, found {found}")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Length for this skeleton.
        expected: usize,
        /// Length of the array.
        found: usize,
    },
    /// A number that is NaN or infinite, or a standard deviation that is not above zero.
    #[error("motion: {what} {element} is not a usable number")]
    NotFinite {
        /// Name of the array.
        what: &'static str,
        /// Index in the array.
        element: usize,
    },
}

/// Length of the motion vector of a skeleton with J joints, the root included, without springs:
/// 12 J + 7. [`MotionSpec::len`] counts the springs too.
pub fn motion_len(joints: usize) -> usize {
    12 * joints + 7
}

/// Ranges of the parts of the motion vector before the springs.
///
/// ```
/// use unic_core::motion::{MotionSlices, motion_len};
/// let slices = MotionSlices::new(24);
/// assert_eq!(slices.joint_positions, 153..222);
/// assert_eq!(slices.contacts.end, motion_len(24));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionSlices {
    /// Position of the root, 3 numbers.
    pub root_position: Range<usize>,
    /// Velocity of the root, 3 numbers.
    pub root_velocity: Range<usize>,
    /// Orientation of the root, 6 numbers.
    pub root_orientation: Range<usize>,
    /// Angular velocity of the root, 3 numbers.
    pub root_angular_velocity: Range<usize>,
    /// Rotations of the joints other than the root, 6 numbers each.
    pub joint_rotations: Range<usize>,
    /// Positions of the joints other than the root, 3 numbers each.
    pub joint_positions: Range<usize>,
    /// Velocities of the joints other than the root, 3 numbers each.
    pub joint_velocities: Range<usize>,
    /// Contacts with the ground, 4 numbers.
    pub contacts: Range<usize>,
}

impl MotionSlices {
    /// Returns the ranges for a skeleton with this many joints, the root included.
    pub fn new(joints: usize) -> Self {
        let local = joints.saturating_sub(1);
        let mut end = 0;
        // Ranges follow each other in the order of the fields below.
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

    /// Lists the ranges of [`NormalisedElements::PositionsAndVelocities`]: 0-5, 12-14 and 153-290
    /// for 24 joints.
    ///
    /// Rotations and contacts are of order one without scaling.
    pub fn normalised(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        [
            self.root_position.start..self.root_velocity.end,
            self.root_angular_velocity.clone(),
            self.joint_positions.start..self.joint_velocities.end,
        ]
        .into_iter()
    }
}
