//! Contract: planted feet stay in place, and no sole sinks into the ground.

use super::figure::{bodies, every_kind, joints, lowest, perform};
use crate::motion::{Performance, Side};
use glam::Vec2;
use unic_core::character::Character;

const FPS: f32 = 60.0;

/// Largest allowed displacement of the ball of a foot while it lies on the ground, metres.
const MOST_SLIDE: f32 = 0.005;

/// Largest allowed mean speed of the ball of a foot while it lies on the ground, m/s.
const MOST_MEAN_SPEED: f32 = 0.02;

#[test]
fn planted_feet_do_not_slide() {
    for body in bodies() {
        let motion = perform(&body, every_kind());
        for side in Side::BOTH {
            let stances = stances(&body, &motion, side);
            assert!(stances.len() > 20, "{} stances", stances.len());
            let slide = stances.iter().map(|s| spread(s)).fold(0.0, f32::max);
            assert!(slide < MOST_SLIDE, "{side:?}: {slide} m");
            let speed = mean_speed(&stances);
            assert!(speed < MOST_MEAN_SPEED, "{side:?}: {speed} m/s");
            println!(
                "{side:?}: largest slide {:.2} mm, mean {:.2} mm/s",
                slide * 1e3,
                speed * 1e3
            );
        }
    }
}

/// Ground positions of the ball of the foot by frame, one list for each stance.
fn stances(body: &Character, motion: &Performance, side: Side) -> Vec<Vec<Vec2>> {
    let ball = 10 + usize::from(side == Side::Right);
    let ground = body
        .body
        .vertices
        .iter()
        .map(|v| v.y)
        .fold(f32::INFINITY, f32::min);
    let rest = body.skeleton.joints()[ball].y - ground;
    let clip = motion.clip("", FPS);
    let mut stances: Vec<Vec<Vec2>> = vec![Vec::new()];
    for (f, pose) in clip.poses.iter().enumerate() {
        let at = joints(body, pose)[ball].translation;
        if !motion.is_planted(side, f as f32 / FPS) || at.y > rest + 0.005 {
            stances.push(Vec::new());
        } else if let Some(stance) = stances.last_mut() {
            stance.push(Vec2::new(at.x, at.z));
        }
    }
    stances.retain(|s| s.len() > 1);
    stances
}

fn spread(stance: &[Vec2]) -> f32 {
    stance.iter().map(|p| p.distance(stance[0])).fold(0.0, f32::max)
}

fn mean_speed(stances: &[Vec<Vec2>]) -> f32 {
    let steps: Vec<f32> = (stances.iter())
        .flat_map(|s| s.windows(2).map(|w| w[0].distance(w[1])))
        .collect();
    steps.iter().sum::<f32>() / steps.len() as f32 * FPS
}

#[test]
fn soles_do_not_sink_and_planted_feet_touch_the_ground() {
    for body in bodies() {
        let motion = perform(&body, every_kind());
        let clip = motion.clip("", FPS);
        let mut least = f32::INFINITY;
        for (f, pose) in clip.poses.iter().enumerate() {
            let height = lowest(&body, pose);
            least = least.min(height);
            let t = f as f32 / FPS;
            let is_planted = Side::BOTH.iter().any(|&side| motion.is_planted(side, t));
            assert!(height > -0.005, "{height} m at {t} s");
            assert!(!is_planted || height < 0.012, "{height} m at {t} s, planted");
        }
        println!("lowest sole {:.2} mm", least * 1e3);
    }
}
