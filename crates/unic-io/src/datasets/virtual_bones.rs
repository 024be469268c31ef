//! Reading the VirtualBones data set.

use super::sequence::{GarmentSequence, clip, frames, pose};
use crate::{
    error::{Error, Result},
    npy::Dim,
    npz::Npz,
    obj::read_obj,
    up_axis::{to_y_up, turn_to_y_up},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{Pose, character::Character, mesh::TriMesh};

/// Unit of the template, metres.
const UNIT_M: f32 = 0.1;
/// Position of the body's pelvis in the template's pose, metres, Z up.
const PELVIS: Vec3 = Vec3::new(0.0, -0.0215, 0.9048);

/// Reads a sequence; positions of the garment stay in the file's coordinate frame.
///
/// # Errors
/// Missing arrays, shapes that contradict each other, numbers that are not finite.
pub(super) fn read(path: &Path, character: &Character) -> Result<GarmentSequence> {
    let mut npz = Npz::open(path)?;
    let any = Dim::Any("T");
    let poses = npz.finite::<f32>("pose", &[any, Dim::Any("J"), Dim::Is(3)])?;
    let (count, joints) = (poses.shape[0], poses.shape[1]);
    let trans = npz.finite::<f32>("trans", &[Dim::Is(count), Dim::Is(3)])?;
    // f64, the type of numbers from pickles: both data sets share the conversion to frames.
    let garment = npz.finite::<f64>("sim_res", &[Dim::Is(count), Dim::Any("V"), Dim::Is(3)])?;
    let skeleton = &character.skeleton;
    // SMPL's translation is the displacement of the root joint from its rest position, which is
    // another one for the given character.
    let shift = PELVIS - skeleton.joints()[skeleton.root()];
    let rotations: Vec<Vec3> = poses.data.chunks_exact(3).map(Vec3::from_slice).collect();
    let frame = |(rotations, trans): (&[Vec3], &[f32])| -> Result<Pose> {
        pose(path, rotations, Vec3::from_slice(trans) + shift, skeleton.len())
    };
    let rotations = rotations
        .chunks_exact(joints.max(1))
        .zip(trans.data.chunks_exact(3));
    let mut clip = clip(path, rotations.map(frame).collect::<Result<_>>()?)?;
    // The garment is converted later, when its coordinate frame is known.
    turn_to_y_up(&mut clip, skeleton);
    Ok(GarmentSequence {
        clip,
        garment: frames(&garment.data, garment.shape[1]),
        faces: Vec::new(),
    })
}

/// Reads the garment on the body's rest pose, in metres, Y up, on the character's pelvis.
///
/// # Errors
/// No such file, a mesh with faults.
pub(super) fn template(folder: &Path, character: &Character) -> Result<TriMesh> {
    let path = folder.join("template.obj");
    let mut mesh = read_obj(&path)?;
    let skeleton = &character.skeleton;
    let pelvis = skeleton.joints()[skeleton.root()];
    for vertex in &mut mesh.vertices {
        *vertex = to_y_up(*vertex * UNIT_M - PELVIS) + pelvis;
    }
    mesh.check().map_err(|source| Error::Mesh { path, source })?;
    Ok(mesh)
}
