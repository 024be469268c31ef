//! From actions to gestures.

mod arms;
mod jump;
mod standing;

use super::{
    action::Action,
    channel::{Channel, Gestures, Side},
    footsteps::Jump,
    gait::Stature,
    random::Random,
    script::{Habit, Script},
};
use std::f64::consts::PI;

/// Ordinary change of speed, m/s².
const ACCELERATION: f64 = 1.5;

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
}
