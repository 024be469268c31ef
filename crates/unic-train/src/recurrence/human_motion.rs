//! The elements of a motion vector that all human skeletons have.

use std::array;
use unic_core::{
    motion::{MotionSlices, Normalisation, motion_len},
    skeleton::{SMPL_JOINT_NAMES, Skeleton},
};
use unic_io::smpl_joints;

/// Largest magnitude of a constant, as of the numbers in pretraining. A joint that a skeleton lacks
/// would otherwise count as one far from where it can be.
const MOST_OFFSET: f32 = 5.0;

/// Length of a leg from hip to ankle that elements are scaled to, metres.
const LEG_M: f32 = 0.8;

/// Joints of SMPL but for the pelvis.
const OTHERS: usize = SMPL_JOINT_NAMES.len() - 1;

/// Number of elements: height, velocity and angular velocity of the pelvis, positions and
/// velocities of the other joints.
pub(super) const ELEMENTS: usize = 1 + 3 + 3 + 6 * OTHERS;

/// Element of a motion vector that has a counterpart on every human skeleton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    /// Index in the skeleton's motion vector. None for a number that is always zero: the position of
    /// a joint that is the pelvis itself.
    pub(super) index: Option<usize>,
    /// Factor from the skeleton's size to that of the pretrained unit.
    pub(super) scale: f32,
}

/// Finds the elements in the motion vectors, in layout `Heading`, of a skeleton.
///
/// Joint rotations are left out, because the axes of joints differ between skeletons. Returns none
/// for a skeleton that is not recognised, or whose root is not its pelvis.
pub(super) fn human_elements(skeleton: &Skeleton) -> Option<[Element; ELEMENTS]> {
    let joints = smpl_joints(skeleton).filter(|joints| joints[0] == skeleton.root())?;
    let position = |smpl: usize| skeleton.joints()[joints[smpl]];
    // Hip 1, knee 4 and ankle 7 of the left leg.
    let leg = position(1).distance(position(4)) + position(4).distance(position(7));
    let scale = LEG_M / leg;
    if !scale.is_normal() {
        return None;
    }
    let slices = MotionSlices::new(skeleton.len());
    // Slices of joints leave the root out.
    let local = |smpl: usize| {
        let joint = joints[smpl];
        (joint != skeleton.root()).then(|| joint - usize::from(joint > skeleton.root()))
    };
    let element = |i: usize| -> (Option<usize>, f32) {
        match i {
            0 => (Some(slices.root_position.start + 1), scale),
            1..4 => (Some(slices.root_velocity.start + i - 1), scale),
            4..7 => (Some(slices.root_angular_velocity.start + i - 4), 1.0),
            _ => {
                let (joint, axis) = ((i - 7) / 3, (i - 7) % 3);
                let at = |start: usize, joint: usize| start + 3 * joint + axis;
                let index = match (joint < OTHERS, local(1 + joint % OTHERS)) {
                    (true, joint) => joint.map(|j| at(slices.joint_positions.start, j)),
                    (false, Some(joint)) => Some(at(slices.joint_velocities.start, joint)),
                    (false, None) => Some(slices.root_velocity.start + axis),
                };
                (index, scale)
            }
        }
    };
    Some(array::from_fn(|i| {
        let (index, scale) = element(i);
        Element { index, scale }
    }))
}

/// Affine map from a normalised number of a skeleton's motion vector to the number that the
/// pretrained unit reads: mean and standard deviation of the unit's own training.
pub(super) struct Rescaled {
    /// Factor of the skeleton's normalised number.
    pub(super) factor: f32,
    /// Constant.
    pub(super) offset: f32,
}

impl Element {
    /// The map for an element whose mean and standard deviation in pretraining were `mean` and
    /// `std`.
    pub(super) fn rescaled(self, normalisation: &Normalisation, mean: f32, std: f32) -> Rescaled {
        let [own_mean, own_std] = match self.index {
            Some(i) => [normalisation.mean[i], normalisation.std[i]],
            None => [0.0, 0.0],
        };
        Rescaled {
            factor: self.scale * own_std / std,
            offset: ((self.scale * own_mean - mean) / std).clamp(-MOST_OFFSET, MOST_OFFSET),
        }
    }
}

/// Returns a flag for each element of a motion vector: whether one of `elements` is there.
pub(super) fn kept(elements: &[Element], joints: usize) -> Vec<bool> {
    let mut kept = vec![false; motion_len(joints)];
    elements
        .iter()
        .filter_map(|e| e.index)
        .for_each(|i| kept[i] = true);
    kept
}
