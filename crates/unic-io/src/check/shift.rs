//! Check for a garment that moves before or after its body.

use crate::{
    capture::{Capture, CapturedClip},
    finding::Finding,
};
use glam::Vec3;

/// Longest shift that is searched, seconds.
const MAX_SHIFT_S: f32 = 1.0;
/// Shortest shift that is reported, seconds: two frames at 30 fps. Tight cloth lags by less.
const MIN_SHIFT_S: f32 = 0.06;
/// Number of vertices that are followed.
const SAMPLES: usize = 200;
/// Difference up to which centroids agree, metres.
const MAX_AGREEMENT_M: f32 = 0.01;
/// Largest share of the difference that the right shift leaves.
const MAX_RESIDUAL: f32 = 0.35;
/// Largest share of the vertices that may be on time in a clip that is shifted. The hem of a skirt
/// lags by several frames; its waistband is on time, as is hardly a vertex of a shifted clip.
const MAX_ON_TIME: f32 = 0.1;

/// Checks whether the garment follows the skinned rest shape better when it is moved in time: its
/// centroid, and nearly all of its vertices.
pub(super) fn time_shift(capture: &Capture, clip: &CapturedClip) -> Option<Finding> {
    let (garment, skinned) = (paths(clip), skinned_paths(capture, clip));
    let lag = lag(&mean(&garment), &mean(&skinned), clip.clip.fps)?;
    // Cloth lags, and never leads.
    if lag > 0 && on_time(&garment, &skinned, lag) > MAX_ON_TIME {
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

/// Returns the number of frames that the garment is late, if such a shift explains how its centroid
/// differs from the skinned one.
fn lag(garment: &[Vec3], skinned: &[Vec3], fps: f32) -> Option<isize> {
    let frames = garment.len();
    let fewest = (MIN_SHIFT_S * fps).ceil() as usize;
    // At most a third of the clip, so that the difference is averaged over enough frames.
    let most = ((MAX_SHIFT_S * fps) as usize).min(frames / 3) as isize;
    if frames < 4 * fewest {
        return None;
    }
    let unshifted = difference(garment, skinned, 0);
    let (shifted, lag) = (-most..=most)
        .map(|lag| (difference(garment, skinned, lag), lag))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_unexplained = unshifted < MAX_AGREEMENT_M || shifted > MAX_RESIDUAL * unshifted;
    (!is_unexplained && lag.unsigned_abs() >= fewest.max(1)).then_some(lag)
}

/// Share of the vertices that follow the skinned ones better as they are than moved by `lag`.
fn on_time(garment: &[Path], skinned: &[Path], lag: isize) -> f32 {
    let is_on_time = |(g, s): &(&Path, &Path)| difference(g, s, 0) < difference(g, s, lag);
    let count = garment.iter().zip(skinned).filter(is_on_time).count();
    count as f32 / garment.len().max(1) as f32
}

/// Returns the standard deviation of garment(t + lag) − skinned(t), metres.
///
/// The mean is taken out, because cloth may be off its skinned position by a constant.
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

/// Positions of one vertex, one for each frame.
type Path = Vec<Vec3>;

/// Evenly spread vertices of a garment, [`SAMPLES`] at most.
fn sampled(vertices: usize) -> impl Iterator<Item = usize> {
    (0..vertices).step_by(vertices.div_ceil(SAMPLES).max(1))
}

/// Mean of the paths: the centroid's path.
fn mean(paths: &[Path]) -> Path {
    let frames = paths.first().map_or(0, Vec::len);
    let sum = |t: usize| paths.iter().map(|path| path[t]).sum::<Vec3>();
    let count = paths.len().max(1) as f32;
    (0..frames).map(|t| sum(t) / count).collect()
}

/// Paths of the captured garment's sampled vertices.
fn paths(clip: &CapturedClip) -> Vec<Path> {
    let frames = clip.clip.len();
    let path = |v: usize| (0..frames).map(|t| clip.garment.frame(t)[v]).collect();
    sampled(clip.garment.vertex_count()).map(path).collect()
}

/// Paths of the same vertices of the skinned rest shape.
fn skinned_paths(capture: &Capture, clip: &CapturedClip) -> Vec<Path> {
    let (skeleton, garment) = (&capture.character.skeleton, &capture.garment);
    let rest = &garment.rest.vertices;
    let mut paths: Vec<Path> = sampled(rest.len()).map(|_| Vec::new()).collect();
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    for pose in &clip.clip.poses {
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        for (v, path) in sampled(rest.len()).zip(&mut paths) {
            path.push(garment.weights.position(v, rest[v], &transforms));
        }
    }
    paths
}
