//! Finding the phases in which a foot stands, and the height of the ground.

use super::{
    foot::{Foot, speed, tracks},
    held::FADE_SECONDS,
};
use glam::Vec3;
use std::ops::Range;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Speed of the ball of a foot below which the foot may stand, m/s. Planted feet drift by less;
/// swinging feet exceed 1 m/s.
const STANDING_SPEED: f32 = 0.35;

/// Largest vertical distance of a standing ball from its height at rest, metres.
const STANDING_HEIGHT: f32 = 0.04;

/// Shortest phase that counts, seconds.
const MIN_PHASE_SECONDS: f32 = 0.1;
/// Longest interruption that does not end a phase, seconds.
const MAX_GAP_SECONDS: f32 = 0.05;

/// Horizontal drift from the start of a phase at which a new phase begins, metres.
const MAX_DRIFT: f32 = 0.04;

/// Estimates the height of the ground: the median height of the lower foot's sole over the frames
/// in which it is slow.
///
/// Jumps and swings are fast and do not count. The median leaves as many soles a little above the
/// ground as below.
pub(super) fn ground_height(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> f32 {
    let tracks = tracks(clip, skeleton, feet);
    let lowest = |frame: usize| {
        let soles = tracks.iter().zip(feet).map(|(track, foot)| {
            let height = track.balls[frame].y - foot.ball_height;
            (height, speed(&track.balls, frame, clip.fps))
        });
        // The lower foot carries the body.
        soles.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut all: Vec<(f32, f32)> = (0..clip.len()).filter_map(lowest).collect();
    // A clip without a slow frame, such as a slide, uses all of its frames.
    if all.iter().any(|(_, speed)| *speed < STANDING_SPEED) {
        all.retain(|(_, speed)| *speed < STANDING_SPEED);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.get(all.len() / 2).map_or(0.0, |(height, _)| *height)
}

/// Returns the ranges of frames in which the ball of a foot stands at `height`.
pub(super) fn phases(balls: &[Vec3], height: f32, fps: f32) -> Vec<Range<usize>> {
    let stands =
        |t: usize| speed(balls, t, fps) < STANDING_SPEED && (balls[t].y - height).abs() < STANDING_HEIGHT;
    let mut found: Vec<Range<usize>> = Vec::new();
    for t in (0..balls.len()).filter(|&t| stands(t)) {
        match found.last_mut() {
            Some(last) if (t - last.end) as f32 <= MAX_GAP_SECONDS * fps => last.end = t + 1,
            _ => found.push(t..t + 1),
        }
    }
    // At low frame rates the shortest phase would be a single frame, which has no duration.
    let long = |phase: &Range<usize>| phase.len() as f32 >= MIN_PHASE_SECONDS * fps && phase.len() > 1;
    let parts = found
        .into_iter()
        .flat_map(|phase| split_at_drift(balls, phase, fps));
    parts.filter(long).collect()
}

/// Splits a phase where the foot has drifted away, with a gap to fade between the parts.
fn split_at_drift(balls: &[Vec3], phase: Range<usize>, fps: f32) -> Vec<Range<usize>> {
    let margin = (0.5 * FADE_SECONDS * fps).ceil() as usize;
    let (mut parts, mut start) = (Vec::new(), phase.start);
    for t in phase.clone() {
        if t >= start && (balls[t] - balls[start]).reject_from(Vec3::Y).length() > MAX_DRIFT {
            parts.push(start..t.saturating_sub(margin).max(start));
            start = t + margin;
        }
    }
    if start < phase.end {
        parts.push(start..phase.end);
    }
    parts
}
