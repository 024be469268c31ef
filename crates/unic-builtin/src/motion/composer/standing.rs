//! What is done on the spot.

use super::{CLOSING_STEP_S, Composer};
use crate::motion::channel::{Channel, Side};

/// Largest rate of the heading on the spot, rad/s.
const SPOT_RATE: f64 = 1.2;

impl Composer {
    pub(super) fn idle(&mut self, seconds: f64) {
        let end = self.now + seconds;
        self.glances(end);
        let (mut t, mut side) = (self.now + 0.3, self.random.sign());
        while t + 2.6 < end {
            let stay = self.random.between(2.6, 5.5).min(end - t);
            let sway = side * self.random.between(0.03, 0.055);
            self.gestures.hold(Channel::Sway, (t, t + stay), 1.1, sway);
            self.gestures
                .hold(Channel::HipTurn, (t, t + stay), 1.2, -0.8 * sway);
            (t, side) = (t + stay - self.random.between(0.3, 1.0), -side);
        }
        self.now = end;
    }

    fn glances(&mut self, end: f64) {
        let mut t = self.now + self.random.between(0.4, 1.5);
        while t + 1.8 < end {
            let stay = self.random.between(1.6, 3.0).min(end - t);
            let yaw = self.random.sign() * self.random.between(0.2, 0.75);
            self.gestures.hold(Channel::LookYaw, (t, t + stay), 0.5, yaw);
            self.gestures.hold(Channel::Twist, (t, t + stay), 0.7, 0.2 * yaw);
            let down = self.random.between(-0.1, 0.25);
            self.gestures.hold(Channel::LookDown, (t, t + stay), 0.5, down);
            t += stay + self.random.between(0.3, 2.5);
        }
    }

    pub(super) fn turn(&mut self, angle: f64) {
        let ease = 0.6;
        // A plateau of rate w between eases of e turns by w (seconds − e).
        let seconds = (angle.abs() / SPOT_RATE + ease).max(2.0 * ease);
        let rate = angle / (seconds - ease);
        let span = (self.now, self.now + seconds);
        self.gestures.hold(Channel::TurnRate, span, ease, rate);
        let looking = (self.now - 0.15, self.now + seconds - 0.3);
        self.gestures
            .hold(Channel::LookYaw, looking, 0.5, 0.35 * angle.signum());
        self.now += seconds + CLOSING_STEP_S;
    }

    pub(super) fn squat(&mut self, depth: f64) {
        let depth = depth.clamp(0.0, 0.6);
        let ease = self.random.between(0.9, 1.3);
        let span = (self.now, self.now + 2.0 * ease + self.random.between(0.2, 0.6));
        self.gestures
            .hold(Channel::Crouch, span, ease, depth * self.stature.leg);
        self.gestures
            .hold(Channel::Shift, span, ease, -0.20 * depth * self.stature.leg);
        self.gestures.hold(Channel::Lean, span, ease, 1.3 * depth);
        self.gestures.hold(Channel::LookDown, span, ease, -0.3 * depth);
        for side in Side::BOTH {
            self.gestures
                .hold(Channel::Flexion(side), span, ease, 1.6 * depth);
        }
        self.now = span.1 + 0.3;
    }

    pub(super) fn both_sides(&mut self, channel: Channel, angle: f64) {
        let side = self.random.sign();
        let ease = 0.8 + 0.3 * angle.abs();
        for amount in [side * angle, -side * angle] {
            let span = (self.now, self.now + 2.0 * ease + 0.3);
            self.gestures.hold(channel, span, ease, amount);
            if channel == Channel::Twist {
                self.gestures.hold(Channel::HipTurn, span, ease, 0.25 * amount);
                self.swing_arms(span, ease, amount);
            }
            self.now = span.1 - 0.35;
        }
        self.now += 0.5;
    }

    /// Loose arms that follow a twist of the trunk.
    fn swing_arms(&mut self, span: (f64, f64), ease: f64, amount: f64) {
        for side in Side::BOTH {
            let leading = f64::from(side.sign()) * amount;
            self.gestures
                .hold(Channel::Abduction(side), span, ease, 0.25 * amount.abs());
            self.gestures
                .hold(Channel::Flexion(side), span, ease, -0.35 * leading);
            self.gestures
                .hold(Channel::Elbow(side), span, ease, 0.45 * amount.abs());
        }
    }

    pub(super) fn bow(&mut self, angle: f64) {
        let ease = 0.9 + 0.5 * angle.abs();
        let span = (self.now, self.now + 2.0 * ease + 0.4);
        self.gestures.hold(Channel::Lean, span, ease, angle);
        self.gestures.hold(Channel::Shift, span, ease, -0.10 * angle);
        self.gestures.hold(Channel::LookDown, span, ease, 0.4 * angle);
        self.now = span.1 + 0.3;
    }
}
