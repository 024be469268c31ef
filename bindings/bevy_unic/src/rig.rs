//! The joints of a skinned mesh that are those of a model.

use bevy::{math::Affine3A, prelude::*};
use thiserror::Error;
use unic_core::{Pose, skeleton::Skeleton};
use unic_glam as core;

/// Largest distance between a joint of the rig and that of the model in the rest pose, metres.
const SAME_M: f32 = 0.02;

/// Error of a rig that does not wear the garments of a model.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RigError {
    /// Joints of the model that the rig has not.
    #[error("expected the joints {}, found none of these names in the skinned mesh", .0.join(", "))]
    Joints(Vec<String>),
    /// A rig in another rest pose or of another body.
    #[error("expected the rest pose of the model, found the joint {joint} {distance_m:.2} m away")]
    RestPose {
        /// Name of the joint that is farthest away.
        joint: String,
        /// Its distance, metres, in the size of the model.
        distance_m: f32,
    },
    /// A character that is mirrored, or scaled by other factors along other axes.
    #[error("expected one positive scale along all axes, found {} at the joint {joint}", scale.map(|s| format!("{s:.2}")).join(", "))]
    Scale {
        /// Name of the root joint.
        joint: String,
        /// Scale along each axis.
        scale: [f32; 3],
    },
    /// A skinned mesh without bind poses for its joints.
    #[error("expected {expected} inverse bind poses, found {found}")]
    BindPoses {
        /// Number of joints.
        expected: usize,
        /// Number of bind poses.
        found: usize,
    },
}

/// A joint of a skinned mesh.
#[derive(Clone, Debug)]
pub(crate) struct RigJoint<'a> {
    pub(crate) entity: Entity,
    pub(crate) name: &'a str,
    /// From the joint's space to that of the mesh, in the bind pose.
    pub(crate) mesh_from_joint: Affine3A,
}

/// The joints of a model on a rig.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    /// Joint of the rig for each joint of the model; none for a tip that the rig has not.
    joints: Vec<Option<JointSource>>,
    /// Global rotations of the model's bind pose.
    rest_from_joint: Vec<core::Quat>,
}

/// A joint of the rig.
#[derive(Clone, Copy, Debug)]
struct JointSource {
    entity: Entity,
    /// Rotation from the model's rest pose to the space of the joint in the bind pose.
    joint_from_rest: Quat,
}

impl Rig {
    /// Finds the joints of a model by their names, in capitals or not, with a namespace or without.
    ///
    /// # Errors
    /// Joints that are missing, unless they are tips; a rig in another rest pose.
    pub(crate) fn new(skeleton: &Skeleton, rig: &[RigJoint<'_>]) -> Result<Self, RigError> {
        let find = |name: &String| {
            let exact = rig.iter().position(|joint| joint.name == name);
            exact.or_else(|| rig.iter().position(|joint| is_same_name(joint.name, name)))
        };
        let found: Vec<Option<usize>> = skeleton.names().iter().map(find).collect();
        let has_children = |joint: usize| skeleton.parents().contains(&Some(joint));
        let missing = (0..skeleton.len()).filter(|&joint| found[joint].is_none() && has_children(joint));
        let missing: Vec<String> = missing.map(|joint| skeleton.names()[joint].clone()).collect();
        if !missing.is_empty() {
            return Err(RigError::Joints(missing));
        }
        let mesh_from_rest = mesh_from_rest(skeleton, rig, &found)?;
        let source = |source: usize| {
            let mesh_from_joint = rotation(&rig[source].mesh_from_joint);
            JointSource {
                entity: rig[source].entity,
                joint_from_rest: mesh_from_joint.inverse() * mesh_from_rest,
            }
        };
        let mut bind = Vec::new();
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
        Ok(Self {
            joints: found.into_iter().map(|joint| joint.map(source)).collect(),
            rest_from_joint: bind.iter().map(|joint| joint.rotation).collect(),
        })
    }

    /// Writes the pose of the model for a rig in the world. Returns the size of the character in
    /// the world, 1 for that of the model; none if a joint has no transform.
    ///
    /// Positions of the pose are divided by that size.
    ///
    /// # Errors
    /// A character that is mirrored or scaled by axis.
    pub(crate) fn pose(
        &self,
        skeleton: &Skeleton,
        transforms: &Query<&GlobalTransform>,
        out: &mut Pose,
    ) -> Result<Option<f32>, RigError> {
        self.check_scale(skeleton, transforms)?;
        Ok(self.unscaled_pose(skeleton, transforms, out))
    }

    /// Refuses a character whose root is scaled by axis, further than rounding does it.
    fn check_scale(&self, skeleton: &Skeleton, transforms: &Query<&GlobalTransform>) -> Result<(), RigError> {
        let root = skeleton.root();
        let source = self.joints[root].map(|joint| transforms.get(joint.entity));
        let Some(Ok(transform)) = source else {
            return Ok(());
        };
        let scale = transform.affine().to_scale_rotation_translation().0;
        match scale.min_element() > 0.0 && scale.max_element() < 1.02 * scale.min_element() {
            true => Ok(()),
            false => Err(RigError::Scale {
                joint: skeleton.names()[root].clone(),
                scale: scale.to_array(),
            }),
        }
    }

    fn unscaled_pose(
        &self,
        skeleton: &Skeleton,
        transforms: &Query<&GlobalTransform>,
        out: &mut Pose,
    ) -> Option<f32> {
        let world = |joint: usize| {
            let source = self.joints[joint]?;
            let transform = transforms.get(source.entity).ok()?;
            Some((transform.affine(), source))
        };
        let global = |joint: usize| {
            let (affine, source) = world(joint)?;
            let from_rest = rotation(&affine) * source.joint_from_rest;
            Some(core::Quat::from_array(from_rest.to_array()) * self.rest_from_joint[joint])
        };
        for (joint, local) in out.local.iter_mut().enumerate() {
            let parent = skeleton.parents()[joint];
            *local = match (self.joints[joint], parent) {
                (Some(_), None) => global(joint)?,
                (Some(_), Some(parent)) => global(parent)?.inverse() * global(joint)?,
                // A tip that the rig has not stays as in the bind pose.
                (None, _) => match parent {
                    Some(parent) => self.rest_from_joint[parent].inverse() * self.rest_from_joint[joint],
                    None => self.rest_from_joint[joint],
                },
            }
            .normalize();
        }
        let size = self.size(skeleton, transforms)?;
        let root = skeleton.root();
        let place = Vec3::from(world(root)?.0.translation) / size;
        out.trans = core::Vec3::from_array(place.to_array()) - skeleton.joints()[root];
        Some(size)
    }

    /// Size of the character in the world, by the lengths of its bones.
    fn size(&self, skeleton: &Skeleton, transforms: &Query<&GlobalTransform>) -> Option<f32> {
        let place = |joint: usize| {
            let source = self.joints[joint]?;
            Some(transforms.get(source.entity).ok()?.translation())
        };
        let (mut world, mut model) = (0.0, 0.0);
        for (joint, parent) in skeleton.parents().iter().enumerate() {
            if let (Some(parent), Some(_)) = (*parent, self.joints[joint]) {
                world += place(joint)?.distance(place(parent)?);
                model += skeleton.joints()[joint].distance(skeleton.joints()[parent]);
            }
        }
        (model > 0.0 && world > 0.0).then_some(world / model)
    }
}

/// Rotation of a transform that may scale.
fn rotation(transform: &Affine3A) -> Quat {
    transform.to_scale_rotation_translation().1
}

/// Compares names without namespace and without regard to capitals.
fn is_same_name(a: &str, b: &str) -> bool {
    let own = |name: &str| name.rsplit(':').next().unwrap_or_default().to_lowercase();
    own(a) == own(b)
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
    let own =
        |joint: usize| Vec3::from_array((skeleton.joints()[joint] - skeleton.joints()[root]).to_array());
    // The root has been found: it has children.
    let origin = found[root].map_or(Vec3::ZERO, |root| rig[root].mesh_from_joint.translation.into());
    let pairs: Vec<(usize, Vec3, Vec3)> = (found.iter().enumerate())
        .filter_map(|(joint, source)| {
            let place: Vec3 = rig[(*source)?].mesh_from_joint.translation.into();
            Some((joint, place - origin, own(joint)))
        })
        .collect();
    let lengths = |of: fn(&(usize, Vec3, Vec3)) -> f32| pairs.iter().map(of).sum::<f32>();
    let rest_from_mesh_size = lengths(|pair| pair.2.length()) / lengths(|pair| pair.1.length());
    let farthest = |turn: Quat| {
        let far = pairs.iter().map(|(joint, mesh, own)| {
            let place = rest_from_mesh_size * (turn.inverse() * *mesh);
            (*joint, place.distance(*own))
        });
        far.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((root, 0.0))
    };
    let z_up = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let best = [Quat::IDENTITY, z_up].map(|turn| (turn, farthest(turn)));
    let (turn, (joint, distance_m)) = match best[1].1.1 < best[0].1.1 {
        true => best[1],
        false => best[0],
    };
    if distance_m.is_nan() || distance_m >= SAME_M {
        let joint = skeleton.names()[joint].clone();
        return Err(RigError::RestPose { joint, distance_m });
    }
    Ok(turn)
}
