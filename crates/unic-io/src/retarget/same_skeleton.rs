//! Motion whose joints are those of the character: its rotations are taken as they are.

use crate::joint_names::is_same_joint;
use glam::{Quat, Vec3};
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Distance between joints of the file and of the character, relative to the root, up to which both
/// are one skeleton, metres.
const SAME_M: f32 = 2e-3;

/// A joint of a file in its reference pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceJoint<'a> {
    pub(crate) name: &'a str,
    /// Place in the unit of the file, Y up.
    pub(crate) place: Vec3,
}

/// Unit of a file's places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileUnit {
    /// Metres.
    Metres,
    /// A unit that the character's size tells.
    Unknown,
}

/// The joints of a file that are those of a character.
#[derive(Clone, Debug)]
pub(crate) struct SameSkeleton<'a> {
    skeleton: &'a Skeleton,
    /// Joint of the file for each joint of the character.
    sources: Vec<usize>,
    /// `world_from_joint` of the character in the reference pose.
    reference: Vec<Rigid>,
    /// Metres in a unit of the file.
    pub(crate) metres_per_unit: f32,
}

impl<'a> SameSkeleton<'a> {
    /// Compares the joints of a file with those of a character, of which `reference` is the pose that
    /// belongs to the file's reference pose. `None` if they differ. Joints without children may be
    /// missing in the file: they follow their parents.
    pub(crate) fn find(
        joints: &[ReferenceJoint<'_>],
        unit: FileUnit,
        skeleton: &'a Skeleton,
        reference: &Pose,
    ) -> Option<Self> {
        let mut world = Vec::new();
        skeleton.forward_kinematics(reference, &mut world);
        let found: Vec<Option<usize>> = skeleton.names().iter().map(|name| find(joints, name)).collect();
        let root = skeleton.root();
        let origin = joints[found[root]?].place;
        // Places relative to the root, in the file and on the character.
        let pair = |joint: usize| {
            let own = world[joint].translation - world[root].translation;
            found[joint].map(|source| (joints[source].place - origin, own))
        };
        let pairs: Vec<Option<(Vec3, Vec3)>> = (0..skeleton.len()).map(pair).collect();
        let metres_per_unit = match unit {
            FileUnit::Metres => 1.0,
            FileUnit::Unknown => ratio(pairs.iter().flatten())?,
        };
        let is_near = |(file, own): &(Vec3, Vec3)| (metres_per_unit * *file - *own).length() < SAME_M;
        let has_children = |joint: usize| skeleton.parents().contains(&Some(joint));
        let mut sources = Vec::new();
        for (joint, pair) in pairs.iter().enumerate() {
            sources.push(match (pair, found[joint]) {
                (Some(pair), Some(source)) => is_near(pair).then_some(source)?,
                _ if has_children(joint) => return None,
                _ => found[skeleton.parents()[joint]?]?,
            });
        }
        Some(Self {
            skeleton,
            sources,
            reference: world,
            metres_per_unit,
        })
    }

    /// Pose of the character in a frame: for each joint of the file its rotation from the reference pose
    /// and its position, Y up.
    pub(crate) fn pose(&self, frame: &[Rigid]) -> Pose {
        let skeleton = self.skeleton;
        let global: Vec<Quat> = (self.sources.iter().zip(&self.reference))
            .map(|(source, reference)| frame[*source].rotation * reference.rotation)
            .collect();
        let local = |joint: usize| match skeleton.parents()[joint] {
            Some(parent) => (global[parent].inverse() * global[joint]).normalize(),
            None => global[joint],
        };
        let root = skeleton.root();
        let place = self.metres_per_unit * frame[self.sources[root]].translation;
        Pose {
            trans: place - skeleton.joints()[root],
            local: (0..skeleton.len()).map(local).collect(),
        }
    }

    /// Joints of the character that the file has itself, with their places in a frame, metres.
    pub(crate) fn places<'b>(
        &'b self,
        joints: &'b [ReferenceJoint<'_>],
        frame: &'b [Rigid],
    ) -> impl Iterator<Item = (usize, Vec3)> + 'b {
        let sources = self.sources.iter().enumerate();
        let own = sources.filter(|(joint, source)| joints[**source].name == self.skeleton.names()[*joint]);
        own.map(|(joint, source)| (joint, self.metres_per_unit * frame[*source].translation))
    }
}

fn find(joints: &[ReferenceJoint<'_>], name: &str) -> Option<usize> {
    let same = joints.iter().position(|joint| joint.name == name);
    same.or_else(|| joints.iter().position(|joint| is_same_joint(joint.name, name)))
}

/// Factor from the first places of pairs to the second ones, by least squares.
fn ratio<'p>(pairs: impl Iterator<Item = &'p (Vec3, Vec3)>) -> Option<f32> {
    let (product, square) = pairs.fold((0.0, 0.0), |(product, square), (file, own)| {
        (product + file.dot(*own), square + file.length_squared())
    });
    let ratio = product / square;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}
