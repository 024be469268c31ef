//! Contract: strides follow published relations, repeat, and are the same on both sides; jumps,
//! speeds and turns are as requested.

use super::figure::{bodies, figure, joints, perform, travel};
use crate::motion::{Action, Performance, Performer, Side};
use glam::{Quat, Vec3};
use unic_core::Pose;

/// Landings of the left foot between two times, seconds.
fn landings(motion: &Performance, from: f32, to: f32) -> Vec<f32> {
    let is_planted = |ms: u32| motion.is_planted(Side::Left, ms as f32 * 1e-3);
    ((from * 1e3) as u32..(to * 1e3) as u32)
        .filter(|&ms| is_planted(ms) && !is_planted(ms - 1))
        .map(|ms| ms as f32 * 1e-3)
        .collect()
}

fn stride_hz(landings: &[f32]) -> f32 {
    (landings.len() - 1) as f32 / (landings[landings.len() - 1] - landings[0])
}

#[test]
fn rhythm_and_flight_follow_speed() {
    for body in bodies() {
        let stature = Performer::new(&body).unwrap().stature();
        for speed in [0.8, 1.2, 1.8, 2.6, 3.5, 5.0] {
            let motion = perform(&body, [travel(speed, 0.0, 12.0)]);
            let gait = stature.gait(f64::from(speed), 0.0);
            let found = stride_hz(&landings(&motion, 5.0, 11.5));
            assert!(
                (f64::from(found) / gait.stride_hz - 1.0).abs() < 0.06,
                "{speed} m/s: {found} Hz"
            );
            let flies = (5000..11000).any(|ms| {
                let t = ms as f32 * 1e-3;
                Side::BOTH.iter().all(|&side| !motion.is_planted(side, t))
            });
            assert_eq!(flies, f64::from(speed) > stature.running_speed(), "{speed} m/s");
        }
    }
}

/// Compares strides a second and duty with regressions for ten men at 3 to 8 m/s (Gray, Price &
/// Jenkins, "Predicting temporal gait kinematics from running velocity").
#[test]
fn running_matches_measured_runners() {
    let stature = Performer::new(&bodies()[0]).unwrap().stature();
    for v in [3.0, 3.5, 4.0, 4.5, 5.0] {
        let gait = stature.gait(v, 0.0);
        let stride_hz = 0.026 * v * v - 0.111 * v + 1.398;
        let duty = 0.004 * v * v - 0.061 * v + 0.50;
        assert!(
            (gait.stride_hz / stride_hz - 1.0).abs() < 0.04,
            "{v} m/s: {gait:?}"
        );
        assert!((gait.duty / duty - 1.0).abs() < 0.06, "{v} m/s: {gait:?}");
    }
}

#[test]
fn a_steady_stride_repeats_and_mirrors() {
    for body in bodies() {
        for speed in [1.2, 3.2] {
            let motion = perform(&body, [travel(speed, 0.0, 14.0)]);
            let stride = 1.0 / stride_hz(&landings(&motion, 6.0, 13.0));
            for i in 0..20 {
                let t = 7.0 + 0.04 * i as f32;
                let pose = motion.pose_at(t);
                assert!(difference(&pose, &motion.pose_at(t + stride)) < 0.06);
                assert!(difference(&mirrored(&pose), &motion.pose_at(t + 0.5 * stride)) < 0.09);
            }
        }
    }
}

/// Largest angle between local rotations, radians.
fn difference(a: &Pose, b: &Pose) -> f32 {
    let angles = a.local.iter().zip(&b.local).map(|(a, b)| a.angle_between(*b));
    angles.fold(0.0, f32::max)
}

fn mirrored(pose: &Pose) -> Pose {
    const OTHER: [usize; 24] = [
        0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22,
    ];
    let reflected = |q: Quat| Quat::from_xyzw(q.x, -q.y, -q.z, q.w);
    Pose {
        trans: pose.trans * Vec3::new(-1.0, 1.0, 1.0),
        local: OTHER.map(|j| reflected(pose.local[j])).to_vec(),
    }
}

#[test]
fn a_jump_is_ballistic_and_as_high_as_requested() {
    let body = figure();
    let motion = perform(&body, [Action::Jump { height: 0.3 }]);
    let height = |t: f32| f64::from(motion.pose_at(t).trans.y);
    let airborne: Vec<f32> = (0..4000)
        .map(|ms| ms as f32 * 1e-3)
        .filter(|&t| Side::BOTH.iter().all(|&side| !motion.is_planted(side, t)))
        .collect();
    let (takeoff, landing) = (airborne[0], airborne[airborne.len() - 1]);
    let middle = 0.5 * (takeoff + landing);
    assert!((height(middle) - height(takeoff) - 0.3).abs() < 0.03);
    let h = 0.05;
    let acceleration = (height(middle + h) - 2.0 * height(middle) + height(middle - h)) / f64::from(h * h);
    assert!((acceleration + 9.81).abs() < 0.5, "{acceleration} m/s2");
}

#[test]
fn speed_and_heading_are_as_requested() {
    for body in bodies() {
        let motion = perform(&body, [travel(1.4, 0.0, 10.0)]);
        let advance = motion.pose_at(9.0).trans - motion.pose_at(5.0).trans;
        assert!((advance.z / 4.0 - 1.4).abs() < 0.05, "{advance}");
        let motion = perform(&body, [Action::TurnOnSpot { angle: 2.0 }]);
        let end = joints(&body, &motion.pose_at(motion.seconds()))[0].vector(Vec3::Z);
        assert!((end.x.atan2(end.z) - 2.0).abs() < 0.05, "{end}");
    }
}
