//! A model on the rig of an engine: joints by their names, poses from transforms of bones.
//!
//! For engines whose characters are not those of the model's file.

use crate::skeleton::{Pose, Skeleton};
use glam::{Affine3A, Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use thiserror::Error;

/// Largest distance between a joint of the rig and that of the model in the rest pose, metres.
const SAME_M: f32 = 0.02;

/// Largest quotient of the scales along two axes that is rounding.
const EVEN: f32 = 1.02;

/// Error of a rig that does not wear the garments of a model.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RigError {
    /// Joints of the model that the rig has not.
    #[error("expected the joints {}, found none of these names in the rig", .0.join(", "))]
    Joints(Vec<String>),
    /// A rig in another rest pose or of another body.
    #[error("expected the rest pose of the model, found the joint {joint} {distance_m:.2} m away")]
    RestPose {
        /// Name of the joint that is farthest away.
        joint: String,
        /// Its distance, metres, in the size of the model.
        distance_m: f32,
    },
    /// A character that is mirrored, or scaled by other factors along other axes, or a joint that is
    /// scaled to nothing.
    #[error("expected one positive scale along all axes, found {} at the joint {joint}", scale.map(|s| format!("{s:.2}")).join(", "))]
    Scale {
        /// Name of the joint in the model.
        joint: String,
        /// Scale along each axis, the first one negative if it is mirrored.
        scale: [f32; 3],
    },
}

/// Joint of a rig in its rest pose.
#[derive(Clone, Debug)]
pub struct RigJoint<'a> {
    /// Name in the engine.
    pub name: &'a str,
    /// From the joint's space to one that all joints share, such as that of the skinned mesh.
    pub mesh_from_joint: Affine3A,
}

/// Joints of a rig that move a model.
///
/// Joints of the rig may have any axes, as rotations are taken from its rest pose. That must be the
/// bind pose of the model, with +Y or +Z up and in any size.
#[derive(Clone, Debug)]
pub struct RigFit {
    /// Joint of the rig for each joint of the model; none for a tip that the rig has not.
    joints: Vec<Option<Source>>,
    /// Global rotations of the model's bind pose.
    rest_from_joint: Vec<Quat>,
}

/// Joint of the rig that moves a joint of the model.
#[derive(Clone, Copy, Debug)]
struct Source {
    index: usize,
    /// Rotation from the model's rest pose to the space of the joint in the rig's rest pose.
    joint_from_rest: Quat,
}

impl RigFit {
    /// Finds the joints of a model by their names, in capitals or not, with a namespace or without.
    ///
    /// A namespace ends with a colon, or with the `_` that some engines write for it.
    ///
    /// # Errors
    /// Joints that are missing, unless they are tips; a rig in another rest pose; joints of the rig
    /// that are scaled to nothing.
    pub fn new(skeleton: &Skeleton, rig: &[RigJoint<'_>]) -> Result<Self, RigError> {
        let found = find_joints(skeleton, rig);
        let has_children = |joint: usize| skeleton.parents().contains(&Some(joint));
        let missing = (0..skeleton.len()).filter(|&joint| found[joint].is_none() && has_children(joint));
        let missing: Vec<String> = missing.map(|joint| skeleton.names()[joint].clone()).collect();
        if !missing.is_empty() {
            return Err(RigError::Joints(missing));
        }
        let mesh_from_rest = mesh_from_rest(skeleton, rig, &found)?;
        let source = |(joint, index): (usize, Option<usize>)| {
            let Some(index) = index else {
                return Ok(None);
            };
            let (mesh_from_joint, _) = turn_and_scale(skeleton, joint, &rig[index].mesh_from_joint)?;
            let joint_from_rest = mesh_from_joint.inverse() * mesh_from_rest;
            Ok(Some(Source {
                index,
                joint_from_rest,
            }))
        };
        let joints: Result<Vec<_>, RigError> = found.into_iter().enumerate().map(source).collect();
        let mut bind = Vec::new();
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
        Ok(Self {
            joints: joints?,
            rest_from_joint: bind.iter().map(|joint| joint.rotation).collect(),
        })
    }

    /// Index in the rig for each joint of the model; none for a tip that the rig has not.
    pub fn sources(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.joints.iter().map(|joint| joint.map(|source| source.index))
    }

    /// Writes the pose of the model for a rig in the world. Returns the size of the character in the
    /// world, 1 for that of the model; none if the joints of the rig are in one place.
    ///
    /// `world_from_joint` has one transform for each joint of the model, in metres; those of joints
    /// that the rig has not are ignored. Positions of the pose are divided by the size.
    ///
    /// # Errors
    /// A character that is mirrored or scaled by axis, joints that are scaled to nothing.
    ///
    /// # Panics
    /// With fewer transforms than joints.
    pub fn pose(
        &self,
        skeleton: &Skeleton,
        world_from_joint: &[Affine3A],
        out: &mut Pose,
    ) -> Result<Option<f32>, RigError> {
        let root = skeleton.root();
        check_even(skeleton, root, &world_from_joint[root])?;
        let global = |joint: usize, source: Source| {
            let (turn, _) = turn_and_scale(skeleton, joint, &world_from_joint[joint])?;
            Ok(turn * source.joint_from_rest * self.rest_from_joint[joint])
        };
        for (joint, local) in out.local.iter_mut().enumerate() {
            // Joints above another one have been found.
            let parent = skeleton.parents()[joint].and_then(|parent| Some((parent, self.joints[parent]?)));
            *local = match (self.joints[joint], parent) {
                (Some(source), None) => global(joint, source)?,
                (Some(source), Some((parent, above))) => {
                    global(parent, above)?.inverse() * global(joint, source)?
                }
                // A tip that the rig has not stays as in the bind pose.
                (None, Some((parent, _))) => {
                    self.rest_from_joint[parent].inverse() * self.rest_from_joint[joint]
                }
                (None, None) => self.rest_from_joint[joint],
            }
            .normalize();
        }
        let Some(size) = self.size(skeleton, world_from_joint) else {
            return Ok(None);
        };
        out.trans = place(&world_from_joint[root]) / size - skeleton.joints()[root];
        Ok(Some(size))
    }

    /// Size of the character in the world, by the lengths of its bones.
    fn size(&self, skeleton: &Skeleton, world_from_joint: &[Affine3A]) -> Option<f32> {
        let (mut world, mut model) = (0.0, 0.0);
        for (joint, parent) in skeleton.parents().iter().enumerate() {
            if let (Some(parent), Some(_)) = (*parent, self.joints[joint]) {
                world += place(&world_from_joint[joint]).distance(place(&world_from_joint[parent]));
                model += skeleton.joints()[joint].distance(skeleton.joints()[parent]);
            }
        }
        (model > 0.0 && world > 0.0).then_some(world / model)
    }
}

fn place(transform: &Affine3A) -> Vec3 {
    transform.translation.into()
}

/// Rotation and scale of a joint's transform.
///
/// # Errors
/// A scale of 0 along an axis, which leaves no rotation.
fn turn_and_scale(skeleton: &Skeleton, joint: usize, transform: &Affine3A) -> Result<(Quat, Vec3), RigError> {
    let (scale, turn, _) = transform.to_scale_rotation_translation();
    match turn.is_finite() && scale.abs().min_element() > 0.0 {
        true => Ok((turn, scale)),
        false => Err(scale_error(skeleton, joint, scale)),
    }
}

/// Refuses a joint that is mirrored, or scaled by axis further than rounding does it.
fn check_even(skeleton: &Skeleton, joint: usize, transform: &Affine3A) -> Result<(), RigError> {
    let (_, scale) = turn_and_scale(skeleton, joint, transform)?;
    match scale.min_element() > 0.0 && scale.max_element() < EVEN * scale.min_element() {
        true => Ok(()),
        false => Err(scale_error(skeleton, joint, scale)),
    }
}

fn scale_error(skeleton: &Skeleton, joint: usize, scale: Vec3) -> RigError {
    RigError::Scale {
        joint: skeleton.names()[joint].clone(),
        scale: scale.to_array(),
    }
}

/// Finds the joint of the rig for each of the model. One namespace holds for all joints: the one that
/// finds most of them.
fn find_joints(skeleton: &Skeleton, rig: &[RigJoint<'_>]) -> Vec<Option<usize>> {
    let names: Vec<String> = rig.iter().map(|joint| plain(joint.name)).collect();
    let root = plain(&skeleton.names()[skeleton.root()]);
    let namespaces = (names.iter())
        .filter_map(|name| name.strip_suffix(&root))
        .filter(|before| before.is_empty() || before.ends_with('_'));
    let with = |namespace: &str| -> Vec<Option<usize>> {
        let find = |joint: &String| {
            let exact = rig.iter().position(|other| other.name == joint);
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

/// Rotation from the model's rest pose to the space of the mesh, which tools keep in Y up or Z up.
///
/// # Errors
/// Joints at other places than the model's.
fn mesh_from_rest(
    skeleton: &Skeleton,
    rig: &[RigJoint<'_>],
    found: &[Option<usize>],
) -> Result<Quat, RigError> {
    let root = skeleton.root();
    let own = |joint: usize| skeleton.joints()[joint] - skeleton.joints()[root];
    let place = |index: usize| place(&rig[index].mesh_from_joint);
    // The root has been found: it has children.
    let origin = found[root].map_or(Vec3::ZERO, place);
    let pairs: Vec<(usize, Vec3, Vec3)> = (found.iter().enumerate())
        .filter_map(|(joint, index)| Some((joint, place((*index)?) - origin, own(joint))))
        .collect();
    let lengths = |of: fn(&(usize, Vec3, Vec3)) -> f32| pairs.iter().map(of).sum::<f32>();
    let rest_from_mesh_size = lengths(|pair| pair.2.length()) / lengths(|pair| pair.1.length());
    let farthest = |turn: Quat| {
        let far = pairs.iter().map(|(joint, place, own)| {
            let place = rest_from_mesh_size * (turn.inverse() * *place);
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

#[cfg(test)]
mod tests;
