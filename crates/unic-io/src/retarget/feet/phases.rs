//! When a foot stands, and on which ground.

use super::{
    FADE,
    foot::{Foot, speed, tracks},
};
use glam::Vec3;
use std::ops::Range;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Below this speed a ball of the foot may stand, m/s: planted ones drift by less, swinging ones
/// pass 1 m/s.
const STANDING_SPEED: f32 = 0.35;

/// How far above its height at rest a standing ball may be, metres.
const STANDING_HEIGHT: f32 = 0.04;

/// Shortest phase that counts, and longest interruption that does not, seconds.
const SHORTEST_PHASE: f32 = 0.1;
const LONGEST_GAP: f32 = 0.05;

/// A foot that creeps further than this from where it stood stands elsewhere, metres.
const CREEP: f32 = 0.04;

/// Median height of the lower foot's sole over the frames in which it is slow: jumps and swings do
/// not count, and as many soles are a little above as a little below.
pub(super) fn ground_height(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> f32 {
    let tracks = tracks(clip, skeleton, feet);
    let lowest = |frame: usize| {
        let soles = tracks.iter().zip(feet).map(|(track, foot)| {
            let height = track.balls[frame].y - foot.ball_height;
            (height, speed(&track.balls, frame, clip.fps))
        });
        soles.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut all: Vec<(f32, f32)> = (0..clip.len()).filter_map(lowest).collect();
    if all.iter().any(|(_, speed)| *speed < STANDING_SPEED) {
        all.retain(|(_, speed)| *speed < STANDING_SPEED);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.get(all.len() / 2).map_or(0.0, |(height, _)| *height)
}

/// Frames in which a ball of the foot stands at `height`.
pub(super) fn phases(balls: &[Vec3], height: f32, fps: f32) -> Vec<Range<usize>> {
    let stands =
        |t: usize| speed(balls, t, fps) < STANDING_SPEED && (balls[t].y - height).abs() < STANDING_HEIGHT;
    let mut found: Vec<Range<usize>> = Vec::new();
    for t in (0..balls.len()).filter(|&t| stands(t)) {
        match found.last_mut() {
            Some(last) if (t - last.end) as f32 <= LONGEST_GAP * fps => last.end = t + 1,
            _ => found.push(t..t + 1),
        }
    }
    let long = |phase: &Range<usize>| phase.len() as f32 >= SHORTEST_PHASE * fps && phase.len() > 1;
    let parts = found.into_iter().flat_map(|phase| split_creep(balls, phase, fps));
    parts.filter(long).collect()
}

/// Cuts a phase where the foot has crept away, with time to fade between the parts.
fn split_creep(balls: &[Vec3], phase: Range<usize>, fps: f32) -> Vec<Range<usize>> {
    let margin = (0.5 * FADE * fps).ceil() as usize;
    let (mut parts, mut start) = (Vec::new(), phase.start);
    for t in phase.clone() {
        if t >= start && (balls[t] - balls[start]).reject_from(Vec3::Y).length() > CREEP {
            parts.push(start..t.saturating_sub(margin).max(start));
            start = t + margin;
        }
    }
    if start < phase.end {
        parts.push(start..phase.end);
    }
    parts
}
