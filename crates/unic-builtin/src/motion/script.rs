//! What a timeline turns into before a body performs it.

use super::{
    channel::{Channel, Gestures, Side},
    footsteps::Jump,
};

/// Habits of one person; see [`Timeline`](super::Timeline).
#[derive(Clone, Copy, Debug)]
pub(super) struct Habit {
    /// Factor on step rhythm.
    pub(super) tempo: f64,
    /// Factor on the swing of the arms.
    pub(super) arm_swing: f64,
    /// Further lean of the trunk, radians.
    pub(super) lean: f64,
    /// Elbow angle at rest, radians.
    pub(super) elbow: f64,
    pub(super) first: Side,
}

/// Gestures over time, and whose they are.
#[derive(Clone, Debug)]
pub(super) struct Script {
    pub(super) gestures: Gestures,
    pub(super) jumps: Vec<Jump>,
    pub(super) habit: Habit,
    pub(super) seconds: f64,
}

impl Script {
    /// The quiet motion that never stops: breath.
    pub(super) fn breathe(&mut self) {
        let whole = (0.0, self.seconds);
        self.gestures.wave(Channel::Lean, whole, -0.010, [0.26, 0.0]);
        for side in Side::BOTH {
            self.gestures
                .wave(Channel::Abduction(side), whole, 0.012, [0.26, 0.0]);
        }
    }
}
