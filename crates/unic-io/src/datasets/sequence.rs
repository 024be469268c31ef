//! One sequence as it comes out of a file.

use super::{Dataset, virtual_bones, vto};
use crate::error::{Error, Result};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    character::Character,
    clip::Clip,
    skeleton::{Pose, SMPL_JOINT_NAMES},
};

/// Joints of the SMPL family that carry the body.
const BODY_JOINTS: usize = 22;

/// Motion of the character and a garment, frame by frame.
pub(super) struct Sequence {
    pub(super) clip: Clip,
    /// World, metres, Y up, once the data set's frame and unit are settled.
    pub(super) garment: Vec<Vec<Vec3>>,
    /// Where the file has them.
    pub(super) faces: Vec<[u32; 3]>,
}

impl Sequence {
    pub(super) fn read(dataset: Dataset, path: &Path, character: &Character) -> Result<Self> {
        let sequence = match dataset {
            Dataset::Vto => vto::read(path, character)?,
            Dataset::VirtualBones => virtual_bones::read(path, character)?,
        };
        if sequence.garment.first().is_none_or(Vec::is_empty) {
            return Err(Error::content(
                path,
                "a garment of vertices in every frame",
                "none",
            ));
        }
        let finite = |p: &Vec3| p.is_finite();
        let poses = &sequence.clip.poses;
        if !poses.iter().all(Pose::is_valid) || !sequence.garment.iter().flatten().all(finite) {
            return Err(Error::content(path, "finite numbers", "others"));
        }
        Ok(sequence)
    }
}

/// Sequences of a folder or one below it that the archive unpacks to, by name.
pub(super) fn files(dataset: Dataset, folder: &Path) -> Result<Vec<PathBuf>> {
    let simulations = folder.join("simulations");
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
    files.sort();
    Ok(files)
}

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

/// A frame of axis-angle rotations on a character: its own joints, or the body's of a model with fingers on SMPL's 24.
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
    rotations.resize(joints, Vec3::ZERO);
    Ok(Pose::from_axis_angles(trans, &rotations))
}

/// Frames of `vertices` positions.
pub(super) fn frames(numbers: &[f64], vertices: usize) -> Vec<Vec<Vec3>> {
    let point = |p: &[f64]| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32);
    let frames = numbers.chunks_exact(3 * vertices.max(1));
    frames
        .map(|frame| frame.chunks_exact(3).map(point).collect())
        .collect()
}
