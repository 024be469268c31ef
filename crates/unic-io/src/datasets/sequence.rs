//! A sequence of a data set.

use super::Dataset;
use crate::error::{Error, Result};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{Pose, clip::Clip, skeleton::SMPL_JOINT_NAMES};

/// Number of body joints in the SMPL family.
const BODY_JOINTS: usize = 22;

/// Motion of the character and a garment, frame by frame.
pub(super) struct GarmentSequence {
    pub(super) clip: Clip,
    /// Positions of the garment in each frame, in the file's coordinate frame and unit.
    pub(super) garment: Vec<Vec<Vec3>>,
    /// Triangles of the garment, if the file has them.
    pub(super) faces: Vec<[u32; 3]>,
}

/// Lists the files of sequences in a folder, sorted by name. The archives unpack them to
/// `simulations/`, which is searched if it exists.
///
/// # Errors
/// A folder that cannot be listed or holds no sequences.
pub(super) fn files(dataset: Dataset, folder: &Path) -> Result<Vec<PathBuf>> {
    let simulations = folder.join("simulations");
    // The archive of one data set unpacks to a folder of this name.
    let folder = if simulations.is_dir() {
        &simulations
    } else {
        folder
    };
    let entries = std::fs::read_dir(folder).map_err(Error::io(folder, "open"))?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(Error::io(folder, "read"))?.path();
        if path.extension().is_some_and(|e| e == dataset.extension()) {
            files.push(path);
        }
    }
    if files.is_empty() {
        let expected = format!("sequences (.{})", dataset.extension());
        return Err(Error::content(folder, expected, "none"));
    }
    // The file system's order differs between machines, and the split depends on it.
    files.sort();
    Ok(files)
}

/// Makes a clip of poses, named after its file.
///
/// # Errors
/// Fewer than two frames.
pub(super) fn clip(path: &Path, poses: Vec<Pose>) -> Result<Clip> {
    if poses.len() < 2 {
        return Err(Error::content(
            path,
            "at least two frames",
            poses.len().to_string(),
        ));
    }
    Ok(Clip {
        name: path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        fps: super::FPS,
        poses,
        ground_height: 0.0,
        wind: Vec::new(),
    })
}

/// Makes a pose from the rotation vectors of a frame. They belong to the character's joints, or to
/// SMPL-H's, whose 22 body joints are taken for a character of SMPL's 24.
///
/// # Errors
/// Another number of joints.
pub(super) fn pose(path: &Path, rotations: &[Vec3], trans: Vec3, joints: usize) -> Result<Pose> {
    let taken = match rotations.len() {
        own if own == joints => own,
        52 if joints == SMPL_JOINT_NAMES.len() => BODY_JOINTS,
        found => {
            let expected = format!("poses of {joints} joints, as the character has them");
            return Err(Error::content(path, expected, format!("{found} joints")));
        }
    };
    let mut rotations = rotations[..taken].to_vec();
    // Hands of SMPL have no rotation of their own in SMPL-H.
    rotations.resize(joints, Vec3::ZERO);
    Ok(Pose::from_axis_angles(trans, &rotations))
}

/// Splits numbers into frames of `vertices` positions.
pub(super) fn frames(numbers: &[f64], vertices: usize) -> Vec<Vec<Vec3>> {
    let point = |p: &[f64]| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32);
    let frames = numbers.chunks_exact(3 * vertices.max(1));
    frames
        .map(|frame| frame.chunks_exact(3).map(point).collect())
        .collect()
}
