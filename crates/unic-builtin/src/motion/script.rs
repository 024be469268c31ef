//! Composed motion of a timeline, independent of the body that performs it.

use super::{
    Side,
    channel::{Channel, Gestures, Interval},
    footsteps::{Jump, StepTiming},
};

/// Random traits of one person; a [`Timeline`](super::Timeline) draws them from its seed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Habit {
    /// Factor on the frequency of steps.
    pub(super) tempo: f64,
    /// Factor on the swing of the arms.
    pub(super) arm_swing: f64,
    /// Additional forward lean of the trunk, radians.
    pub(super) lean: f64,
    /// Elbow angle at rest, radians.
    pub(super) elbow: f64,
    /// Foot of the first step.
    pub(super) first: Side,
}

/// Gestures, jumps and habits of one performance.
#[derive(Clone, Debug)]
pub(super) struct Script {
    pub(super) gestures: Gestures,
    pub(super) jumps: Vec<Jump>,
    pub(super) habit: Habit,
    /// Timing of the steps.
    pub(super) timing: StepTiming,
    /// Duration, seconds.
    pub(super) seconds: f64,
}

/// Frequency of breathing at rest, Hz: about 16 breaths a minute.
const BREATH_HZ: f64 = 0.26;

impl Script {
    /// Adds breathing over the whole duration.
    pub(super) fn breathe(&mut self) {
        let duration = Interval::new(0.0, self.seconds);
        self.gestures
            .wave(Channel::Lean, duration, -0.010, BREATH_HZ, 0.0);
        for side in Side::BOTH {
            self.gestures
                .wave(Channel::Abduction(side), duration, 0.012, BREATH_HZ, 0.0);
        }
    }
}
