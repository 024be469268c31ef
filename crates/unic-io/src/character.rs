//! `character.npz`: a skinned body.

use crate::{
    error::{Error, Result},
    formats::refuse_foreign,
    motion::JOINT_NAMES,
    npy::Dim,
    npz::{Npz, NpzWriter},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Reads a character: `vertices` (B, 3), `faces` (F, 3), `joints` (J, 3), `parents` (J), `weights`
/// (B, J), and optionally `rest_pose` (J, 3) and `joint_names` (J). Metres, Y up.
///
/// # Errors
/// Missing arrays, shapes that contradict each other, values that cannot be used.
pub fn read_character(path: &Path) -> Result<Character> {
    read_named_character(path, Vec::new())
}

/// The same with joint names from elsewhere; none takes the file's own.
pub(crate) fn read_named_character(path: &Path, names: Vec<String>) -> Result<Character> {
    refuse_foreign(path, "a character (npz)")?;
    let mut npz = Npz::open(path)?;
    let body = read_mesh(&mut npz)?;
    let skeleton = read_skeleton(&mut npz, names)?;
    let shape = [Dim::Is(body.vertices.len()), Dim::Is(skeleton.len())];
    let weights = read_weights(&mut npz, shape)?;
    Ok(Character {
        body,
        skeleton,
        weights,
    })
}

fn read_mesh(npz: &mut Npz) -> Result<TriMesh> {
    let vertices = positions(npz, "vertices", Dim::Any("B"))?;
    let faces = npz.array::<u32>("faces", &[Dim::Any("F"), Dim::Is(3)])?;
    let faces = faces.data.chunks_exact(3).map(|f| [f[0], f[1], f[2]]);
    TriMesh::new(vertices, faces.collect()).map_err(|source| Error::Mesh {
        path: npz.path().to_path_buf(),
        source,
    })
}

fn read_skeleton(npz: &mut Npz, names: Vec<String>) -> Result<Skeleton> {
    let joints = positions(npz, "joints", Dim::Any("J"))?;
    let count = Dim::Is(joints.len());
    let parents = npz.array::<i64>("parents", &[count])?.data;
    let rest_pose = if npz.contains("rest_pose") {
        positions(npz, "rest_pose", count)?
    } else {
        Vec::new()
    };
    let own = match npz.contains(JOINT_NAMES) {
        true => smpl_names(npz.text(JOINT_NAMES)?),
        false => Vec::new(),
    };
    refuse_another_order(npz, &own, &names)?;
    let names = if names.is_empty() { own } else { names };
    Skeleton::new(SkeletonParts {
        names,
        parents,
        joints,
        rest_pose,
    })
    .map_err(|source| Error::Skeleton {
        path: npz.path().to_path_buf(),
        source,
    })
}

/// Names from elsewhere may name the joints anew, but not exchange them.
fn refuse_another_order(npz: &Npz, own: &[String], others: &[String]) -> Result<()> {
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort_unstable();
        names
    };
    let swapped = own.iter().zip(others).find(|(own, other)| own != other);
    match swapped.filter(|_| sorted(own) == sorted(others)) {
        None => Ok(()),
        Some((own, other)) => {
            let expected = format!("the order of the manifest's joint_names, in which {other} stands here");
            Err(npz.array_error(JOINT_NAMES, expected, own.as_str()))
        }
    }
}

/// SMPL's names in one spelling: bodies come with `left_hip` as well as `L_hip`.
fn smpl_names(names: Vec<String>) -> Vec<String> {
    let short = |name: &String| name.replace("left_", "L_").replace("right_", "R_");
    let spelled: Vec<String> = names.iter().map(short).collect();
    if spelled == SMPL_JOINT_NAMES {
        spelled
    } else {
        names
    }
}

/// The array `weights` of the given shape (vertices, joints).
pub(crate) fn read_weights(npz: &mut Npz, shape: [Dim; 2]) -> Result<SkinningWeights> {
    let dense = npz.array::<f32>("weights", &shape)?;
    SkinningWeights::from_dense(&dense.data, dense.shape[0], dense.shape[1]).map_err(|source| {
        Error::Weights {
            path: npz.path().to_path_buf(),
            source,
        }
    })
}

/// A finite array of shape (`count`, 3).
pub(crate) fn positions(npz: &mut Npz, name: &str, count: Dim) -> Result<Vec<Vec3>> {
    let array = npz.finite::<f32>(name, &[count, Dim::Is(3)])?;
    Ok(bytemuck::cast_slice(&array.data).to_vec())
}

/// Writes a character as [`read_character`] reads it, atomically.
///
/// # Errors
/// The file cannot be written.
pub fn write_character(path: &Path, character: &Character) -> Result<()> {
    let Character {
        body,
        skeleton,
        weights,
    } = character;
    let parts = skeleton.to_parts();
    let parents: Vec<i32> = parts.parents.iter().map(|&p| p as i32).collect();
    let faces: Vec<i32> = body.faces.as_flattened().iter().map(|&i| i as i32).collect();
    let (vertices, joints) = (body.vertices.len(), skeleton.len());
    let mut npz = NpzWriter::create(path)?;
    npz.f32s("vertices", &[vertices, 3], bytemuck::cast_slice(&body.vertices))?;
    npz.i32s("faces", &[body.faces.len(), 3], &faces)?;
    npz.f32s("joints", &[joints, 3], bytemuck::cast_slice(&parts.joints))?;
    npz.i32s("parents", &[joints], &parents)?;
    npz.text(JOINT_NAMES, &parts.names)?;
    npz.f32s("weights", &[vertices, joints], &weights.to_dense())?;
    npz.f32s("rest_pose", &[joints, 3], bytemuck::cast_slice(&parts.rest_pose))?;
    npz.finish()
}
