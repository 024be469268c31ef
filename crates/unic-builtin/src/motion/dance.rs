//! Dance figures to a beat. Amounts are chosen by eye.

use super::{
    Side,
    channel::{Channel, Interval},
    composer::{CLOSING_STEP_S, Composer},
};
use std::f64::consts::PI;

/// Beats of one figure.
const FIGURE_BEATS: f64 = 8.0;

impl Composer {
    pub(super) fn dance(&mut self, seconds: f64, beat_hz: f64) {
        let beat_hz = beat_hz.clamp(0.8, 2.5);
        let end = self.now + seconds;
        // The knees bounce with the beat throughout, under all figures.
        let dance = Interval::new(self.now, end);
        self.gestures.hold(Channel::Crouch, dance, 0.6, 0.035);
        self.gestures.wave(Channel::Crouch, dance, 0.022, beat_hz, 0.0);
        let figure_s = FIGURE_BEATS / beat_hz;
        while self.now + 0.5 * figure_s < end {
            let interval = Interval::new(self.now, (self.now + figure_s).min(end));
            let kind = self.random.below(4);
            self.figure(kind, interval, beat_hz);
            // Figures overlap a little, so that the body does not come to rest between them.
            self.now = interval.end - 0.3;
        }
        self.now = end + CLOSING_STEP_S;
    }

    fn figure(&mut self, kind: usize, interval: Interval, beat_hz: f64) {
        match kind {
            0 => self.hips(interval, beat_hz),
            1 => self.side_steps(interval, beat_hz),
            2 => self.turning_figure(interval, beat_hz),
            _ => self.arm_figure(interval, beat_hz),
        }
    }

    fn hips(&mut self, interval: Interval, beat_hz: f64) {
        // From side to side and back takes two beats.
        let slow = 0.5 * beat_hz;
        self.gestures.wave(Channel::Sway, interval, 0.05, slow, 0.0);
        self.gestures
            .wave(Channel::HipTurn, interval, 0.22, slow, 0.5 * PI);
        self.gestures.wave(Channel::SideBend, interval, 0.10, slow, 0.0);
        for side in Side::BOTH {
            self.gestures.hold(Channel::Elbow(side), interval, 0.7, 1.1);
            self.gestures.hold(Channel::Abduction(side), interval, 0.7, 0.2);
            self.gestures
                .wave(Channel::Flexion(side), interval, 0.35, slow, opposite_phase(side));
        }
    }

    fn side_steps(&mut self, interval: Interval, beat_hz: f64) {
        let first = self.random.sign();
        self.gestures
            .wave(Channel::Strafe, interval, 0.38 * first, 0.25 * beat_hz, 0.0);
        self.gestures
            .wave(Channel::Twist, interval, 0.15, 0.5 * beat_hz, 0.0);
        for side in Side::BOTH {
            self.gestures.hold(Channel::Elbow(side), interval, 0.7, 0.7);
            self.gestures.hold(Channel::Abduction(side), interval, 0.7, 0.35);
            self.gestures
                .wave(Channel::Abduction(side), interval, 0.3, 0.5 * beat_hz, 0.0);
        }
    }

    fn turning_figure(&mut self, interval: Interval, beat_hz: f64) {
        let rate = self.random.sign() * self.random.between(0.7, 1.1);
        self.gestures.hold(Channel::TurnRate, interval, 0.8, rate);
        for side in Side::BOTH {
            self.gestures.hold(Channel::Abduction(side), interval, 0.9, 1.1);
            self.gestures.hold(Channel::Elbow(side), interval, 0.9, 0.3);
        }
        self.gestures
            .wave(Channel::SideBend, interval, 0.08, 0.5 * beat_hz, 0.0);
    }

    fn arm_figure(&mut self, interval: Interval, beat_hz: f64) {
        let slow = 0.25 * beat_hz;
        self.gestures.wave(Channel::Twist, interval, 0.28, slow, 0.0);
        self.gestures
            .wave(Channel::Sway, interval, 0.04, 0.5 * beat_hz, 0.0);
        for side in Side::BOTH {
            let phase = opposite_phase(side);
            self.gestures.hold(Channel::Abduction(side), interval, 0.9, 0.4);
            self.gestures.hold(Channel::Flexion(side), interval, 0.9, 1.4);
            self.gestures
                .wave(Channel::Flexion(side), interval, 0.9, slow, phase);
            self.gestures.hold(Channel::Elbow(side), interval, 0.9, 0.6);
            self.gestures
                .wave(Channel::Elbow(side), interval, 0.3, 0.5 * beat_hz, phase);
        }
    }
}

/// Phase of a wave that runs in opposite phase on both sides: 0 on the left, π on the right.
fn opposite_phase(side: Side) -> f64 {
    0.5 * PI * (1.0 - f64::from(side.sign()))
}
