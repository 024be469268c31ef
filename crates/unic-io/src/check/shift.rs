//! A garment that moves before or after its body.

use super::Finding;
use crate::capture::{Capture, CapturedClip};
use glam::Vec3;

/// Longest shift that is looked for, seconds.
const LONGEST_S: f32 = 1.0;
/// Shorter ones are the cloth's own lag, seconds: two frames at 30 fps.
const SHORTEST_S: f32 = 0.06;
/// Vertices whose mean tells where the garment is.
const SAMPLES: usize = 200;
/// Centroids that differ by less agree, metres.
const AGREE_M: f32 = 0.01;
/// The right shift leaves at most this part of the difference.
const LEFT: f32 = 0.35;

/// Where the garment's centroid follows the skinned one best when it is moved in time.
pub(super) fn shift(capture: &Capture, clip: &CapturedClip) -> Option<Finding> {
    let (garment, skinned) = (centroids(clip), skinned_centroids(capture, clip));
    let frames = garment.len();
    let fewest = (SHORTEST_S * clip.clip.fps).ceil() as usize;
    let most = ((LONGEST_S * clip.clip.fps) as usize).min(frames / 3) as isize;
    if frames < 4 * fewest {
        return None;
    }
    let here = difference(&garment, &skinned, 0);
    let best = (-most..=most)
        .map(|lag| (difference(&garment, &skinned, lag), lag))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (there, lag) = best;
    if here < AGREE_M || there > LEFT * here || lag.unsigned_abs() < fewest.max(1) {
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

/// Standard deviation of garment(t + lag) - skinned(t), metres.
fn difference(garment: &[Vec3], skinned: &[Vec3], lag: isize) -> f32 {
    let frames = garment.len() as isize;
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

fn centroids(clip: &CapturedClip) -> Vec<Vec3> {
    let stride = stride(clip.garment.vertex_count());
    (0..clip.clip.len())
        .map(|t| mean(clip.garment.frame(t).iter().copied().step_by(stride)))
        .collect()
}

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
