//! A motion from one skeleton to another.

use super::{
    names::{Part, Side},
    rig::{Landmarks, Rig},
};
use crate::{bvh::Bvh, error::Result};
use glam::{Quat, Vec3};
use unic_core::{
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// Where a target joint's world rotation comes from.
#[derive(Clone, Copy, Debug)]
enum Link {
    /// Moves with its parent.
    Free,
    /// The source's rotation away from its reference pose, between two of its joints.
    Turn {
        /// Source joint at `share` 0.
        from: usize,
        /// Source joint at `share` 1.
        to: usize,
        share: f32,
        /// `source_reference_from_target_reference`: lays the target's bone along the source's.
        align: Quat,
    },
}

/// How poses of one skeleton become poses of another.
#[derive(Clone, Debug)]
pub(super) struct Transfer<'a> {
    skeleton: &'a Skeleton,
    source: &'a Rig,
    target: &'a Rig,
    links: Vec<Link>,
    /// Target joints, parents before children.
    order: Vec<usize>,
    /// Metres of the target a unit of the source.
    pub(super) scale: f32,
    /// `world_from_source`: Y up.
    pub(super) world_from_source: Quat,
}

impl<'a> Transfer<'a> {
    /// Lengths are scaled by the ratio of the legs.
    pub(super) fn new(
        skeleton: &'a Skeleton,
        source: &'a Rig,
        target: &'a Rig,
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

    /// One frame.
    pub(super) fn pose(&self, bvh: &Bvh, frame: usize, scratch: &mut Vec<Rigid>) -> Result<Pose> {
        bvh.world_from_joint(frame, scratch);
        let middle = Landmarks::new(&self.source.bones, scratch)?.hip_middle();
        let mut world = vec![Quat::IDENTITY; self.links.len()];
        let mut local = vec![Quat::IDENTITY; self.links.len()];
        for &joint in &self.order {
            let parent = self.skeleton.parents()[joint].map_or(Quat::IDENTITY, |p| world[p]);
            world[joint] = self.rotation(joint, scratch).unwrap_or(parent);
            local[joint] = (parent.inverse() * world[joint]).normalize();
        }
        let root = self.skeleton.root();
        let trans = self.root_position(middle, world[root]) - self.skeleton.joints()[root];
        Ok(Pose { trans, local })
    }

    fn rotation(&self, joint: usize, source: &[Rigid]) -> Option<Quat> {
        let Link::Turn {
            from,
            to,
            share,
            align,
        } = self.links[joint]
        else {
            return None;
        };
        let turned = |j: usize| source[j].rotation * self.source.reference[j].rotation.inverse();
        let turned = turned(from).slerp(turned(to), share);
        Some(self.world_from_source * turned * align * self.target.reference[joint].rotation)
    }

    /// The hips' midpoint follows the source's: pelvis joints lie anywhere above it.
    fn root_position(&self, middle: Vec3, root: Quat) -> Vec3 {
        let reference = &self.target.reference;
        let hips = [Side::Left, Side::Right].map(|side| {
            let hip = self.target.bones.limb(Part::Hip, side);
            hip.map_or(Vec3::ZERO, |j| reference[j].translation)
        });
        let pelvis = reference[self.skeleton.root()];
        let below = 0.5 * (hips[0] + hips[1]) - pelvis.translation;
        let turn = root * pelvis.rotation.inverse();
        self.world_from_source * middle * self.scale - turn * below
    }
}

fn links(joints: usize, source: &Rig, target: &Rig) -> Vec<Link> {
    let mut links = vec![Link::Free; joints];
    // Both bodies stand in their reference poses: pelvis, trunk, collars and feet correspond as
    // they are, whatever the shape of the bones there.
    let upright = source.facing * target.facing.inverse();
    let turn = |joint: usize, align: Quat| Link::Turn {
        from: joint,
        to: joint,
        share: 0.0,
        align,
    };
    links[target.bones.pelvis] = turn(source.bones.pelvis, upright);
    distribute(
        &mut links,
        (&source.bones.spine, &target.bones.spine),
        source.bones.pelvis,
        upright,
    );
    if let Some(&chest) = source.bones.spine.last() {
        distribute(
            &mut links,
            (&source.bones.neck, &target.bones.neck),
            chest,
            upright,
        );
    }
    if let (Some(from), Some(to)) = (source.bones.head, target.bones.head) {
        links[to] = turn(from, upright);
    }
    for (part, side) in Part::ALL.into_iter().flat_map(|p| Side::ALL.map(|s| (p, s))) {
        if let (Some(from), Some(to)) = (source.bones.limb(part, side), target.bones.limb(part, side)) {
            links[to] = turn(from, align(source, target, part, side, upright));
        }
    }
    links
}

/// Rotations of a chain of `source` joints (above `base`) on a chain of another length.
fn distribute(links: &mut [Link], (source, target): (&[usize], &[usize]), base: usize, align: Quat) {
    let at = |k: usize| k.checked_sub(1).map_or(base, |k| source[k]);
    for (i, &joint) in target.iter().enumerate() {
        let along = ((i + 1) * source.len()) as f32 / target.len() as f32;
        let before = (along.floor() as usize).min(source.len());
        links[joint] = Link::Turn {
            from: at(before),
            to: at((before + 1).min(source.len())),
            share: along - before as f32,
            align,
        };
    }
}

/// Arms and legs point where the source's do: rest poses differ there (T, A, arms down). The
/// smallest rotation that lays one bone along the other keeps palms and knees where lowering an
/// arm or closing the legs puts them. A hand goes with its forearm.
fn align(source: &Rig, target: &Rig, part: Part, side: Side, upright: Quat) -> Quat {
    let (from, to) = match part {
        Part::Hip => (Part::Hip, Part::Knee),
        Part::Knee => (Part::Knee, Part::Ankle),
        Part::Shoulder => (Part::Shoulder, Part::Elbow),
        Part::Elbow | Part::Wrist | Part::Hand => (Part::Elbow, Part::Wrist),
        Part::Ankle | Part::Toe | Part::Collar => return upright,
    };
    let has = |rig: &Rig| rig.bones.limb(to, side).is_some();
    if !has(source) || !has(target) {
        return upright;
    }
    let target = upright * target.direction(from, to, side);
    swing(target, source.direction(from, to, side)) * upright
}

/// The smallest rotation from one unit vector to another.
pub(super) fn swing(from: Vec3, to: Vec3) -> Quat {
    Quat::from_rotation_arc(from.normalize_or(Vec3::Y), to.normalize_or(Vec3::Y))
}

fn by_depth(skeleton: &Skeleton) -> Vec<usize> {
    let mut order = vec![skeleton.root()];
    let mut next = 0;
    while let Some(&parent) = order.get(next) {
        order.extend((0..skeleton.len()).filter(|&j| skeleton.parents()[j] == Some(parent)));
        next += 1;
    }
    order
}
