//! Actions on the spot: idling, turning, squats, bows, twists and bends of the trunk.
//!
//! Amounts without a comment are chosen by eye.

use super::{CLOSING_STEP_S, Composer};
use crate::motion::{
    Side,
    channel::{Channel, Interval},
};

/// Largest turning rate on the spot, rad/s.
const SPOT_RATE: f64 = 1.2;

impl Composer {
    pub(super) fn idle(&mut self, seconds: f64) {
        let end = self.now + seconds;
        self.glances(end);
        // Weight shifts from one leg to the other, each overlapping the one before.
        let (mut t, mut side) = (self.now + 0.3, self.random.sign());
        while t + 2.6 < end {
            let stay = self.random.between(2.6, 5.5).min(end - t);
            let sway = side * self.random.between(0.03, 0.055);
            let shift = Interval::new(t, t + stay);
            self.gestures.hold(Channel::Sway, shift, 1.1, sway);
            self.gestures.hold(Channel::HipTurn, shift, 1.2, -0.8 * sway);
            (t, side) = (t + stay - self.random.between(0.3, 1.0), -side);
        }
        self.now = end;
    }

    /// Adds glances to random sides until the time `end`; the chest follows a little.
    fn glances(&mut self, end: f64) {
        let mut t = self.now + self.random.between(0.4, 1.5);
        while t + 1.8 < end {
            let stay = self.random.between(1.6, 3.0).min(end - t);
            let yaw = self.random.sign() * self.random.between(0.2, 0.75);
            let glance = Interval::new(t, t + stay);
            self.gestures.hold(Channel::LookYaw, glance, 0.5, yaw);
            self.gestures.hold(Channel::Twist, glance, 0.7, 0.2 * yaw);
            let down = self.random.between(-0.1, 0.25);
            self.gestures.hold(Channel::LookDown, glance, 0.5, down);
            t += stay + self.random.between(0.3, 2.5);
        }
    }

    pub(super) fn turn(&mut self, angle: f64) {
        let ease = 0.6;
        // A constant rate w between two easings of e seconds turns by w (seconds − e).
        let seconds = (angle.abs() / SPOT_RATE + ease).max(2.0 * ease);
        let rate = angle / (seconds - ease);
        let interval = Interval::new(self.now, self.now + seconds);
        self.gestures.hold(Channel::TurnRate, interval, ease, rate);
        // The head turns first.
        let glance = Interval::new(self.now - 0.15, self.now + seconds - 0.3);
        self.gestures
            .hold(Channel::LookYaw, glance, 0.5, 0.35 * angle.signum());
        self.now += seconds + CLOSING_STEP_S;
    }

    pub(super) fn squat(&mut self, depth: f64) {
        let depth = depth.clamp(0.0, 0.6);
        let ease = self.random.between(0.9, 1.3);
        let end = self.now + 2.0 * ease + self.random.between(0.2, 0.6);
        let interval = Interval::new(self.now, end);
        self.gestures
            .hold(Channel::Crouch, interval, ease, depth * self.stature.leg);
        // The pelvis moves back while trunk and arms move forward: the weight stays over the feet.
        self.gestures
            .hold(Channel::Shift, interval, ease, -0.20 * depth * self.stature.leg);
        self.gestures.hold(Channel::Lean, interval, ease, 1.3 * depth);
        self.gestures
            .hold(Channel::LookDown, interval, ease, -0.3 * depth);
        for side in Side::BOTH {
            self.gestures
                .hold(Channel::Flexion(side), interval, ease, 1.6 * depth);
        }
        self.now = interval.end + 0.3;
    }

    /// Moves a channel by `angle` to a random side and then to the other, radians.
    pub(super) fn both_sides(&mut self, channel: Channel, angle: f64) {
        let side = self.random.sign();
        let ease = 0.8 + 0.3 * angle.abs();
        for amount in [side * angle, -side * angle] {
            let interval = Interval::new(self.now, self.now + 2.0 * ease + 0.3);
            self.gestures.hold(channel, interval, ease, amount);
            if channel == Channel::Twist {
                self.gestures
                    .hold(Channel::HipTurn, interval, ease, 0.25 * amount);
                self.swing_arms(interval, ease, amount);
            }
            // The second side begins before the first has ended, without a rest in the middle.
            self.now = interval.end - 0.35;
        }
        self.now += 0.5;
    }

    /// Swings loose arms along with a twist of the trunk by `amount` radians.
    fn swing_arms(&mut self, interval: Interval, ease: f64, amount: f64) {
        for side in Side::BOTH {
            let leading = f64::from(side.sign()) * amount;
            self.gestures
                .hold(Channel::Abduction(side), interval, ease, 0.25 * amount.abs());
            self.gestures
                .hold(Channel::Flexion(side), interval, ease, -0.35 * leading);
            self.gestures
                .hold(Channel::Elbow(side), interval, ease, 0.45 * amount.abs());
        }
    }

    pub(super) fn bow(&mut self, angle: f64) {
        let ease = 0.9 + 0.5 * angle.abs();
        let interval = Interval::new(self.now, self.now + 2.0 * ease + 0.4);
        self.gestures.hold(Channel::Lean, interval, ease, angle);
        self.gestures.hold(Channel::Shift, interval, ease, -0.10 * angle);
        self.gestures.hold(Channel::LookDown, interval, ease, 0.4 * angle);
        self.now = interval.end + 0.3;
    }
}
