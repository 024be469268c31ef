//! Figures to a beat.

use super::{
    channel::{Channel, Side},
    composer::{CLOSING_STEP_S, Composer},
};
use std::f64::consts::PI;

impl Composer {
    pub(super) fn dance(&mut self, seconds: f64, beat_hz: f64) {
        let beat_hz = beat_hz.clamp(0.8, 2.5);
        let end = self.now + seconds;
        let whole = (self.now, end);
        self.gestures.hold(Channel::Crouch, whole, 0.6, 0.035);
        self.gestures.wave(Channel::Crouch, whole, 0.022, [beat_hz, 0.0]);
        let figure = 8.0 / beat_hz;
        while self.now + 0.5 * figure < end {
            let span = (self.now, (self.now + figure).min(end));
            let kind = self.random.below(4);
            self.figure(kind, span, beat_hz);
            self.now = span.1 - 0.3;
        }
        self.now = end + CLOSING_STEP_S;
    }

    fn figure(&mut self, kind: usize, span: (f64, f64), beat_hz: f64) {
        match kind {
            0 => self.hips(span, beat_hz),
            1 => self.side_steps(span, beat_hz),
            2 => self.turning_figure(span, beat_hz),
            _ => self.arm_figure(span, beat_hz),
        }
    }

    fn hips(&mut self, span: (f64, f64), beat_hz: f64) {
        let slow = 0.5 * beat_hz;
        self.gestures.wave(Channel::Sway, span, 0.05, [slow, 0.0]);
        self.gestures.wave(Channel::HipTurn, span, 0.22, [slow, 0.5 * PI]);
        self.gestures.wave(Channel::SideBend, span, 0.10, [slow, 0.0]);
        for side in Side::BOTH {
            let phase = 0.5 * PI * (1.0 - f64::from(side.sign()));
            self.gestures.hold(Channel::Elbow(side), span, 0.7, 1.1);
            self.gestures.hold(Channel::Abduction(side), span, 0.7, 0.2);
            self.gestures
                .wave(Channel::Flexion(side), span, 0.35, [slow, phase]);
        }
    }

    fn side_steps(&mut self, span: (f64, f64), beat_hz: f64) {
        let side = self.random.sign();
        self.gestures
            .wave(Channel::Strafe, span, 0.38 * side, [0.25 * beat_hz, 0.0]);
        self.gestures
            .wave(Channel::Twist, span, 0.15, [0.5 * beat_hz, 0.0]);
        for side in Side::BOTH {
            self.gestures.hold(Channel::Elbow(side), span, 0.7, 0.7);
            self.gestures.hold(Channel::Abduction(side), span, 0.7, 0.35);
            self.gestures
                .wave(Channel::Abduction(side), span, 0.3, [0.5 * beat_hz, 0.0]);
        }
    }

    fn turning_figure(&mut self, span: (f64, f64), beat_hz: f64) {
        let rate = self.random.sign() * self.random.between(0.7, 1.1);
        self.gestures.hold(Channel::TurnRate, span, 0.8, rate);
        for side in Side::BOTH {
            self.gestures.hold(Channel::Abduction(side), span, 0.9, 1.1);
            self.gestures.hold(Channel::Elbow(side), span, 0.9, 0.3);
        }
        self.gestures
            .wave(Channel::SideBend, span, 0.08, [0.5 * beat_hz, 0.0]);
    }

    fn arm_figure(&mut self, span: (f64, f64), beat_hz: f64) {
        let slow = 0.25 * beat_hz;
        self.gestures.wave(Channel::Twist, span, 0.28, [slow, 0.0]);
        self.gestures
            .wave(Channel::Sway, span, 0.04, [0.5 * beat_hz, 0.0]);
        for side in Side::BOTH {
            let phase = 0.5 * PI * (1.0 - f64::from(side.sign()));
            self.gestures.hold(Channel::Abduction(side), span, 0.9, 0.4);
            self.gestures.hold(Channel::Flexion(side), span, 0.9, 1.4);
            self.gestures
                .wave(Channel::Flexion(side), span, 0.9, [slow, phase]);
            self.gestures.hold(Channel::Elbow(side), span, 0.9, 0.6);
            self.gestures
                .wave(Channel::Elbow(side), span, 0.3, [0.5 * beat_hz, phase]);
        }
    }
}
