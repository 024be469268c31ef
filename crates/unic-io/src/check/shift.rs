//! Check for a garment that moves before or after its body.

use crate::{
    capture::{Capture, CapturedClip},
    finding::Finding,
};
use glam::Vec3;

/// Longest shift that is searched, seconds.
const MAX_SHIFT_S: f32 = 1.0;
/// Shortest shift that is reported, seconds: two frames at 30 fps. Cloth itself lags by less.
const MIN_SHIFT_S: f32 = 0.06;
/// Number of vertices that the centroid is taken of.
const SAMPLES: usize = 200;
/// Difference up to which centroids agree, metres.
const MAX_AGREEMENT_M: f32 = 0.01;
/// Largest share of the difference that the right shift leaves.
const MAX_RESIDUAL: f32 = 0.35;

/// Checks whether the garment's centroid follows the skinned centroid better when it is moved in
/// time.
pub(super) fn time_shift(capture: &Capture, clip: &CapturedClip) -> Option<Finding> {
    let (garment, skinned) = (centroids(clip), skinned_centroids(capture, clip));
    let frames = garment.len();
    let fewest = (MIN_SHIFT_S * clip.clip.fps).ceil() as usize;
    // At most a third of the clip, so that the difference is averaged over enough frames.
    let most = ((MAX_SHIFT_S * clip.clip.fps) as usize).min(frames / 3) as isize;
    if frames < 4 * fewest {
        return None;
    }
    let unshifted = difference(&garment, &skinned, 0);
    let best = (-most..=most)
        .map(|lag| (difference(&garment, &skinned, lag), lag))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (shifted, lag) = best;
    let is_unexplained = unshifted < MAX_AGREEMENT_M || shifted > MAX_RESIDUAL * unshifted;
    if is_unexplained || lag.unsigned_abs() < fewest.max(1) {
        return None;
    }
    let late = if lag > 0 { "after" } else { "before" };
    Some(Finding::new(
        format!("clip `{}`", clip.clip.name),
        format!(
            "a garment that moves about {} frames {late} its body",
            lag.unsigned_abs()
        ),
        "another first frame of the animation or of the cache",
        "cut both at the same frame",
    ))
}

/// Returns the standard deviation of garment(t + lag) − skinned(t), metres.
///
/// The mean is taken out, because a garment's centroid may be off the skinned one by a constant.
fn difference(garment: &[Vec3], skinned: &[Vec3], lag: isize) -> f32 {
    let frames = garment.len() as isize;
    // Only frames that exist on both sides of the shift.
    let range = (-lag).max(0)..(frames - lag).min(frames);
    let apart: Vec<Vec3> = range
        .map(|t| garment[(t + lag) as usize] - skinned[t as usize])
        .collect();
    let count = apart.len().max(1) as f32;
    let mean = apart.iter().sum::<Vec3>() / count;
    (apart.iter().map(|d| d.distance_squared(mean)).sum::<f32>() / count).sqrt()
}

fn stride(vertices: usize) -> usize {
    vertices.div_ceil(SAMPLES).max(1)
}

fn mean(points: impl Iterator<Item = Vec3>) -> Vec3 {
    let (sum, count) = points.fold((Vec3::ZERO, 0), |(sum, count), point| (sum + point, count + 1));
    sum / count.max(1) as f32
}

/// Centroids of the captured garment, one for each frame.
fn centroids(clip: &CapturedClip) -> Vec<Vec3> {
    let stride = stride(clip.garment.vertex_count());
    (0..clip.clip.len())
        .map(|t| mean(clip.garment.frame(t).iter().copied().step_by(stride)))
        .collect()
}

/// Centroids of the skinned rest shape at the same vertices, one for each frame.
fn skinned_centroids(capture: &Capture, clip: &CapturedClip) -> Vec<Vec3> {
    let (skeleton, garment) = (&capture.character.skeleton, &capture.garment);
    let stride = stride(garment.rest.vertices.len());
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    let mut at = |pose| {
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        let vertices = garment.rest.vertices.iter().enumerate().step_by(stride);
        mean(vertices.map(|(v, rest)| garment.weights.position(v, *rest, &transforms)))
    };
    clip.clip.poses.iter().map(&mut at).collect()
}
