//! The bones of a skeleton that are the joints of a model.

use glam::{Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use thiserror::Error;
use unic_core::{Pose, skeleton::Skeleton, transform::Rigid};

/// Largest distance between a bone and the joint of the model in the rest pose, metres.
const SAME_M: f32 = 0.02;

/// Error of a rig that does not wear the garments of a model.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RigError {
    /// Joints of the model that the rig has not.
    #[error("expected the joints {}, found none of these names in the skeleton", .0.join(", "))]
    Joints(Vec<String>),
    /// A rig in another rest pose or of another body.
    #[error("expected the rest pose of the model, found the joint {joint} {distance_m:.2} m away")]
    RestPose {
        /// Name of the joint that is farthest away.
        joint: String,
        /// Its distance, metres, in the size of the model.
        distance_m: f32,
    },
}

/// A bone of a skeleton.
#[derive(Clone, Debug)]
pub struct Bone {
    /// Name in the engine, which writes `_` for the colon of a namespace.
    pub name: String,
    /// From the bone's space to that of the skeleton, in the rest pose.
    pub skeleton_from_bone: Rigid,
}

/// The joints of a model on a rig.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Bone for each joint of the model; none for a tip that the rig has not.
    joints: Vec<Option<JointSource>>,
    /// Global rotations of the model's bind pose.
    rest_from_joint: Vec<Quat>,
}

/// A bone that moves a joint of the model.
#[derive(Clone, Copy, Debug)]
struct JointSource {
    bone: usize,
    /// Rotation from the model's rest pose to the space of the bone in the rest pose.
    bone_from_rest: Quat,
}

impl Rig {
    /// Finds the joints of a model by their names, in capitals or not, with a namespace or without.
    ///
    /// # Errors
    /// Joints that are missing, unless they are tips; a rig in another rest pose.
    pub fn new(skeleton: &Skeleton, bones: &[Bone]) -> Result<Self, RigError> {
        let found = find_joints(skeleton, bones);
        let has_children = |joint: usize| skeleton.parents().contains(&Some(joint));
        let missing = (0..skeleton.len()).filter(|&joint| found[joint].is_none() && has_children(joint));
        let missing: Vec<String> = missing.map(|joint| skeleton.names()[joint].clone()).collect();
        if !missing.is_empty() {
            return Err(RigError::Joints(missing));
        }
        let skeleton_from_rest = skeleton_from_rest(skeleton, bones, &found)?;
        let source = |bone: usize| JointSource {
            bone,
            bone_from_rest: bones[bone].skeleton_from_bone.rotation.inverse() * skeleton_from_rest,
        };
        let mut bind = Vec::new();
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
        Ok(Self {
            joints: found.into_iter().map(|bone| bone.map(source)).collect(),
            rest_from_joint: bind.iter().map(|joint| joint.rotation).collect(),
        })
    }

    /// Bone for each joint of the model; none for a tip that the rig has not.
    pub fn bones(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.joints.iter().map(|joint| joint.map(|source| source.bone))
    }

    /// Writes the pose of the model for a rig in the world. Returns the size of the character in the
    /// world, 1 for that of the model; none if the bones of the rig are in one place.
    ///
    /// `world_from_bone` has one transform for each joint of the model, in metres; those of joints
    /// that the rig has not are ignored. Positions of the pose are divided by the size.
    pub fn pose(&self, skeleton: &Skeleton, world_from_bone: &[Rigid], out: &mut Pose) -> Option<f32> {
        let global = |joint: usize| {
            let source = self.joints[joint]?;
            let from_rest = world_from_bone[joint].rotation * source.bone_from_rest;
            Some(from_rest * self.rest_from_joint[joint])
        };
        for (joint, local) in out.local.iter_mut().enumerate() {
            let parent = skeleton.parents()[joint];
            *local = match (self.joints[joint], parent) {
                (Some(_), None) => global(joint)?,
                (Some(_), Some(parent)) => global(parent)?.inverse() * global(joint)?,
                // A tip that the rig has not stays as in the bind pose.
                (None, Some(parent)) => self.rest_from_joint[parent].inverse() * self.rest_from_joint[joint],
                (None, None) => self.rest_from_joint[joint],
            }
            .normalize();
        }
        let size = self.size(skeleton, world_from_bone)?;
        let root = skeleton.root();
        out.trans = world_from_bone[root].translation / size - skeleton.joints()[root];
        Some(size)
    }

    /// Size of the character in the world, by the lengths of its bones.
    fn size(&self, skeleton: &Skeleton, world_from_bone: &[Rigid]) -> Option<f32> {
        let place = |joint: usize| world_from_bone[joint].translation;
        let (mut world, mut model) = (0.0, 0.0);
        for (joint, parent) in skeleton.parents().iter().enumerate() {
            if let (Some(parent), Some(_)) = (*parent, self.joints[joint]) {
                world += place(joint).distance(place(parent));
                model += skeleton.joints()[joint].distance(skeleton.joints()[parent]);
            }
        }
        (model > 0.0 && world > 0.0).then_some(world / model)
    }
}

/// Finds the bone of each joint. One namespace holds for all joints: the one that finds most of them.
fn find_joints(skeleton: &Skeleton, bones: &[Bone]) -> Vec<Option<usize>> {
    let names: Vec<String> = bones.iter().map(|bone| plain(&bone.name)).collect();
    let root = plain(&skeleton.names()[skeleton.root()]);
    let namespaces = (names.iter())
        .filter_map(|name| name.strip_suffix(&root))
        .filter(|before| before.is_empty() || before.ends_with('_'));
    let with = |namespace: &str| -> Vec<Option<usize>> {
        let find = |joint: &String| {
            let exact = bones.iter().position(|bone| bone.name == *joint);
            let name = format!("{namespace}{}", plain(joint));
            exact.or_else(|| names.iter().position(|other| *other == name))
        };
        skeleton.names().iter().map(find).collect()
    };
    let count = |found: &Vec<Option<usize>>| found.iter().flatten().count();
    // `max_by_key` keeps the last of equals, which here is the one without a namespace.
    let found = namespaces.chain([""]).map(with);
    found.max_by_key(count).unwrap_or_default()
}

/// Name without capitals and without what stands before a colon.
fn plain(name: &str) -> String {
    name.rsplit(':').next().unwrap_or_default().to_lowercase()
}

/// Rotation from the model's rest pose to the space of the skeleton, in Y up or Z up.
///
/// # Errors
/// Bones at other places than the model's joints.
fn skeleton_from_rest(
    skeleton: &Skeleton,
    bones: &[Bone],
    found: &[Option<usize>],
) -> Result<Quat, RigError> {
    let root = skeleton.root();
    let own = |joint: usize| skeleton.joints()[joint] - skeleton.joints()[root];
    let place = |bone: usize| bones[bone].skeleton_from_bone.translation;
    // The root has been found: it has children.
    let origin = found[root].map_or(Vec3::ZERO, place);
    let pairs: Vec<(usize, Vec3, Vec3)> = (found.iter().enumerate())
        .filter_map(|(joint, bone)| Some((joint, place((*bone)?) - origin, own(joint))))
        .collect();
    let lengths = |of: fn(&(usize, Vec3, Vec3)) -> f32| pairs.iter().map(of).sum::<f32>();
    let rest_from_skeleton_size = lengths(|pair| pair.2.length()) / lengths(|pair| pair.1.length());
    let farthest = |turn: Quat| {
        let far = pairs.iter().map(|(joint, place, own)| {
            let place = rest_from_skeleton_size * (turn.inverse() * *place);
            (*joint, place.distance(*own))
        });
        far.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((root, 0.0))
    };
    let [y_up, z_up] = [Quat::IDENTITY, Quat::from_rotation_x(FRAC_PI_2)].map(|turn| (turn, farthest(turn)));
    let (turn, (joint, distance_m)) = match z_up.1.1 < y_up.1.1 {
        true => z_up,
        false => y_up,
    };
    if distance_m.is_nan() || distance_m >= SAME_M {
        let joint = skeleton.names()[joint].clone();
        return Err(RigError::RestPose { joint, distance_m });
    }
    Ok(turn)
}
