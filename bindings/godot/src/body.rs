//! The character of a model as a skinned mesh, for scenes without one of their own.

use crate::{
    mesh::{surface_arrays, vector},
    surface::Surface,
};
use godot::{
    classes::{ArrayMesh, MeshInstance3D, Skeleton3D, mesh::ArrayType, mesh::PrimitiveType},
    prelude::*,
};
use unic_core::{Model, mesh::vertex_normals, skeleton::Skeleton, transform::Rigid};

/// Largest number of bones that move a vertex of Godot.
const INFLUENCES: usize = 4;

/// Makes a skeleton with the joints of a model, and its skinned body as a child `Body`. A vertex
/// follows its four heaviest joints.
pub(crate) fn make_character(model: &Model) -> Gd<Skeleton3D> {
    let joints = &model.character().skeleton;
    let mut skeleton = Skeleton3D::new_alloc();
    let mut bind = Vec::new();
    joints.forward_kinematics(&joints.bind_pose(), &mut bind);
    for name in joints.names() {
        // Godot keeps colons for paths of properties.
        skeleton.add_bone(&name.replace([':', '/'], "_"));
    }
    add_rests(&mut skeleton, joints, &bind);
    let skin = skeleton.create_skin_from_rest_transforms();
    let mut body = MeshInstance3D::new_alloc();
    body.set_name("Body");
    body.set_mesh(&body_mesh(model));
    body.set_skin(skin.as_ref());
    body.set_skeleton_path("..");
    skeleton.add_child(&body);
    skeleton
}

fn add_rests(skeleton: &mut Gd<Skeleton3D>, joints: &Skeleton, bind: &[Rigid]) {
    for (joint, parent) in joints.parents().iter().enumerate() {
        let local = match *parent {
            Some(parent) => {
                skeleton.set_bone_parent(joint as i32, parent as i32);
                bind[parent].inverse() * bind[joint]
            }
            None => bind[joint],
        };
        let [x, y, z, w] = local.rotation.to_array();
        let basis = Basis::from_quaternion(Quaternion::new(x, y, z, w));
        skeleton.set_bone_rest(joint as i32, Transform3D::new(basis, vector(local.translation)));
    }
    skeleton.reset_bone_poses();
}

fn body_mesh(model: &Model) -> Gd<ArrayMesh> {
    let character = model.character();
    let body = &character.body;
    let surface = Surface::new(body);
    let mut normals = Vec::new();
    vertex_normals(&body.vertices, &body.faces, &mut normals);
    let spread = |values: &[glam::Vec3]| surface.spread(values).map(vector).collect();
    let mut arrays = surface_arrays(&surface, &spread(&body.vertices), &spread(&normals));
    let weights = character.weights.pruned(INFLUENCES, 0.0);
    let (mut bones, mut shares) = (PackedInt32Array::new(), PackedFloat32Array::new());
    for &vertex in &surface.sources {
        let (mut bone, mut share) = ([0i32; INFLUENCES], [0.0f32; INFLUENCES]);
        for (slot, (index, weight)) in weights.row(vertex as usize).enumerate() {
            (bone[slot], share[slot]) = (index as i32, weight);
        }
        bones.extend(bone);
        shares.extend(share);
    }
    arrays.set(ArrayType::BONES.ord() as usize, &bones.to_variant());
    arrays.set(ArrayType::WEIGHTS.ord() as usize, &shares.to_variant());
    let mut mesh = ArrayMesh::new_gd();
    mesh.add_surface_from_arrays(PrimitiveType::TRIANGLES, &arrays);
    mesh
}
