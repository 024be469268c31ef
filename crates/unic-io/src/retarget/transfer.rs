//! Converting poses of one skeleton to poses of another.

use super::rig::{Landmarks, ReferenceRig};
use crate::{
    bvh::Bvh,
    error::Result,
    joint_names::{BodySide, LimbJoint},
};
use glam::{Quat, Vec3};
use unic_core::{Pose, leg::shortest_arc, skeleton::Skeleton, transform::Rigid};

/// Source of a target joint's world rotation.
#[derive(Clone, Copy, Debug)]
enum JointRotation {
    /// The joint moves rigidly with its parent.
    FollowParent,
    /// The joint copies the rotation of the source relative to its reference pose, interpolated
    /// between two source joints.
    Copy {
        /// Source joint at `share` 0.
        from: usize,
        /// Source joint at `share` 1.
        to: usize,
        /// Interpolation parameter, 0 to 1.
        share: f32,
        /// Rotation `source_reference_from_target_reference`, which aligns the target's bone with
        /// the source's.
        align: Quat,
    },
}

/// Conversion of poses from one skeleton to another.
#[derive(Clone, Debug)]
pub(super) struct Transfer<'a> {
    skeleton: &'a Skeleton,
    source: &'a ReferenceRig,
    target: &'a ReferenceRig,
    /// Source of each target joint's rotation.
    links: Vec<JointRotation>,
    /// Target joints, parents before children.
    order: Vec<usize>,
    /// Length in metres of one unit of the source, on the target.
    pub(super) scale: f32,
    /// Rotation `world_from_source`, to Y up.
    pub(super) world_from_source: Quat,
}

impl<'a> Transfer<'a> {
    /// Prepares the conversion. Lengths are scaled by the ratio of the legs.
    pub(super) fn new(
        skeleton: &'a Skeleton,
        source: &'a ReferenceRig,
        target: &'a ReferenceRig,
        world_from_source: Quat,
    ) -> Self {
        Self {
            skeleton,
            source,
            target,
            links: links(skeleton.len(), source, target),
            order: by_depth(skeleton),
            scale: target.leg_length() / source.leg_length(),
            world_from_source,
        }
    }

    /// Converts one frame of a file; `scratch` is reused between frames.
    ///
    /// # Errors
    /// A source without a required joint.
    pub(super) fn pose(&self, bvh: &Bvh, frame: usize, scratch: &mut Vec<Rigid>) -> Result<Pose> {
        bvh.world_from_joint(frame, scratch);
        let middle = Landmarks::new(&self.source.bones, scratch)?.hip_middle();
        let mut world = vec![Quat::IDENTITY; self.links.len()];
        let mut local = vec![Quat::IDENTITY; self.links.len()];
        for &joint in &self.order {
            let parent = self.skeleton.parents()[joint].map_or(Quat::IDENTITY, |p| world[p]);
            world[joint] = self.rotation(joint, scratch).unwrap_or(parent);
            // Normalised, because rounding of the products accumulates along a chain.
            local[joint] = (parent.inverse() * world[joint]).normalize();
        }
        let root = self.skeleton.root();
        let trans = self.root_position(middle, world[root]) - self.skeleton.joints()[root];
        Ok(Pose { trans, local })
    }

    /// Returns the world rotation of a target joint; `None` if it follows its parent.
    fn rotation(&self, joint: usize, source: &[Rigid]) -> Option<Quat> {
        let JointRotation::Copy {
            from,
            to,
            share,
            align,
        } = self.links[joint]
        else {
            return None;
        };
        let turned = |j: usize| source[j].rotation * self.source.reference[j].rotation.inverse();
        // `share` is 0 unless spines have different lengths; slerp then returns the first rotation.
        let turned = turned(from).slerp(turned(to), share);
        Some(self.world_from_source * turned * align * self.target.reference[joint].rotation)
    }

    /// Returns the world position of the root joint that puts the midpoint of the hips at `middle`,
    /// a position of the source.
    ///
    /// Hips correspond between skeletons. Pelvis joints lie anywhere above them.
    fn root_position(&self, middle: Vec3, root: Quat) -> Vec3 {
        let reference = &self.target.reference;
        let hips = [BodySide::Left, BodySide::Right].map(|side| {
            let hip = self.target.bones.limb(LimbJoint::Hip, side);
            hip.map_or(Vec3::ZERO, |j| reference[j].translation)
        });
        let pelvis = reference[self.skeleton.root()];
        let below = 0.5 * (hips[0] + hips[1]) - pelvis.translation;
        let turn = root * pelvis.rotation.inverse();
        self.world_from_source * middle * self.scale - turn * below
    }
}

/// Assigns a source to the rotation of each target joint.
fn links(joints: usize, source: &ReferenceRig, target: &ReferenceRig) -> Vec<JointRotation> {
    let mut links = vec![JointRotation::FollowParent; joints];
    // Both bodies stand in their reference poses: pelvis, trunk, collars and feet correspond
    // without alignment of their bones.
    let upright = source.facing * target.facing.inverse();
    let copy = |joint: usize, align: Quat| JointRotation::Copy {
        from: joint,
        to: joint,
        share: 0.0,
        align,
    };
    links[target.bones.pelvis] = copy(source.bones.pelvis, upright);
    distribute(
        &mut links,
        source.bones.pelvis,
        &source.bones.spine,
        &target.bones.spine,
        upright,
    );
    if let Some(&chest) = source.bones.spine.last() {
        distribute(&mut links, chest, &source.bones.neck, &target.bones.neck, upright);
    }
    if let (Some(from), Some(to)) = (source.bones.head, target.bones.head) {
        links[to] = copy(from, upright);
    }
    for (part, side) in LimbJoint::ALL
        .into_iter()
        .flat_map(|p| BodySide::ALL.map(|s| (p, s)))
    {
        if let (Some(from), Some(to)) = (source.bones.limb(part, side), target.bones.limb(part, side)) {
            links[to] = copy(from, align(source, target, part, side, upright));
        }
    }
    links
}

/// Distributes the rotations of a chain of `source` joints, above the joint `base`, over a chain of
/// `target` joints of another length.
fn distribute(links: &mut [JointRotation], base: usize, source: &[usize], target: &[usize], align: Quat) {
    let at = |k: usize| k.checked_sub(1).map_or(base, |k| source[k]);
    for (i, &joint) in target.iter().enumerate() {
        // Position of the target joint in the source chain: the last joint of one chain copies the
        // last of the other, and the base is position 0.
        let along = ((i + 1) * source.len()) as f32 / target.len() as f32;
        let before = (along.floor() as usize).min(source.len());
        links[joint] = JointRotation::Copy {
            from: at(before),
            to: at((before + 1).min(source.len())),
            share: along - before as f32,
            align,
        };
    }
}

/// Returns the rotation that aligns a target bone with the source's in the reference poses.
///
/// Arms and legs are aligned, because rest poses differ there (T, A, arms down). The smallest
/// rotation between the bones keeps palms and knees where lowering an arm or closing the legs puts
/// them. A hand is aligned like its forearm. All other bones keep `upright`.
fn align(
    source: &ReferenceRig,
    target: &ReferenceRig,
    part: LimbJoint,
    side: BodySide,
    upright: Quat,
) -> Quat {
    let (from, to) = match part {
        LimbJoint::Hip => (LimbJoint::Hip, LimbJoint::Knee),
        LimbJoint::Knee => (LimbJoint::Knee, LimbJoint::Ankle),
        LimbJoint::Shoulder => (LimbJoint::Shoulder, LimbJoint::Elbow),
        LimbJoint::Elbow | LimbJoint::Wrist | LimbJoint::Hand => (LimbJoint::Elbow, LimbJoint::Wrist),
        LimbJoint::Ankle | LimbJoint::Toe | LimbJoint::Collar => return upright,
    };
    let has = |rig: &ReferenceRig| rig.bones.limb(to, side).is_some();
    if !has(source) || !has(target) {
        return upright;
    }
    let target = upright * target.direction(from, to, side);
    shortest_arc(target, source.direction(from, to, side)) * upright
}

/// Returns the joints in breadth-first order: parents before children.
fn by_depth(skeleton: &Skeleton) -> Vec<usize> {
    let mut order = vec![skeleton.root()];
    let mut next = 0;
    while let Some(&parent) = order.get(next) {
        // Quadratic in the number of joints, once for each import.
        order.extend((0..skeleton.len()).filter(|&j| skeleton.parents()[j] == Some(parent)));
        next += 1;
    }
    order
}
