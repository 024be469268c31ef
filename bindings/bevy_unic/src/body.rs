//! The character of a model as a skinned mesh, for programs without one of their own.

use bevy::{
    asset::RenderAssetUsages,
    mesh::{
        Indices, PrimitiveTopology, VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use unic_core::{Model, mesh::vertex_normals, skeleton::Skeleton};

/// Largest number of joints that move a vertex of Bevy.
const INFLUENCES: usize = 4;

/// Spawns the character of a model: an entity with the skinned mesh, whose children are the joints.
/// Returns it, and the joints in the order of the model.
///
/// The entity needs a material. A joint has the name that it has in the model, and its transform is
/// that of the bind pose. A vertex follows its four heaviest joints.
///
/// ```
/// # use bevy::{mesh::{MeshPlugin, skinning::SkinnedMeshInverseBindposes}, prelude::*};
/// # use bevy_unic::{UnicModel, spawn_character};
/// fn spawn(
///     mut commands: Commands,
///     mut meshes: ResMut<Assets<Mesh>>,
///     mut bind_poses: ResMut<Assets<SkinnedMeshInverseBindposes>>,
///     models: Res<Assets<UnicModel>>,
/// ) {
///     for (_, UnicModel(model)) in models.iter() {
///         let (character, joints) = spawn_character(&mut commands, &mut meshes, &mut bind_poses, model);
///         assert_eq!(joints.len(), model.character().skeleton.len());
///         commands.entity(character).insert(Transform::default());
///     }
/// }
/// ```
pub fn spawn_character(
    commands: &mut Commands<'_, '_>,
    meshes: &mut Assets<Mesh>,
    bind_poses: &mut Assets<SkinnedMeshInverseBindposes>,
    model: &Model,
) -> (Entity, Vec<Entity>) {
    let skeleton = &model.character().skeleton;
    let world_from_joint = bind_transforms(skeleton);
    let character = commands.spawn(Transform::default()).id();
    let joints: Vec<Entity> = (skeleton.names().iter())
        .map(|name| commands.spawn(Name::new(name.clone())).id())
        .collect();
    for (joint, parent) in skeleton.parents().iter().enumerate() {
        let own = world_from_joint[joint];
        let (parent, local) = match *parent {
            Some(parent) => (joints[parent], world_from_joint[parent].inverse() * own),
            None => (character, own),
        };
        let transform = Transform::from_matrix(local);
        commands
            .entity(joints[joint])
            .insert((transform, ChildOf(parent)));
    }
    let inverse: Vec<Mat4> = world_from_joint.iter().map(Mat4::inverse).collect();
    commands.entity(character).insert((
        Mesh3d(meshes.add(body_mesh(model))),
        SkinnedMesh {
            inverse_bindposes: bind_poses.add(SkinnedMeshInverseBindposes::from(inverse)),
            joints: joints.clone(),
        },
    ));
    (character, joints)
}

/// Transforms of the joints in the bind pose.
fn bind_transforms(skeleton: &Skeleton) -> Vec<Mat4> {
    let mut bind = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
    let matrix = |joint: &unic_core::transform::Rigid| {
        Mat4::from_rotation_translation(
            Quat::from_array(joint.rotation.to_array()),
            Vec3::from_array(joint.translation.to_array()),
        )
    };
    bind.iter().map(matrix).collect()
}

fn body_mesh(model: &Model) -> Mesh {
    let character = model.character();
    let body = &character.body;
    let mut normals = Vec::new();
    vertex_normals(&body.vertices, &body.faces, &mut normals);
    let arrays =
        |values: &[unic_glam::Vec3]| -> Vec<[f32; 3]> { values.iter().map(|v| v.to_array()).collect() };
    let weights = character.weights.pruned(INFLUENCES, 0.0);
    let (mut joints, mut shares) = (Vec::new(), Vec::new());
    for vertex in 0..weights.len() {
        let (mut joint, mut share) = ([0u16; INFLUENCES], [0.0f32; INFLUENCES]);
        for (slot, (index, weight)) in weights.row(vertex).enumerate() {
            (joint[slot], share[slot]) = (index as u16, weight);
        }
        joints.push(joint);
        shares.push(share);
    }
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, arrays(&body.vertices));
    mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, arrays(&normals));
    mesh.insert_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(joints),
    );
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, shares);
    mesh.insert_indices(Indices::U32(body.faces.as_flattened().to_vec()));
    mesh
}
