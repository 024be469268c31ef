//! Skeletons in the reference pose in which bone directions are compared.

use super::bones::{BodyJoints, BoneMap, JointTree};
use crate::{
    bvh::Bvh,
    error::Result,
    joint_names::{BodySide, LimbJoint},
};
use glam::{Mat3, Quat, Vec3};
use std::path::Path;
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Smallest cosine of the angles between trunk and legs and between shoulders and hips in a
/// standing pose: 37°.
const MIN_STANDING_COSINE: f32 = 0.8;

/// Smallest cosine of the angle at which a body's axis is taken to be a coordinate axis: 25°.
/// Bodies in rest poses are upright, but the line from hips to shoulders leans a little in all of
/// them.
const MIN_AXIS_COSINE: f32 = 0.9;

/// Number of frames that are searched for a standing pose.
const SAMPLED_FRAMES: usize = 500;

/// Origin of a reference pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReferenceOrigin {
    /// The pose with all rotations zero, in which the body stands.
    ZeroPose,
    /// The frame in which the body stands most upright with straight limbs.
    Frame(usize),
}

/// Joints by body part, in the reference pose.
#[derive(Clone, Debug)]
pub(super) struct ReferenceRig {
    pub(super) bones: BodyJoints,
    pub(super) origin: ReferenceOrigin,
    /// World transform of every joint in the reference pose.
    pub(super) reference: Vec<Rigid>,
    /// Rotation `reference_from_body`. In the body's frame +X is its left, +Y is up and +Z is
    /// forward.
    pub(super) facing: Quat,
}

impl ReferenceRig {
    /// Makes the rig of a character in its zero pose.
    pub(super) fn of_skeleton(skeleton: &Skeleton) -> Result<Self> {
        let tree = JointTree {
            path: Path::new("character"),
            names: skeleton.names().iter().map(String::as_str).collect(),
            parents: skeleton.parents().to_vec(),
        };
        let bones = BodyJoints::identify(&tree, &BoneMap::default())?;
        // The zero pose and not the bind pose: rotations of poses are relative to it.
        let zero = Pose::from_axis_angles(Vec3::ZERO, &vec![Vec3::ZERO; skeleton.len()]);
        let mut reference = Vec::new();
        skeleton.forward_kinematics(&zero, &mut reference);
        Self::new(bones, ReferenceOrigin::ZeroPose, reference, Vec3::Y)
    }

    /// Makes the rig of a file in its zero pose if the body stands in it, else in the frame with
    /// the best standing pose.
    ///
    /// `up` is the direction against gravity in the frames. In the zero pose of some rigs all bones
    /// point along one axis.
    pub(super) fn of_bvh(bvh: &Bvh, bones: BodyJoints, up: Vec3) -> Result<Self> {
        let mut reference = Vec::new();
        bvh.world_from_joint_at_zero(&mut reference);
        let body = Landmarks::new(&bones, &reference)?;
        if body.stands() {
            // A zero pose stands along an axis of the file; the trunk leans a few degrees from it.
            let up = along_axis(body.trunk());
            return Self::new(bones, ReferenceOrigin::ZeroPose, reference, up);
        }
        let frame = most_upright(bvh, &bones)?;
        bvh.world_from_joint(frame, &mut reference);
        Self::new(bones, ReferenceOrigin::Frame(frame), reference, up)
    }

    fn new(bones: BodyJoints, origin: ReferenceOrigin, reference: Vec<Rigid>, up: Vec3) -> Result<Self> {
        let left = Landmarks::new(&bones, &reference)?.hips();
        // Snapping to a coordinate axis may leave a part along `up`, which is removed again.
        let left = along_axis(left.reject_from_normalized(up));
        let left = left
            .reject_from_normalized(up)
            .normalize_or(up.any_orthonormal_vector());
        // Columns are the body's left, up and forward; left × up is forward in a right-handed
        // frame.
        let facing = Quat::from_mat3(&Mat3::from_cols(left, up, left.cross(up)));
        Ok(Self {
            bones,
            origin,
            reference,
            facing,
        })
    }

    /// Returns whether the body stands in the reference pose.
    pub(super) fn stands(&self) -> bool {
        Landmarks::new(&self.bones, &self.reference).is_ok_and(|body| body.stands())
    }

    /// Mean length of both legs from hip to ankle along the bones, in the rig's unit.
    pub(super) fn leg_length(&self) -> f32 {
        let length = |side: BodySide| {
            let [hip, knee, ankle] =
                [LimbJoint::Hip, LimbJoint::Knee, LimbJoint::Ankle].map(|p| self.position(p, side));
            hip.distance(knee) + knee.distance(ankle)
        };
        0.5 * (length(BodySide::Left) + length(BodySide::Right))
    }

    /// Direction of a bone in the reference pose, from one joint to the next.
    pub(super) fn direction(&self, from: LimbJoint, to: LimbJoint, side: BodySide) -> Vec3 {
        (self.position(to, side) - self.position(from, side)).normalize_or_zero()
    }

    /// Returns the position of a limb joint; zero for a missing one.
    fn position(&self, part: LimbJoint, side: BodySide) -> Vec3 {
        let joint = self.bones.limb(part, side);
        joint.map_or(Vec3::ZERO, |j| self.reference[j].translation)
    }
}

/// Joint positions from which the posture of a body is computed, in any unit.
pub(super) struct Landmarks {
    /// Left and right joint of hip, knee, ankle, shoulder and elbow.
    pairs: [[Vec3; 2]; 5],
}

impl Landmarks {
    pub(super) fn new(bones: &BodyJoints, world_from_joint: &[Rigid]) -> Result<Self> {
        let parts = [
            LimbJoint::Hip,
            LimbJoint::Knee,
            LimbJoint::Ankle,
            LimbJoint::Shoulder,
            LimbJoint::Elbow,
        ];
        let mut pairs = [[Vec3::ZERO; 2]; 5];
        for (pair, part) in pairs.iter_mut().zip(parts) {
            *pair = bones.pair(part)?.map(|j| world_from_joint[j].translation);
        }
        Ok(Self { pairs })
    }

    /// Midpoint of a pair, by its index in `pairs`.
    fn middle(&self, part: usize) -> Vec3 {
        0.5 * (self.pairs[part][0] + self.pairs[part][1])
    }

    /// Midpoint of the hips.
    pub(super) fn hip_middle(&self) -> Vec3 {
        self.middle(0)
    }

    /// Unit vector from the hips up to the shoulders.
    pub(super) fn trunk(&self) -> Vec3 {
        (self.middle(3) - self.middle(0)).normalize_or_zero()
    }

    /// Unit vector from the right hip to the left.
    fn hips(&self) -> Vec3 {
        (self.pairs[0][0] - self.pairs[0][1]).normalize_or_zero()
    }

    /// Returns whether the trunk is above the legs and the shoulders are above the hips.
    fn stands(&self) -> bool {
        self.standing() > MIN_STANDING_COSINE && self.level() > MIN_STANDING_COSINE
    }

    /// Cosine of the angle between trunk and legs.
    fn standing(&self) -> f32 {
        (self.middle(0) - self.middle(2))
            .normalize_or_zero()
            .dot(self.trunk())
    }

    /// Cosine of the angle between shoulders and hips.
    fn level(&self) -> f32 {
        let shoulders = self.pairs[3][0] - self.pairs[3][1];
        shoulders.normalize_or_zero().dot(self.hips())
    }

    /// Sum of the cosines at both knees.
    fn straightness(&self) -> f32 {
        let [hips, knees, ankles, ..] = self.pairs;
        let cosine = |s: usize| {
            let thigh = (knees[s] - hips[s]).normalize_or_zero();
            thigh.dot((ankles[s] - knees[s]).normalize_or_zero())
        };
        cosine(0) + cosine(1)
    }
}

/// Returns the coordinate axis, of either sign, near a direction, or the normalised direction if
/// none is near.
fn along_axis(direction: Vec3) -> Vec3 {
    let mut axes = Vec3::AXES.into_iter().flat_map(|a| [a, -a]);
    let near = |a: &Vec3| a.dot(direction.normalize_or_zero()) > MIN_AXIS_COSINE;
    axes.find(near).unwrap_or(direction).normalize_or(Vec3::Y)
}

/// Returns the frame in which the body stands most upright with straight legs.
fn most_upright(bvh: &Bvh, bones: &BodyJoints) -> Result<usize> {
    let stride = bvh.len().div_ceil(SAMPLED_FRAMES).max(1);
    let (mut best, mut best_score) = (0, f32::NEG_INFINITY);
    let mut world = Vec::new();
    for frame in (0..bvh.len()).step_by(stride) {
        bvh.world_from_joint(frame, &mut world);
        let body = Landmarks::new(bones, &world)?;
        // Four cosines of equal weight: trunk over legs, shoulders over hips, and both knees.
        let score = body.standing() + body.level() + body.straightness();
        if score > best_score {
            (best, best_score) = (frame, score);
        }
    }
    Ok(best)
}

/// Returns the direction of the trunk, from hips to shoulders, averaged over a file.
pub(super) fn mean_trunk(bvh: &Bvh, bones: &BodyJoints) -> Result<Vec3> {
    let stride = bvh.len().div_ceil(SAMPLED_FRAMES).max(1);
    let (mut sum, mut world) = (Vec3::ZERO, Vec::new());
    for frame in (0..bvh.len()).step_by(stride) {
        bvh.world_from_joint(frame, &mut world);
        // Unit vectors, so that a frame counts by its direction and not by a wrong scale.
        sum += Landmarks::new(bones, &world)?.trunk();
    }
    Ok(sum.normalize_or_zero())
}
