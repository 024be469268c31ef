//! Heading: the direction in which a character faces, in every pose of its body.
//!
//! For training and evaluation; the motion vector is made from it.
//!
//! The yaw of a single pose is undefined for a body upside down, and jumps by 180° near there.
//! [`Heading`] is therefore a state. It integrates the root's yaw rate, which is always defined,
//! and is corrected towards the yaw of the current pose as far as that is well determined. It is
//! continuous through cartwheels, rolls and falls, and exact again once the body is upright.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::{PI, TAU};

/// Time constant of the correction towards the pose's own yaw for an upright body, seconds: an
/// error of 180° is below 2° half a second later.
pub const CORRECTION_TIME_S: f32 = 0.1;

/// Certainty of the yaw below which a cold start takes the projected forward direction instead: the
/// body is within 4° of upside down.
pub const MIN_CERTAINTY: f32 = 1e-3;

/// Yaw about +Y of the frame in which a character's motion is described. At yaw 0 the character
/// faces +Z, at +π/2 it faces +X.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Yaw, radians, in −π..=π.
    yaw: f32,
}

impl Heading {
    /// Starts from `root`, the root joint's `world_from_joint` rotation, without a frame before.
    ///
    /// For an upright body the heading is the projection of the root's +Z onto the ground. For a
    /// body on its back it is the direction away from the head, and on its front the direction of
    /// the head: the way it faced if it fell straight. Exactly upside down these rules disagree,
    /// and the heading is the projected +Z.
    pub fn start(root: Quat) -> Self {
        let UprightYaw { yaw, certainty } = upright_yaw(root);
        let forward = root * Vec3::Z;
        let yaw = if certainty < MIN_CERTAINTY {
            forward.x.atan2(forward.z)
        } else {
            yaw
        };
        Self { yaw: finite(yaw) }
    }

    /// Advances to the next frame, `dt` seconds later.
    ///
    /// The heading turns by the yaw of the world rotation from `previous_root` to `root`. Then it
    /// moves towards `root`'s own yaw at the rate ((1 + cos tilt) / 2)² / 0.1 s, which vanishes as
    /// the body turns upside down. Rotations that are not finite leave the heading as it is.
    pub fn advance(&mut self, previous_root: Quat, root: Quat, dt: f32) {
        let turned = self.yaw + rotation_vector(root * previous_root.conjugate()).y;
        let UprightYaw {
            yaw: target,
            certainty,
        } = upright_yaw(root);
        // The exact solution of the decay over dt, so that the result hardly depends on the frame
        // rate.
        let gain = 1.0 - (-certainty * certainty * dt.max(0.0) / CORRECTION_TIME_S).exp();
        let yaw = wrapped(turned + gain * wrapped(target - turned));
        if yaw.is_finite() {
            self.yaw = yaw;
        }
    }

    /// Returns whether the yaw is finite. The yaw of a heading from a file may be any number.
    pub fn is_finite(&self) -> bool {
        self.yaw.is_finite()
    }

    /// Rotation by the yaw about +Y: `world_from_frame`.
    pub fn rotation(&self) -> Quat {
        Quat::from_rotation_y(self.yaw)
    }
}

/// Yaw of a single pose.
struct UprightYaw {
    /// Yaw of the rotation about +Y that is closest to the root's, radians.
    yaw: f32,
    /// Certainty of the yaw, (1 + cos tilt) / 2: 1 upright, 0 upside down.
    certainty: f32,
}

/// Computes the yaw of a root rotation: the twist about +Y of its swing-twist decomposition.
///
/// It is the direction of the sum of two projections onto the ground: of the root's +Z, and of its
/// +X turned by 90°. One of them is long whenever the other is short, so a body on its back or
/// front is no special case. Upside down the two cancel.
fn upright_yaw(root: Quat) -> UprightYaw {
    UprightYaw {
        yaw: wrapped(2.0 * root.y.atan2(root.w)),
        certainty: root.y * root.y + root.w * root.w,
    }
}

/// Sine of half an angle below which a rotation vector is the limit for small angles.
pub const SMALL_HALF_SINE: f32 = 1e-8;

/// Axis times angle of a unit quaternion, the angle in 0..=π radians.
///
/// Both signs of a quaternion give the same vector: a rotation by a small negative angle is not one
/// by almost a full turn.
pub(crate) fn rotation_vector(rotation: Quat) -> Vec3 {
    let positive = if rotation.w < 0.0 { -rotation } else { rotation };
    let half_sine = positive.xyz().length();
    // The limit for small angles, where the quotient below is 0 / 0.
    if half_sine < SMALL_HALF_SINE {
        return positive.xyz() * 2.0;
    }
    // The arc tangent is exact at all angles, unlike the arc cosine of w near zero.
    positive.xyz() * (2.0 * half_sine.atan2(positive.w) / half_sine)
}

/// Wraps an angle to −π..=π.
// Rounding may lead beyond ±π by one bit, hence the clamp.
fn wrapped(angle: f32) -> f32 {
    (angle - TAU * (angle / TAU).round()).clamp(-PI, PI)
}

fn finite(yaw: f32) -> f32 {
    if yaw.is_finite() { yaw } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f32::consts::FRAC_PI_2;

    const DEGREE: f32 = PI / 180.0;

    /// Yaw in every frame of a motion given as a function of seconds.
    fn yaws(seconds: f32, fps: f32, root: impl Fn(f32) -> Quat) -> Vec<f32> {
        let mut heading = Heading::start(root(0.0));
        let mut yaws = vec![heading.yaw];
        for frame in 1..=(seconds * fps) as usize {
            let [before, now] = [frame - 1, frame].map(|f| root(f as f32 / fps));
            heading.advance(before, now, 1.0 / fps);
            yaws.push(heading.yaw);
        }
        yaws
    }

    fn assert_stays(yaws: &[f32], expected: f32, tolerance: f32) {
        for (frame, &yaw) in yaws.iter().enumerate() {
            let error = wrapped(yaw - expected).abs();
            assert!(error < tolerance, "frame {frame}: {yaw}, not {expected}");
        }
    }

    /// Forward roll into a handstand, then down over the side: no yaw rate at any moment, and yet
    /// the body stands up facing the other way.
    fn over_the_top(t: f32) -> Quat {
        let up = Quat::from_rotation_x(PI * t.clamp(0.0, 1.0));
        Quat::from_rotation_z(PI * (t - 1.0).clamp(0.0, 1.0)) * up
    }

    #[test]
    fn a_cartwheel_and_full_rolls_leave_the_heading_alone() {
        for axis in [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z] {
            for yaw in [0.0, 1.0, -3.0] {
                let facing = Quat::from_rotation_y(yaw);
                let roll = |t: f32| facing * Quat::from_axis_angle(axis, TAU * t.min(1.0));
                assert_stays(&yaws(2.0, 30.0, roll), yaw, 1e-3);
            }
        }
    }

    #[test]
    fn lying_still_has_the_heading_that_the_body_fell_from() {
        for (yaw, fall) in [(0.7, FRAC_PI_2), (0.7, -FRAC_PI_2), (-2.5, FRAC_PI_2)] {
            let lying = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(fall);
            assert_stays(&yaws(60.0, 30.0, |_| lying), yaw, 1e-3);
            let breathing = |t: f32| lying * Quat::from_rotation_x(0.1 * (4.0 * t).sin());
            assert_stays(&yaws(60.0, 30.0, breathing), yaw, 1e-3);
        }
    }

    #[test]
    fn leaning_forwards_or_backwards_does_not_change_the_start() {
        for lean in -17..=17 {
            let root = Quat::from_rotation_y(2.0) * Quat::from_rotation_x(lean as f32 * 10.0 * DEGREE);
            assert!((Heading::start(root).yaw - 2.0).abs() < 1e-3, "{lean}0 degrees");
        }
    }

    #[test]
    fn upside_down_the_start_is_the_projected_forward_direction() {
        for yaw in [-2.0, 0.0, 0.3, 2.0] {
            let facing = Quat::from_rotation_y(yaw);
            let cartwheel = Heading::start(facing * Quat::from_rotation_z(PI)).yaw;
            assert!(wrapped(cartwheel - yaw).abs() < 1e-3);
            let roll = Heading::start(facing * Quat::from_rotation_x(PI)).yaw;
            assert!(wrapped(roll - yaw - PI).abs() < 1e-3);
        }
    }

    #[test]
    fn a_spin_in_place_is_followed_frame_by_frame() {
        for rate in [-12.0, 0.5, 12.0] {
            let spin = |t: f32| Quat::from_rotation_y(rate * t) * Quat::from_rotation_x(0.2);
            for (frame, yaw) in yaws(20.0, 30.0, spin).into_iter().enumerate() {
                let error = wrapped(yaw - rate * frame as f32 / 30.0);
                assert!(error.abs() < 1e-3, "frame {frame}: off by {error}");
            }
        }
    }

    #[test]
    fn half_a_second_after_standing_up_the_heading_is_true() {
        for fps in [30.0, 60.0, 240.0] {
            let yaws = yaws(2.5, fps, over_the_top);
            assert!(
                wrapped(yaws[fps as usize]).abs() < 1.0 * DEGREE,
                "held up to the handstand"
            );
            let error = wrapped(yaws[yaws.len() - 1] - PI).abs();
            assert!(error < 2.0 * DEGREE, "{fps} fps: {error} rad");
            let step = yaws.windows(2).map(|y| wrapped(y[1] - y[0]).abs());
            let fastest = step.fold(0.0, f32::max) * fps;
            assert!(fastest < 15.0, "{fps} fps: {fastest} rad/s");
        }
    }

    #[test]
    fn the_frame_rate_hardly_matters() {
        let tumble = |t: f32| {
            Quat::from_rotation_y(1.5 * t) * over_the_top(t) * Quat::from_rotation_x((3.0 * t).sin())
        };
        let (slow, fast) = (yaws(2.5, 60.0, tumble), yaws(2.5, 480.0, tumble));
        let mut apart = slow.iter().zip(fast.iter().step_by(8));
        assert!(apart.all(|(a, b)| wrapped(a - b).abs() < 0.15));
    }

    #[test]
    fn rotations_that_are_no_numbers_are_passed_over() {
        let root = Quat::from_rotation_y(0.4);
        let mut heading = Heading::start(root);
        heading.advance(root, Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), 0.1);
        heading.advance(root, root, 0.0);
        assert!((heading.yaw - 0.4).abs() < 1e-6);
    }

    #[test]
    fn rotation_vectors_undo_scaled_axes() {
        for angle in [0.0, 1e-9, 1e-4, 1.0, 3.1] {
            let axis_angle = Vec3::new(0.6, 0.0, -0.8) * angle;
            for sign in [1.0, -1.0] {
                let vector = rotation_vector(Quat::from_scaled_axis(axis_angle) * sign);
                assert!((vector - axis_angle).length() < 2e-6, "{vector} {axis_angle}");
            }
        }
    }

    fn any_rotation() -> impl Strategy<Value = Quat> {
        [-3.0f32..3.0, -3.0..3.0, -3.0..3.0].prop_map(|v| Quat::from_scaled_axis(v.into()))
    }

    proptest! {
        /// Between any two poses the heading never outruns the yaw rate by more than π / 0.1 s, and
        /// turning the world turns it along.
        #[test]
        fn continuous_and_equivariant(a in any_rotation(), b in any_rotation(), yaw in -3.0f32..3.0) {
            let world = Quat::from_rotation_y(yaw);
            let (fps, at) = (480.0, |t: f32| a.slerp(b, t));
            let own = yaws(1.0, fps, at);
            let turned = yaws(1.0, fps, |t| world * at(t));
            // Where a pose is near upside down, rounding decides the first heading.
            prop_assume!(upright_yaw(a).certainty > 0.01);
            for (frame, (o, t)) in own.iter().zip(&turned).enumerate() {
                prop_assert!(wrapped(t - o - yaw).abs() < 0.02, "frame {frame}: {o} {t}");
            }
            for (frame, y) in own.windows(2).enumerate() {
                let (before, now) = (at(frame as f32 / fps), at((frame + 1) as f32 / fps));
                let physical = rotation_vector(now * before.conjugate()).y;
                let excess = wrapped(y[1] - y[0] - physical).abs() * fps;
                prop_assert!(excess < PI / CORRECTION_TIME_S, "frame {frame}: {excess} rad/s");
            }
        }
    }
}
