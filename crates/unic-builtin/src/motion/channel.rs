//! What a performance controls over time: channels, each a sum of smooth gestures.

use super::curve::{step, step_between};
use std::f64::consts::TAU;

/// The character's left (+X in the bind pose) or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// +X in the bind pose.
    Left,
    /// −X in the bind pose.
    Right,
}

impl Side {
    /// Both, left first.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// +1 for left, −1 for right: the sign of x.
    pub fn sign(self) -> f32 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }

    /// The other side.
    pub fn other(self) -> Self {
        match self {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        }
    }

    pub(super) fn index(self) -> usize {
        self as usize
    }
}

/// One degree of freedom of a performance. Lengths in metres, angles in radians, rates a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Speed along the heading, m/s.
    Speed,
    /// Speed to the left of the heading, m/s.
    Strafe,
    /// Rate of the heading, rad/s, positive to the left.
    TurnRate,
    /// How far the pelvis sinks.
    Crouch,
    /// Pelvis to the left of the path.
    Sway,
    /// Pelvis ahead of the path.
    Shift,
    /// Trunk bent forward.
    Lean,
    /// Trunk bent to the right.
    SideBend,
    /// Chest turned to the left against the pelvis.
    Twist,
    /// Pelvis turned to the left against the heading.
    HipTurn,
    /// Head turned to the left.
    LookYaw,
    /// Head bowed.
    LookDown,
    /// Upper arm lifted forward.
    Flexion(Side),
    /// Upper arm lifted sideways.
    Abduction(Side),
    /// Upper arm turned about its axis, inward positive.
    Rotation(Side),
    /// Elbow bent.
    Elbow(Side),
}

/// Number of channels.
const CHANNELS: usize = 20;

impl Channel {
    fn index(self) -> usize {
        match self {
            Channel::Speed => 0,
            Channel::Strafe => 1,
            Channel::TurnRate => 2,
            Channel::Crouch => 3,
            Channel::Sway => 4,
            Channel::Shift => 5,
            Channel::Lean => 6,
            Channel::SideBend => 7,
            Channel::Twist => 8,
            Channel::HipTurn => 9,
            Channel::LookYaw => 10,
            Channel::LookDown => 11,
            Channel::Flexion(side) => 12 + side.index(),
            Channel::Abduction(side) => 14 + side.index(),
            Channel::Rotation(side) => 16 + side.index(),
            Channel::Elbow(side) => 18 + side.index(),
        }
    }
}

/// Longest time in which a wave swells and dies away, seconds.
const FADE_S: f64 = 0.9;

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// From nothing to `amount`, which stays.
    Step,
    /// `amount` · sin, faded in and out.
    Wave { hz: f64, phase: f64 },
}

#[derive(Clone, Copy, Debug)]
struct Gesture {
    start: f64,
    end: f64,
    amount: f64,
    shape: Shape,
}

impl Gesture {
    fn at(&self, t: f64) -> f64 {
        match self.shape {
            Shape::Step => self.amount * step_between(t, self.start, self.end),
            Shape::Wave { hz, phase } => {
                let fade = FADE_S.min((self.end - self.start) / 3.0);
                let window = step((t - self.start) / fade) * step((self.end - t) / fade);
                self.amount * window * (TAU * hz * (t - self.start) + phase).sin()
            }
        }
    }
}

/// All channels over time: twice continuously differentiable sums of steps and waves.
#[derive(Clone, Debug)]
pub(super) struct Gestures {
    channels: Vec<Vec<Gesture>>,
}

impl Default for Gestures {
    fn default() -> Self {
        Self {
            channels: vec![Vec::new(); CHANNELS],
        }
    }
}

impl Gestures {
    /// Adds `amount` to a channel between two times, for good.
    pub(super) fn step(&mut self, channel: Channel, start: f64, end: f64, amount: f64) {
        self.push(channel, start, end, amount, Shape::Step);
    }

    /// Adds `amount` between `start` and `start + ease`, and takes it back in the `ease` before `end`.
    pub(super) fn hold(&mut self, channel: Channel, (start, end): (f64, f64), ease: f64, amount: f64) {
        self.step(channel, start, start + ease, amount);
        self.step(channel, end - ease, end, -amount);
    }

    /// Adds amount · sin(2π hz (t − start) + phase) with smooth ends.
    pub(super) fn wave(
        &mut self,
        channel: Channel,
        (start, end): (f64, f64),
        amount: f64,
        [hz, phase]: [f64; 2],
    ) {
        self.push(channel, start, end, amount, Shape::Wave { hz, phase });
    }

    fn push(&mut self, channel: Channel, start: f64, end: f64, amount: f64, shape: Shape) {
        self.channels[channel.index()].push(Gesture {
            start,
            end,
            amount,
            shape,
        });
    }

    pub(super) fn at(&self, channel: Channel, t: f64) -> f64 {
        self.channels[channel.index()].iter().map(|g| g.at(t)).sum()
    }
}
