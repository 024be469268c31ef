//! Placing a body on the ground.

use glam::Vec3;
use unic_core::{character::Character, clip::Clip};

/// Number of frames whose skinned bodies are examined: enough for all phases of a gait, and quick.
const SAMPLED_FRAMES: usize = 256;

/// Quantile of the frames' lowest points that is the height of the ground. Most frames of most
/// motions touch the ground; jumps are above it, and in a few frames a foot sinks below it.
const GROUND_QUANTILE: f32 = 0.1;

/// Shift below which no note is made, metres.
const MIN_NOTED_SHIFT: f32 = 5e-4;

/// Moves a clip vertically so that the body stands on y = 0.
pub(super) fn place_on_ground(clip: &mut Clip, character: &Character, notes: &mut Vec<String>) {
    let Some(lowest) = ground_height(clip, character) else {
        return;
    };
    clip.poses.iter_mut().for_each(|pose| pose.trans.y -= lowest);
    // Recorded heights of the ground refer to the old place.
    clip.ground_height = 0.0;
    if lowest.abs() > MIN_NOTED_SHIFT {
        let direction = if lowest > 0.0 { "lowered" } else { "raised" };
        let shift = lowest.abs();
        notes.push(format!(
            "{direction} by {shift:.3} m so that this body stands on the ground"
        ));
    }
}

/// Estimates the height of the ground that the body walks on, metres.
fn ground_height(clip: &Clip, character: &Character) -> Option<f32> {
    let stride = clip.len().div_ceil(SAMPLED_FRAMES).max(1);
    let (mut joints, mut transforms, mut body) = (Vec::new(), Vec::new(), Vec::new());
    let mut lowest: Vec<f32> = (clip.poses.iter().step_by(stride))
        .map(|pose| {
            character.skeleton.forward_kinematics(pose, &mut joints);
            character.skeleton.world_from_rest(&joints, &mut transforms);
            character
                .weights
                .skin(&character.body.vertices, &transforms, &mut body);
            body.iter().map(|v: &Vec3| v.y).fold(f32::INFINITY, f32::min)
        })
        .collect();
    lowest.sort_by(f32::total_cmp);
    let index = (lowest.len() as f32 * GROUND_QUANTILE) as usize;
    // A body without vertices has an infinite lowest point.
    lowest.get(index).copied().filter(|y| y.is_finite())
}
