//! Reading a sequence of either data set.

use super::{Dataset, sequence::GarmentSequence, virtual_bones, vto};
use crate::error::{Error, Result};
use glam::Vec3;
use std::path::Path;
use unic_core::{Pose, character::Character};

impl GarmentSequence {
    /// Reads a sequence and checks that its numbers are finite.
    ///
    /// # Errors
    /// A file of another layout, a garment without vertices, numbers that are not finite.
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
        // Pickles are not checked while they are read, unlike npz files.
        let finite = |p: &Vec3| p.is_finite();
        let poses = &sequence.clip.poses;
        if !poses.iter().all(Pose::is_valid) || !sequence.garment.iter().flatten().all(finite) {
            return Err(Error::content(path, "finite numbers", "others"));
        }
        Ok(sequence)
    }
}
