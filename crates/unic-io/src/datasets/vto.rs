//! Reading the VTO data set.

use super::sequence::{GarmentSequence, clip, frames, pose};
use crate::{
    error::{Error, Result},
    pickle::{Numbers, Pickle},
};
use glam::Vec3;
use std::path::Path;
use unic_core::{Pose, character::Character};

/// Number of rotation values in a frame: three for each of SMPL's 24 joints.
const ROTATIONS: usize = 72;

/// Reads a sequence.
///
/// # Errors
/// No pickle, missing arrays, shapes that contradict each other.
pub(super) fn read(path: &Path, character: &Character) -> Result<GarmentSequence> {
    let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
    let pickle = Pickle::read(path, &bytes)?;
    let poses = array(path, &pickle, &["poses", "pose"], 2)?;
    let vertices = array(path, &pickle, &["vertices"], 3)?;
    let faces = array(path, &pickle, &["faces"], 2)?;
    let (count, numbers) = (poses.shape[0], poses.shape[1]);
    let translations = match numbers {
        // The translation is behind the rotations of each frame.
        75 => (poses.data.chunks_exact(75))
            .flat_map(|f| f[ROTATIONS..].iter().copied())
            .collect(),
        ROTATIONS => array(path, &pickle, &["translation", "trans"], 2)?.data,
        found => return Err(Error::content(path, "72 or 75 numbers a pose", found.to_string())),
    };
    // All shapes are checked here, so that the chunks below have the same number of frames.
    let fits = vertices.shape[0] == count && vertices.shape[2] == 3 && translations.len() == 3 * count;
    if !fits || faces.shape[1] != 3 {
        let expected = format!("vertices ({count}, V, 3), translations ({count}, 3) and faces (F, 3)");
        return Err(Error::content(
            path,
            expected,
            format!("{:?} and {:?}", vertices.shape, faces.shape),
        ));
    }
    let joints = character.skeleton.len();
    let pose = |(frame, trans): (&[f64], &[f64])| -> Result<Pose> {
        let rotations: Vec<Vec3> = frame[..ROTATIONS].chunks_exact(3).map(vector).collect();
        pose(path, &rotations, vector(trans), joints)
    };
    let poses = poses
        .data
        .chunks_exact(numbers)
        .zip(translations.chunks_exact(3))
        .map(pose);
    Ok(GarmentSequence {
        clip: clip(path, poses.collect::<Result<_>>()?)?,
        garment: frames(&vertices.data, vertices.shape[1]),
        faces: faces
            .data
            .chunks_exact(3)
            .map(|f| [f[0] as u32, f[1] as u32, f[2] as u32])
            .collect(),
    })
}

/// Returns garment and body shape of a sequence, the first two parts of its file name.
pub(super) fn shape_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    stem.split('_').take(2).collect::<Vec<_>>().join("_")
}

/// Finds an array of numbers under one of several names.
fn array(path: &Path, pickle: &Pickle, names: &[&str], dimensions: usize) -> Result<Numbers> {
    let name = names[0];
    let found = pickle.value(pickle.root(), names);
    let numbers = found.and_then(|index| pickle.numbers(index));
    numbers.filter(|n| n.shape.len() == dimensions).ok_or_else(|| {
        let expected = format!("an array `{name}` of {dimensions} dimensions");
        Error::content(path, expected, "none in the pickle")
    })
}

fn vector(numbers: &[f64]) -> Vec3 {
    Vec3::new(numbers[0] as f32, numbers[1] as f32, numbers[2] as f32)
}
