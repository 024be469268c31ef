//! From actions to gestures.

use super::{
    action::{Action, ArmRaise},
    channel::{Channel, Gestures, Side},
    footsteps::Jump,
    gait::{GRAVITY, Stature},
    performance::{Habit, Script},
    random::Random,
};
use std::f64::consts::PI;

/// Ordinary change of speed, m/s².
const ACCELERATION: f64 = 1.5;

/// Largest rate of the heading on the spot, rad/s.
const SPOT_RATE: f64 = 1.2;

/// Stand before the first action, seconds: the first step is planned ahead of the path that needs it.
const LEAD_IN_S: f64 = 1.1;

/// The time after braking until the last step is done, seconds.
pub(super) const CLOSING_STEP_S: f64 = 0.9;

/// Writes one action after another.
pub(super) struct Composer {
    pub(super) now: f64,
    speed: f64,
    turn_rate: f64,
    stature: Stature,
    pub(super) random: Random,
    pub(super) gestures: Gestures,
    jumps: Vec<Jump>,
    habit: Habit,
}

impl Composer {
    pub(super) fn new(stature: Stature, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let habit = Habit {
            tempo: random.between(0.96, 1.04),
            arm_swing: random.between(0.85, 1.15),
            lean: random.between(-0.01, 0.03),
            elbow: random.between(0.18, 0.32),
            first: if random.sign() > 0.0 {
                Side::Left
            } else {
                Side::Right
            },
        };
        Self {
            now: LEAD_IN_S,
            speed: 0.0,
            turn_rate: 0.0,
            stature,
            random,
            gestures: Gestures::default(),
            jumps: Vec::new(),
            habit,
        }
    }

    /// The script, ending at a stand.
    pub(super) fn finish(mut self) -> Script {
        self.stand();
        let mut script = Script {
            gestures: self.gestures,
            jumps: self.jumps,
            habit: self.habit,
            seconds: self.now + 0.4,
        };
        script.breathe();
        script
    }

    pub(super) fn perform(&mut self, action: Action) {
        match action {
            Action::Travel {
                speed,
                turn_rate,
                seconds,
            } => self.travel(speed.into(), turn_rate.into(), seconds.into()),
            Action::Slalom {
                speed,
                turn_rate,
                period,
                seconds,
            } => self.slalom(speed.into(), [turn_rate, period].map(f64::from), seconds.into()),
            Action::Stop { seconds } => self.brake(seconds.into()),
            standing => {
                self.stand();
                self.perform_standing(standing);
            }
        }
    }

    fn perform_standing(&mut self, action: Action) {
        match action {
            Action::Idle { seconds } => self.idle(seconds.into()),
            Action::TurnOnSpot { angle } => self.turn(angle.into()),
            Action::Squat { depth } => self.squat(depth.into()),
            Action::Jump { height } => self.jump(height.into()),
            Action::Twist { angle } => self.both_sides(Channel::Twist, angle.into()),
            Action::SideBend { angle } => self.both_sides(Channel::SideBend, angle.into()),
            Action::Bow { angle } => self.bow(angle.into()),
            Action::RaiseArms(raise) => self.raise_arms(raise),
            Action::Dance {
                seconds,
                beats_per_minute,
            } => self.dance(seconds.into(), f64::from(beats_per_minute) / 60.0),
            Action::Travel { .. } | Action::Slalom { .. } | Action::Stop { .. } => {}
        }
    }

    fn travel(&mut self, speed: f64, turn_rate: f64, seconds: f64) {
        let change = (speed - self.speed).abs();
        self.drive(speed.clamp(0.0, 6.0), turn_rate, (change / ACCELERATION).max(0.8));
        self.now += seconds;
    }

    fn slalom(&mut self, speed: f64, [turn_rate, period]: [f64; 2], seconds: f64) {
        self.travel(speed, 0.0, seconds);
        let span = (self.now - seconds, self.now);
        let phase = if self.random.sign() > 0.0 { 0.0 } else { PI };
        self.gestures
            .wave(Channel::TurnRate, span, turn_rate, [1.0 / period.max(0.5), phase]);
    }

    fn drive(&mut self, speed: f64, turn_rate: f64, seconds: f64) {
        let end = self.now + seconds;
        self.gestures
            .step(Channel::Speed, self.now, end, speed - self.speed);
        self.gestures
            .step(Channel::TurnRate, self.now, end, turn_rate - self.turn_rate);
        (self.speed, self.turn_rate) = (speed, turn_rate);
    }

    fn brake(&mut self, seconds: f64) {
        self.drive(0.0, 0.0, seconds.max(0.3));
        self.now += seconds.max(0.3) + CLOSING_STEP_S;
    }

    fn stand(&mut self) {
        if self.speed != 0.0 || self.turn_rate != 0.0 {
            self.brake((self.speed / ACCELERATION).max(0.9));
        }
    }

    fn idle(&mut self, seconds: f64) {
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

    fn turn(&mut self, angle: f64) {
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

    fn squat(&mut self, depth: f64) {
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

    fn jump(&mut self, height: f64) {
        let height = height.clamp(0.02, 0.6);
        let takeoff = self.now + 1.0;
        let landing = takeoff + 2.0 * (2.0 * height / GRAVITY).sqrt();
        let crouch = 0.16 + 0.35 * height;
        self.jumps.push(Jump {
            takeoff,
            landing,
            crouch,
        });
        self.jump_trunk(takeoff, landing, crouch);
        for side in Side::BOTH {
            let arm = Channel::Flexion(side);
            // Back while crouching, forward and up with the push, down again after landing.
            self.gestures.step(arm, takeoff - 0.9, takeoff - 0.35, -0.7);
            self.gestures.step(arm, takeoff - 0.42, takeoff + 0.12, 2.6);
            self.gestures.step(arm, landing - 0.15, landing + 0.75, -1.9);
            let bend = (takeoff - 0.5, landing + 0.6);
            self.gestures.hold(Channel::Elbow(side), bend, 0.4, 0.5);
        }
        self.now = landing + 1.1;
    }

    fn jump_trunk(&mut self, takeoff: f64, landing: f64, crouch: f64) {
        let down = (takeoff - 0.95, takeoff + 0.05);
        let absorb = (landing - 0.1, landing + 0.9);
        for (span, ease, share) in [(down, 0.45, 1.0), (absorb, 0.4, 0.8)] {
            self.gestures
                .hold(Channel::Lean, span, ease, 2.0 * share * crouch);
            self.gestures
                .hold(Channel::Shift, span, ease, -0.22 * share * crouch);
        }
    }

    fn both_sides(&mut self, channel: Channel, angle: f64) {
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

    fn bow(&mut self, angle: f64) {
        let ease = 0.9 + 0.5 * angle.abs();
        let span = (self.now, self.now + 2.0 * ease + 0.4);
        self.gestures.hold(Channel::Lean, span, ease, angle);
        self.gestures.hold(Channel::Shift, span, ease, -0.10 * angle);
        self.gestures.hold(Channel::LookDown, span, ease, 0.4 * angle);
        self.now = span.1 + 0.3;
    }

    fn raise_arms(&mut self, raise: ArmRaise) {
        let ease = self.random.between(0.9, 1.4);
        let span = (self.now, self.now + 2.0 * ease + self.random.between(0.4, 1.0));
        for side in Side::BOTH {
            for (channel, amount) in raised(raise, side) {
                self.gestures.hold(channel, span, ease, amount);
            }
        }
        if let ArmRaise::Wave(side) = raise {
            let waving = (span.0 + 0.6 * ease, span.1 - 0.6 * ease);
            self.gestures
                .wave(Channel::Rotation(side), waving, 0.35, [1.6, 0.0]);
        }
        self.now = span.1 + 0.2;
    }
}

/// Channels of one arm of a raise, radians.
fn raised(raise: ArmRaise, side: Side) -> Vec<(Channel, f64)> {
    let (flexion, abduction) = (Channel::Flexion(side), Channel::Abduction(side));
    let (rotation, elbow) = (Channel::Rotation(side), Channel::Elbow(side));
    match raise {
        ArmRaise::Forward => vec![(flexion, 1.5)],
        ArmRaise::Sideways => vec![(abduction, 1.4)],
        ArmRaise::Overhead => vec![(flexion, 2.85)],
        ArmRaise::Star => vec![(abduction, 2.6)],
        ArmRaise::Wave(waving) if waving == side => vec![(abduction, 1.5), (elbow, 1.2), (rotation, -1.4)],
        ArmRaise::Wave(_) => Vec::new(),
        ArmRaise::Akimbo => vec![(abduction, 0.7), (flexion, -0.35), (elbow, 1.6), (rotation, 0.6)],
    }
}
