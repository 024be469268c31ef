//! A model on a skeleton of the engine.

use crate::{
    garment::{FrameChoice, FrameError, Garment},
    mesh::{LayoutError, MovingMesh},
    model::{LoadError, SharedModel},
};
use glam::{Affine3A, Mat3, Vec3};
use godot::{
    classes::{Mesh, Node, Skeleton3D},
    prelude::*,
};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    rig::{RigError, RigFit, RigJoint},
    skeleton::Skeleton,
};

/// Signal of a skeleton when its modifiers are done and their poses still hold; since Godot 4.3.
const SKELETON_UPDATED: &str = "skeleton_updated";

/// Reason why a garment does not move.
#[derive(Debug, Error)]
pub(crate) enum Fault {
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error("expected a Skeleton3D at or under the node {0}, found none")]
    Skeleton(NodePath),
    #[error(transparent)]
    Rig(#[from] RigError),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// Garment on a skeleton.
#[derive(Debug)]
pub(crate) struct Worn {
    pub(crate) shared: Arc<SharedModel>,
    skeleton: Gd<Skeleton3D>,
    pub(crate) garment: Garment,
    mesh: MovingMesh,
    /// Bones after the skeleton's modifiers, in its space, a joint of the model each.
    skeleton_from_bone: Vec<Transform3D>,
    /// Whether the bones are those of this frame.
    has_bones: bool,
}

impl Worn {
    /// Puts a model on the skeleton at or under a node, which has been found at `path`.
    ///
    /// # Errors
    /// No skeleton, a rig that does not fit, an engine with another layout of vertex buffers.
    pub(crate) fn new(shared: Arc<SharedModel>, node: Gd<Node>, path: NodePath) -> Result<Self, Fault> {
        let skeleton = largest_skeleton(node).ok_or(Fault::Skeleton(path))?;
        let joints = &shared.model.character().skeleton;
        Ok(Self {
            garment: Garment::new(&shared.model, fit(joints, &skeleton)?),
            mesh: MovingMesh::new(&shared.model.garment().rest)?,
            skeleton_from_bone: vec![Transform3D::IDENTITY; joints.len()],
            has_bones: false,
            shared,
            skeleton,
        })
    }

    /// The mesh, for the node.
    pub(crate) fn mesh(&self) -> Gd<Mesh> {
        self.mesh.mesh()
    }

    /// Vertices of the model after the last frame, metres, world space.
    pub(crate) fn vertices(&self) -> PackedVector3Array {
        self.mesh.shown()
    }

    /// Whether the skeleton has been freed.
    pub(crate) fn has_no_skeleton(&self) -> bool {
        !self.skeleton.is_instance_valid()
    }

    /// Lets the skeleton call a method when its modifiers are done.
    pub(crate) fn listen(&self, keep_bones: &Callable) {
        let mut skeleton = self.skeleton.clone();
        if skeleton.has_signal(SKELETON_UPDATED) && !skeleton.is_connected(SKELETON_UPDATED, keep_bones) {
            skeleton.connect(SKELETON_UPDATED, keep_bones);
        }
    }

    /// Ends what [`listen`](Self::listen) has begun.
    pub(crate) fn stop_listening(&self, keep_bones: &Callable) {
        if self.has_no_skeleton() {
            return;
        }
        let mut skeleton = self.skeleton.clone();
        if skeleton.is_connected(SKELETON_UPDATED, keep_bones) {
            skeleton.disconnect(SKELETON_UPDATED, keep_bones);
        }
    }

    /// Takes the bones from the skeleton.
    pub(crate) fn read_bones(&mut self) {
        for (slot, bone) in self.skeleton_from_bone.iter_mut().zip(self.garment.bones()) {
            if let Some(bone) = bone {
                *slot = self.skeleton.get_bone_global_pose(bone as i32);
            }
        }
        self.has_bones = true;
    }

    /// Moves the garment by a frame. Returns the size of the character, and the box around the garment
    /// in the size of the model; none if the skeleton has no size.
    pub(crate) fn advance(
        &mut self,
        frame_s: f64,
        choice: &FrameChoice,
    ) -> Result<Option<(f32, Aabb)>, FrameError> {
        // A skeleton that has not moved, or an engine older than 4.3, tells nothing.
        if !std::mem::take(&mut self.has_bones) {
            self.read_bones();
            self.has_bones = false;
        }
        let to_world = self.skeleton.get_global_transform();
        let world_from_bone: Vec<Affine3A> = (self.skeleton_from_bone.iter())
            .map(|bone| affine(to_world * *bone))
            .collect();
        let frame = self.garment.advance(&world_from_bone, frame_s, choice)?;
        Ok(frame.map(|frame| (frame.size, self.mesh.write(&frame))))
    }
}

/// Skeleton with the most bones at or under a node: hair and props may have skeletons of their own.
fn largest_skeleton(node: Gd<Node>) -> Option<Gd<Skeleton3D>> {
    let mut found: Option<Gd<Skeleton3D>> = None;
    let mut open = vec![node];
    while let Some(node) = open.pop() {
        open.extend(node.get_children().iter_shared());
        if let Ok(skeleton) = node.try_cast::<Skeleton3D>()
            && found
                .as_ref()
                .is_none_or(|found| skeleton.get_bone_count() > found.get_bone_count())
        {
            found = Some(skeleton);
        }
    }
    found
}

/// Finds the bones of a skeleton that are the joints of a model.
///
/// # Errors
/// A skeleton that does not fit.
fn fit(joints: &Skeleton, skeleton: &Gd<Skeleton3D>) -> Result<RigFit, RigError> {
    let bones = 0..skeleton.get_bone_count();
    let names: Vec<String> = (bones.clone())
        .map(|bone| skeleton.get_bone_name(bone).to_string())
        .collect();
    let rig: Vec<RigJoint<'_>> = (bones.zip(&names))
        .map(|(bone, name)| RigJoint {
            name,
            mesh_from_joint: affine(skeleton.get_bone_global_rest(bone)),
        })
        .collect();
    RigFit::new(joints, &rig)
}

/// A transform of the engine, scale included.
fn affine(transform: Transform3D) -> Affine3A {
    let [x, y, z] = transform.basis.to_cols().map(vec3);
    Affine3A::from_mat3_translation(Mat3::from_cols(x, y, z), vec3(transform.origin))
}

/// A vector of the engine.
pub(crate) fn vec3(v: Vector3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}
