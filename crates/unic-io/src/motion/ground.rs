//! Standing a body on the ground.

use glam::Vec3;
use unic_core::{character::Character, clip::Clip};

/// Frames looked at: enough for every phase of a gait, few enough to be quick.
const FRAMES_LOOKED_AT: usize = 256;

/// Which of the frames' lowest points is the ground: most frames of most motions touch it, jumps
/// lift the others, and a foot may sink in a few.
const QUANTILE: f32 = 0.1;

/// Below this a shift is not worth a word, metres.
const SILENT: f32 = 5e-4;

/// Moves a clip vertically so that the body's lowest point touches y = 0.
pub(super) fn seat(clip: &mut Clip, character: &Character, notes: &mut Vec<String>) {
    let Some(lowest) = ground_of(clip, character) else {
        return;
    };
    clip.poses.iter_mut().for_each(|pose| pose.trans.y -= lowest);
    clip.ground_height = 0.0;
    if lowest.abs() > SILENT {
        let direction = if lowest > 0.0 { "lowered" } else { "raised" };
        let shift = lowest.abs();
        notes.push(format!(
            "{direction} by {shift:.3} m so that this body stands on the ground"
        ));
    }
}

/// Height of the ground that the body walks on, metres.
fn ground_of(clip: &Clip, character: &Character) -> Option<f32> {
    let stride = clip.len().div_ceil(FRAMES_LOOKED_AT).max(1);
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
    let at = (lowest.len() as f32 * QUANTILE) as usize;
    lowest.get(at).copied().filter(|y| y.is_finite())
}
