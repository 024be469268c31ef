//! Translation of actions into gestures of the control channels.

mod arms;
mod jump;
mod standing;
mod wander;

use super::{
    Side,
    action::Action,
    channel::{Channel, Gestures, Interval},
    footsteps::{Jump, StepTiming},
    gait::Stature,
    random::Random,
    script::{Habit, Script},
};
use std::f64::consts::PI;

/// Ordinary change of speed, m/s².
const ACCELERATION: f64 = 1.5;

/// Duration of the stand before the first action, seconds.
///
/// The first step begins before the path moves, because a foot lands where the body will be.
const LEAD_IN_S: f64 = 1.1;

/// Time after braking until the last step is done, seconds.
pub(super) const CLOSING_STEP_S: f64 = 0.9;

/// Turns actions into gestures, one after another.
pub(super) struct Composer {
    /// Time at which the next action begins, seconds.
    pub(super) now: f64,
    /// Speed at that time, m/s.
    speed: f64,
    /// Turning rate at that time, rad/s.
    turn_rate: f64,
    stature: Stature,
    pub(super) random: Random,
    pub(super) gestures: Gestures,
    jumps: Vec<Jump>,
    habit: Habit,
    timing: StepTiming,
}

impl Composer {
    pub(super) fn new(stature: Stature, seed: u64, timing: StepTiming) -> Self {
        let mut random = Random::new(seed);
        // The order of the draws decides about every later random number of the performance.
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
            timing,
        }
    }

    /// Returns the script, with a stand at its end.
    pub(super) fn finish(mut self) -> Script {
        self.stand();
        let mut script = Script {
            gestures: self.gestures,
            jumps: self.jumps,
            habit: self.habit,
            timing: self.timing,
            seconds: self.now + 0.4,
        };
        script.breathe();
        script
    }

    /// Appends an action, preceded by braking if it needs a stand.
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
            } => self.slalom(speed.into(), turn_rate.into(), period.into(), seconds.into()),
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
            Action::Wander { seconds } => self.wander(seconds.into()),
            Action::Travel { .. } | Action::Slalom { .. } | Action::Stop { .. } => {}
        }
    }

    fn travel(&mut self, speed: f64, turn_rate: f64, seconds: f64) {
        let change = (speed - self.speed).abs();
        self.drive(speed.clamp(0.0, 6.0), turn_rate, (change / ACCELERATION).max(0.8));
        self.now += seconds;
    }

    fn slalom(&mut self, speed: f64, turn_rate: f64, period: f64, seconds: f64) {
        self.travel(speed, 0.0, seconds);
        let interval = Interval::new(self.now - seconds, self.now);
        let phase = if self.random.sign() > 0.0 { 0.0 } else { PI };
        let hz = 1.0 / period.max(0.5);
        self.gestures
            .wave(Channel::TurnRate, interval, turn_rate, hz, phase);
    }

    /// Changes speed and turning rate within the next `seconds`, which other gestures may overlap.
    fn drive(&mut self, speed: f64, turn_rate: f64, seconds: f64) {
        let change = Interval::new(self.now, self.now + seconds);
        self.gestures.step(Channel::Speed, change, speed - self.speed);
        self.gestures
            .step(Channel::TurnRate, change, turn_rate - self.turn_rate);
        (self.speed, self.turn_rate) = (speed, turn_rate);
    }

    fn brake(&mut self, seconds: f64) {
        self.drive(0.0, 0.0, seconds.max(0.3));
        self.now += seconds.max(0.3) + CLOSING_STEP_S;
    }

    /// Brings a moving character to a stand.
    fn stand(&mut self) {
        // Exact comparisons: braking sets both to zero.
        if self.speed != 0.0 || self.turn_rate != 0.0 {
            self.brake((self.speed / ACCELERATION).max(0.9));
        }
    }
}
