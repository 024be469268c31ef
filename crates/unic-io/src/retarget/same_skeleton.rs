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

#[cfg(test)]
mod tests {
    use super::super::{on_same_skeleton, on_same_unnamed_skeleton};
    use crate::{
        bvh::{Bvh, RestJoint},
        up_axis::{UpAxis, y_up_from_z_up},
    };
    use glam::{Quat, Vec3};
    use std::path::Path;
    use unic_core::{clip::Clip, skeleton::Skeleton, transform::Rigid};
    use unic_testdata::{Figure, mixamo_clip};

    /// The motion of a skeleton as a file with the axes `file_from_world`, in units of `unit` metres.
    fn file(skeleton: &Skeleton, clip: &Clip, file_from_world: Quat, unit: f32) -> Bvh {
        let place = |p: Vec3| file_from_world * p / unit;
        let joint = |joint: usize| RestJoint {
            name: format!("bone.{joint:03}"),
            parent: skeleton.parents()[joint],
            position: place(skeleton.joints()[joint]),
        };
        let joints: Vec<RestJoint> = (0..skeleton.len()).map(joint).collect();
        let (mut world, mut frames) = (Vec::new(), Vec::new());
        for pose in &clip.poses {
            skeleton.forward_kinematics(pose, &mut world);
            for joint in &mut world {
                let turned = file_from_world * joint.rotation * file_from_world.inverse();
                *joint = Rigid::new(turned, place(joint.translation));
            }
            Bvh::push_frame(&joints, &world, &mut frames);
        }
        Bvh::from_rest(joints, clip.fps, frames)
    }

    /// A skeleton whose joints have names that say nothing.
    fn unnamed() -> (Skeleton, Clip) {
        let mut parts = Figure::mixamo().character.skeleton.to_parts();
        let names = (0..parts.joints.len()).map(|joint| format!("bone.{joint:03}"));
        parts.names = names.collect();
        (Skeleton::new(parts).unwrap(), mixamo_clip("walk", 0, 5))
    }

    fn assert_same(skeleton: &Skeleton, found: &Clip, expected: &Clip) {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for (found, expected) in found.poses.iter().zip(&expected.poses) {
            skeleton.forward_kinematics(found, &mut a);
            skeleton.forward_kinematics(expected, &mut b);
            let far = (a.iter().zip(&b)).map(|(a, b)| a.translation.distance(b.translation));
            assert!(far.fold(0.0, f32::max) < 1e-4);
        }
    }

    #[test]
    fn unnamed_joints_are_the_characters_in_any_unit_and_axis() {
        let (skeleton, clip) = unnamed();
        let path = Path::new("walk.bvh");
        for (turn, unit, notes) in [(Quat::IDENTITY, 0.01, 1), (y_up_from_z_up().inverse(), 0.0254, 2)] {
            let bvh = file(&skeleton, &clip, turn, unit);
            let taken = on_same_unnamed_skeleton(path, &bvh, UpAxis::Auto, &skeleton);
            let taken = taken.unwrap().unwrap();
            assert_same(&skeleton, &taken.clip, &clip);
            assert_eq!(taken.notes.len(), notes, "{:?}", taken.notes);
        }
        // The stated axis is the only one that is tried.
        let bvh = file(&skeleton, &clip, Quat::IDENTITY, 1.0);
        let taken = on_same_unnamed_skeleton(path, &bvh, UpAxis::Z, &skeleton).unwrap();
        assert!(taken.is_none());
    }

    #[test]
    fn a_longer_arm_or_a_missing_joint_is_another_skeleton() {
        let (skeleton, clip) = unnamed();
        let same = |changed: &Skeleton| {
            let bvh = file(&skeleton, &clip, Quat::IDENTITY, 1.0);
            let taken = on_same_skeleton("walk.bvh".as_ref(), &bvh, Quat::IDENTITY, changed);
            taken.unwrap().is_some()
        };
        assert!(same(&skeleton));
        let leaf = (0..skeleton.len())
            .find(|joint| !skeleton.parents().contains(&Some(*joint)))
            .unwrap();
        let mut parts = skeleton.to_parts();
        parts.joints[leaf].x += 0.01;
        assert!(!same(&Skeleton::new(parts).unwrap()));
        // A joint with children that the file has not.
        let mut parts = skeleton.to_parts();
        parts.names[1] = "another".into();
        assert!(!same(&Skeleton::new(parts).unwrap()));
        // One without children follows its parent.
        let mut parts = skeleton.to_parts();
        parts.names[leaf] = "another".into();
        assert!(same(&Skeleton::new(parts).unwrap()));
    }
}
