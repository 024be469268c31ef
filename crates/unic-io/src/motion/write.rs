//! Writing motion files.

use super::arrays::{GROUND_HEIGHT_NAME, WIND_NAME};
use crate::{error::Result, joint_names::ARRAY_NAME as JOINT_NAMES, npz::NpzWriter};
use glam::{Quat, Vec3};
use std::path::Path;
use unic_core::clip::Clip;

/// Writes a clip as an npz that [`import_motion`](super::import_motion) reads, atomically.
///
/// The arrays are `poses` (T, 3J), `trans` (T, 3), `mocap_framerate`, `ground_height`, and if there
/// are any `joint_names` (J) and `wind` (T, 3).
///
/// # Errors
/// The file cannot be written.
pub fn write_motion(path: &Path, clip: &Clip, joint_names: &[String]) -> Result<()> {
    let mut npz = NpzWriter::create(path)?;
    write_arrays(&mut npz, clip, joint_names)?;
    npz.finish()
}

/// Adds the arrays of [`write_motion`] to an npz.
pub(crate) fn write_arrays(npz: &mut NpzWriter, clip: &Clip, joint_names: &[String]) -> Result<()> {
    let joints = clip.poses.first().map_or(0, |p| p.local.len());
    let trans: Vec<Vec3> = clip.poses.iter().map(|p| p.trans).collect();
    let rotations: Vec<Vec3> = (clip.poses.iter())
        .flat_map(|p| p.local.iter().map(|&q| axis_angle(q)))
        .collect();
    npz.f32s(
        "poses",
        &[clip.len(), 3 * joints],
        bytemuck::cast_slice(&rotations),
    )?;
    npz.f32s("trans", &[clip.len(), 3], bytemuck::cast_slice(&trans))?;
    // Still air needs no array.
    if !clip.wind.is_empty() {
        npz.f32s(WIND_NAME, &[clip.wind.len(), 3], bytemuck::cast_slice(&clip.wind))?;
    }
    if !joint_names.is_empty() {
        npz.text(JOINT_NAMES, joint_names)?;
    }
    npz.f64s("mocap_framerate", &[], &[f64::from(clip.fps)])?;
    npz.f64s(GROUND_HEIGHT_NAME, &[], &[f64::from(clip.ground_height)])
}

/// Returns the rotation vector of at most half a turn, radians.
fn axis_angle(rotation: Quat) -> Vec3 {
    // Of q and −q, the same rotation, the one with w ≥ 0 has the shorter rotation vector.
    let nearest = if rotation.w < 0.0 { -rotation } else { rotation };
    nearest.to_scaled_axis()
}
