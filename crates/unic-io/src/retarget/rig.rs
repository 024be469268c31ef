//! A skeleton with its reference pose: what bone directions are compared in.

use super::{
    bones::{BoneMap, Bones, Tree},
    names::{Part, Side},
};
use crate::{bvh::Bvh, error::Result};
use glam::{Mat3, Quat, Vec3};
use std::path::Path;
use unic_core::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// Cosine of the angle between trunk and legs, and between shoulders and hips, in a pose that
/// stands: 37°.
const STANDS: f32 = 0.8;

/// Cosine of the angle up to which a body's axis is taken to be the coordinate axis: 25°. Rest
/// poses stand upright, and the way from hips to shoulders leans a little in all of them.
const ALONG_AXIS: f32 = 0.9;

/// Frames looked at for one that stands.
const FRAMES_LOOKED_AT: usize = 500;

/// Where a reference pose comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// All rotations zero: the body stands in it.
    ZeroPose,
    /// The frame in which the body stands most upright with straight limbs.
    Frame(usize),
}

/// Joints by meaning, and the reference pose.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    pub(super) bones: Bones,
    pub(super) origin: Origin,
    /// Every joint in the reference pose.
    pub(super) reference: Vec<Rigid>,
    /// `reference_from_body`: +X to the body's left, +Y up, +Z the way it faces.
    pub(super) facing: Quat,
}

impl Rig {
    /// Of a character: pose zero.
    pub(super) fn of_skeleton(skeleton: &Skeleton) -> Result<Self> {
        let tree = Tree {
            path: Path::new("character"),
            names: skeleton.names().iter().map(String::as_str).collect(),
            parents: skeleton.parents().to_vec(),
        };
        let bones = Bones::identify(&tree, &BoneMap::default())?;
        let zero = Pose::from_axis_angles(Vec3::ZERO, &vec![Vec3::ZERO; skeleton.len()]);
        let mut reference = Vec::new();
        skeleton.forward_kinematics(&zero, &mut reference);
        Self::new(bones, Origin::ZeroPose, reference, Vec3::Y)
    }

    /// Of a file: the zero pose if the body stands in it, else the frame that stands best, where
    /// `up` is the direction against gravity. Some rigs' zero pose lays every bone along one axis.
    pub(super) fn of_bvh(bvh: &Bvh, bones: Bones, up: Vec3) -> Result<Self> {
        let mut reference = Vec::new();
        bvh.world_from_joint_at_zero(&mut reference);
        let body = Landmarks::new(&bones, &reference)?;
        if body.standing() > STANDS && body.level() > STANDS {
            let up = along_axis(body.trunk());
            return Self::new(bones, Origin::ZeroPose, reference, up);
        }
        let frame = most_upright(bvh, &bones)?;
        bvh.world_from_joint(frame, &mut reference);
        Self::new(bones, Origin::Frame(frame), reference, up)
    }

    fn new(bones: Bones, origin: Origin, reference: Vec<Rigid>, up: Vec3) -> Result<Self> {
        let left = Landmarks::new(&bones, &reference)?.hips();
        let left = along_axis(left.reject_from_normalized(up));
        let left = left
            .reject_from_normalized(up)
            .normalize_or(up.any_orthonormal_vector());
        let facing = Quat::from_mat3(&Mat3::from_cols(left, up, left.cross(up)));
        Ok(Self {
            bones,
            origin,
            reference,
            facing,
        })
    }

    /// Mean length of both legs from hip to ankle along the bones, in the rig's unit.
    pub(super) fn leg_length(&self) -> f32 {
        let length = |side: Side| {
            let [hip, knee, ankle] = [Part::Hip, Part::Knee, Part::Ankle].map(|p| self.position(p, side));
            hip.distance(knee) + knee.distance(ankle)
        };
        0.5 * (length(Side::Left) + length(Side::Right))
    }

    /// Direction of a bone in the reference pose, from one joint to the next.
    pub(super) fn direction(&self, from: Part, to: Part, side: Side) -> Vec3 {
        (self.position(to, side) - self.position(from, side)).normalize_or_zero()
    }

    /// Zero for a joint that is not there.
    fn position(&self, part: Part, side: Side) -> Vec3 {
        let joint = self.bones.limb(part, side);
        joint.map_or(Vec3::ZERO, |j| self.reference[j].translation)
    }
}

/// Points that tell how a body stands, in any unit.
pub(super) struct Landmarks {
    /// Left and right of hip, knee, ankle, shoulder, elbow.
    pairs: [[Vec3; 2]; 5],
}

impl Landmarks {
    pub(super) fn new(bones: &Bones, world_from_joint: &[Rigid]) -> Result<Self> {
        let parts = [Part::Hip, Part::Knee, Part::Ankle, Part::Shoulder, Part::Elbow];
        let mut pairs = [[Vec3::ZERO; 2]; 5];
        for (pair, part) in pairs.iter_mut().zip(parts) {
            *pair = bones.pair(part)?.map(|j| world_from_joint[j].translation);
        }
        Ok(Self { pairs })
    }

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

/// The coordinate axis, of either sign, next to a unit vector; the vector itself where none is near.
fn along_axis(direction: Vec3) -> Vec3 {
    let mut axes = Vec3::AXES.into_iter().flat_map(|a| [a, -a]);
    let near = |a: &Vec3| a.dot(direction.normalize_or_zero()) > ALONG_AXIS;
    axes.find(near).unwrap_or(direction).normalize_or(Vec3::Y)
}

fn most_upright(bvh: &Bvh, bones: &Bones) -> Result<usize> {
    let stride = bvh.len().div_ceil(FRAMES_LOOKED_AT).max(1);
    let (mut best, mut best_score) = (0, f32::NEG_INFINITY);
    let mut world = Vec::new();
    for frame in (0..bvh.len()).step_by(stride) {
        bvh.world_from_joint(frame, &mut world);
        let body = Landmarks::new(bones, &world)?;
        let score = body.standing() + body.level() + body.straightness();
        if score > best_score {
            (best, best_score) = (frame, score);
        }
    }
    Ok(best)
}

/// Mean unit vector from the hips to the shoulders over a file.
pub(super) fn mean_trunk(bvh: &Bvh, bones: &Bones) -> Result<Vec3> {
    let stride = bvh.len().div_ceil(FRAMES_LOOKED_AT).max(1);
    let (mut sum, mut world) = (Vec3::ZERO, Vec::new());
    for frame in (0..bvh.len()).step_by(stride) {
        bvh.world_from_joint(frame, &mut world);
        sum += Landmarks::new(bones, &world)?.trunk();
    }
    Ok(sum.normalize_or_zero())
}
