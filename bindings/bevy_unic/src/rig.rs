//! The joints of a skinned mesh that are those of a model.

use bevy::{math::Affine3A, prelude::*};
use unic_core::{
    Pose,
    rig::{RigError, RigFit, RigJoint},
    skeleton::Skeleton,
};
use unic_glam as core;

/// A joint of a skinned mesh.
#[derive(Clone, Debug)]
pub(crate) struct SkinJoint<'a> {
    pub(crate) entity: Entity,
    pub(crate) name: &'a str,
    /// From the joint's space to that of the mesh, in the bind pose.
    pub(crate) mesh_from_joint: Affine3A,
}

/// The joints of a model on a rig.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    fit: RigFit,
    /// Entity for each joint of the model; none for a tip that the rig has not.
    entities: Vec<Option<Entity>>,
    /// Transforms of the entities.
    world_from_joint: Vec<core::Affine3A>,
}

impl Rig {
    /// Finds the joints of a model by their names.
    ///
    /// # Errors
    /// Joints that are missing, unless they are tips; a rig in another rest pose.
    pub(crate) fn new(skeleton: &Skeleton, skin: &[SkinJoint<'_>]) -> Result<Self, RigError> {
        let joints: Vec<RigJoint<'_>> = (skin.iter())
            .map(|joint| RigJoint {
                name: joint.name,
                mesh_from_joint: affine(&joint.mesh_from_joint),
            })
            .collect();
        let fit = RigFit::new(skeleton, &joints)?;
        Ok(Self {
            entities: fit.sources().map(|index| Some(skin[index?].entity)).collect(),
            world_from_joint: vec![core::Affine3A::IDENTITY; skeleton.len()],
            fit,
        })
    }

    /// Writes the pose of the model for a rig in the world, whose positions are divided by the size
    /// of the character. Returns that size, 1 for that of the model; none if a joint has no transform
    /// or all are in one place.
    ///
    /// # Errors
    /// A character that is mirrored, scaled by axis or scaled to nothing.
    pub(crate) fn pose(
        &mut self,
        skeleton: &Skeleton,
        transforms: &Query<&GlobalTransform>,
        out: &mut Pose,
    ) -> Result<Option<f32>, RigError> {
        for (slot, entity) in self.world_from_joint.iter_mut().zip(&self.entities) {
            let Some(entity) = entity else {
                continue;
            };
            let Ok(transform) = transforms.get(*entity) else {
                return Ok(None);
            };
            *slot = affine(&transform.affine());
        }
        self.fit.pose(skeleton, &self.world_from_joint, out)
    }
}

/// A transform of Bevy, in the type of the model.
fn affine(transform: &Affine3A) -> core::Affine3A {
    core::Affine3A::from_cols_array(&transform.to_cols_array())
}
