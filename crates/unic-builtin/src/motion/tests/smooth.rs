//! Contract: motions start and end at rest, joints turn no faster than people can turn them, and
//! accelerations are continuous.

use super::figure::{bodies, every_kind, figure, perform, travel};
use crate::motion::Performance;
use unic_core::Pose;

/// Largest allowed rate of any joint, rad/s: 1.5 times the 20 rad/s typical of a sprinter's knee.
const FASTEST_JOINT: f32 = 30.0;

/// Largest rate of a joint between two poses, rad/s.
fn fastest(a: &Pose, b: &Pose, seconds: f32) -> f32 {
    // The root turns with the whole body and has no joint's limit.
    let angles = (a.local.iter().zip(&b.local).skip(1)).map(|(a, b)| a.angle_between(*b));
    angles.fold(0.0, f32::max) / seconds
}

#[test]
fn joints_stay_within_physiological_rates() {
    for body in bodies() {
        let clip = perform(&body, every_kind()).clip("", 120.0);
        let mut most = (0.0, 0.0);
        for (f, pair) in clip.poses.windows(2).enumerate() {
            assert!(pair[0].is_valid());
            let rate = fastest(&pair[0], &pair[1], 1.0 / 120.0);
            most = if rate > most.0 {
                (rate, f as f32 / 120.0)
            } else {
                most
            };
        }
        println!("fastest joint {:.1} rad/s at {:.2} s", most.0, most.1);
        assert!(most.0 < FASTEST_JOINT, "{} rad/s at {} s", most.0, most.1);
    }
}

#[test]
fn motions_start_and_end_at_rest() {
    for body in bodies() {
        let motion = perform(&body, [travel(3.0, 0.3, 5.0)]);
        let end = motion.seconds();
        for (a, b) in [(0.0, 0.02), (end - 0.02, end)] {
            let (a, b) = (motion.pose_at(a), motion.pose_at(b));
            assert!(a.trans.distance(b.trans) < 0.02 * 0.02);
            assert!(fastest(&a, &b, 0.02) < 0.05);
        }
    }
}

/// Largest change of the pelvis's vertical acceleration from one sample to the next.
fn largest_jump(motion: &Performance, rate: f64, from: f64, to: f64) -> f64 {
    let height = |i: i64| f64::from(motion.pose_at((i as f64 / rate) as f32).trans.y);
    let third = |i: i64| height(i + 3) - 3.0 * height(i + 2) + 3.0 * height(i + 1) - height(i);
    let frames = (from * rate) as i64..(to * rate) as i64;
    frames.map(|i| (third(i) * rate * rate).abs()).fold(0.0, f64::max)
}

#[test]
fn the_acceleration_of_the_pelvis_is_continuous() {
    for speed in [1.4, 3.0] {
        let motion = perform(&figure(), [travel(speed, 0.0, 6.0)]);
        // Halving the interval halves the change of a continuous acceleration; a jump would stay.
        let [coarse, fine] = [120.0, 240.0].map(|rate| largest_jump(&motion, rate, 0.5, 7.0));
        assert!(fine < 0.75 * coarse, "{speed} m/s: {coarse} then {fine} m/s2");
    }
}
