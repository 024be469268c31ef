//! Target positions of held feet.

use super::foot::{Foot, FootTrack};
use glam::Vec3;
use std::ops::Range;

/// Duration in which a correction fades in and out, seconds: much less than a swing of the leg.
pub(super) const FADE_SECONDS: f32 = 0.15;

/// Returns the target positions of ball and ankle: held in the phases, and faded between them.
pub(super) fn held_track(track: &FootTrack, foot: &Foot, phases: &[Range<usize>], fps: f32) -> FootTrack {
    let corrections = corrections(&track.balls, foot.ball_height, phases, fps);
    let (mut balls, mut ankles) = (Vec::new(), Vec::new());
    for ((ball, ankle), correction) in track.balls.iter().zip(&track.ankles).zip(corrections) {
        let mut ball_held = ball + correction;
        ball_held.y = ball_held.y.max(foot.ball_height);
        // The foot moves as a whole. A heel that would sink rotates the foot about its ball, so
        // that the distance of ball and ankle stays.
        let mut ankle_held = ankle + (ball_held - ball);
        ankle_held.y = ankle_held.y.max(foot.ankle_height);
        let along = (ankle_held - ball_held).normalize_or(Vec3::Y);
        ankles.push(ball_held + along * ball.distance(*ankle));
        balls.push(ball_held);
    }
    FootTrack { balls, ankles }
}

/// Returns the displacements that hold the ball of a foot in its phases and fade between them.
fn corrections(balls: &[Vec3], height: f32, phases: &[Range<usize>], fps: f32) -> Vec<Vec3> {
    let mut corrections = vec![Vec3::ZERO; balls.len()];
    for phase in phases {
        let standing = &balls[phase.clone()];
        let mut anchor = standing.iter().sum::<Vec3>() / standing.len() as f32;
        // The mean height carries the errors of the recording; the ground is known.
        anchor.y = height;
        for (correction, ball) in corrections[phase.clone()].iter_mut().zip(standing) {
            *correction = anchor - ball;
        }
    }
    let ends = phases.iter().map(|p| p.end - 1);
    let starts = phases.iter().map(|p| p.start).skip(1);
    for (end, start) in ends.zip(starts) {
        fade(&mut corrections, Some(end), Some(start), fps);
    }
    // Before the first phase and behind the last one there is one end only.
    fade(&mut corrections, None, phases.first().map(|p| p.start), fps);
    fade(&mut corrections, phases.last().map(|p| p.end - 1), None, fps);
    corrections
}

/// Fills the corrections between `end`, the last frame of a phase, and `start`, the first of the
/// next.
fn fade(corrections: &mut [Vec3], end: Option<usize>, start: Option<usize>, fps: f32) {
    if end.is_none() && start.is_none() {
        return;
    }
    let frames = (FADE_SECONDS * fps).max(1.0);
    let range = end.map_or(0, |e| e + 1)..start.unwrap_or(corrections.len());
    for t in range {
        let weight = |from: Option<usize>| {
            let away = from.map_or(1.0, |f| (t.abs_diff(f) as f32 / frames).min(1.0));
            // Smoothstep: the correction has no kink at either end of the fade.
            let gone = away * away * (3.0 - 2.0 * away);
            (1.0 - gone, from.map_or(Vec3::ZERO, |f| corrections[f]))
        };
        let ((before, a), (after, b)) = (weight(end), weight(start));
        // In a gap shorter than two fades the weights overlap. Their sum is limited to one.
        corrections[t] = (a * before + b * after) / (before + after).max(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_hold_in_phases_and_fade_between_them() {
        let fps = 30.0;
        let balls: Vec<Vec3> = (0..60).map(|t| Vec3::X * 0.01 * t as f32).collect();
        let found = corrections(&balls, 0.02, &[10..20, 40..50], fps);
        for phase in [10..20, 40..50] {
            let held: Vec<Vec3> = phase.map(|t| balls[t] + found[t]).collect();
            assert!(
                held.iter()
                    .all(|p| p.distance(held[0]) < 1e-6 && (p.y - 0.02).abs() < 1e-6)
            );
        }
        assert_eq!(
            (found[0], found[30], found[59]),
            (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO)
        );
        let steps = found.windows(2).map(|w| w[0].distance(w[1]));
        assert!(steps.fold(0.0, f32::max) < 0.025);
    }
}
