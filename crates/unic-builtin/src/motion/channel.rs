//! Control channels of a performance: each is a sum of smooth gestures over time.

use super::curve::{step, step_between};
use crate::side::Side;
use std::f64::consts::TAU;

/// One degree of freedom of a performance. Lengths are in metres, angles in radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Speed along the heading, m/s.
    Speed,
    /// Speed to the left of the heading, m/s.
    Strafe,
    /// Turning rate of the heading, rad/s, positive to the left.
    TurnRate,
    /// Descent of the pelvis below its standing height, metres.
    Crouch,
    /// Displacement of the pelvis to the left of the path, metres.
    Sway,
    /// Displacement of the pelvis ahead of the path, metres.
    Shift,
    /// Angle by which the trunk is bent forward, radians.
    Lean,
    /// Angle by which the trunk is bent to the right, radians.
    SideBend,
    /// Angle of the chest to the left of the pelvis, radians.
    Twist,
    /// Angle of the pelvis to the left of the heading, radians.
    HipTurn,
    /// Angle by which the head is turned to the left, radians.
    LookYaw,
    /// Angle by which the head is bowed, radians.
    LookDown,
    /// Angle by which the upper arm is lifted forward, radians.
    Flexion(Side),
    /// Angle by which the upper arm is lifted sideways, radians.
    Abduction(Side),
    /// Angle by which the upper arm is turned about its axis, radians, inward positive.
    Rotation(Side),
    /// Angle by which the elbow is bent, radians.
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

/// Longest fade-in and fade-out of a wave, seconds.
const FADE_S: f64 = 0.9;

/// Interval of time, seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) start: f64,
    pub(super) end: f64,
}

impl Interval {
    pub(super) fn new(start: f64, end: f64) -> Self {
        Self { start, end }
    }
}

/// Course of a gesture within its interval.
#[derive(Clone, Debug)]
enum GestureShape {
    /// Smooth step from zero to the amount, which is kept after the interval.
    Step,
    /// Sine of the given frequency (Hz) and phase (radians), faded in and out.
    Wave { hz: f64, phase: f64 },
    /// Cubic B-spline of values at equal steps, the first one at the start and the last one at the
    /// end of the interval. Zero outside. The amount is its factor.
    Samples(Vec<f64>),
}

/// One smooth contribution to a channel.
#[derive(Clone, Debug)]
struct Gesture {
    interval: Interval,
    amount: f64,
    shape: GestureShape,
}

impl Gesture {
    fn at(&self, t: f64) -> f64 {
        let Interval { start, end } = self.interval;
        match &self.shape {
            GestureShape::Step => self.amount * step_between(t, start, end),
            GestureShape::Wave { hz, phase } => {
                // A third of the interval at most: a short wave still reaches its full amount.
                let fade = FADE_S.min((end - start) / 3.0);
                let window = step((t - start) / fade) * step((end - t) / fade);
                self.amount * window * (TAU * hz * (t - start) + phase).sin()
            }
            GestureShape::Samples(values) => {
                let steps = values.len().saturating_sub(1) as f64;
                self.amount * b_spline(values, (t - start) / (end - start).max(1e-6) * steps)
            }
        }
    }
}

/// Uniform cubic B-spline of `values` at the parameter `x`, in steps. Values before the first and
/// behind the last one are zero.
fn b_spline(values: &[f64], x: f64) -> f64 {
    let node = x.floor();
    let u = x - node;
    let weights = [
        (1.0 - u).powi(3),
        (3.0 * u - 6.0) * u * u + 4.0,
        ((3.0 - 3.0 * u) * u + 3.0) * u + 1.0,
        u.powi(3),
    ];
    let value = |offset: usize| {
        let at = node as isize + offset as isize - 1;
        let value = usize::try_from(at).ok().and_then(|at| values.get(at));
        value.copied().unwrap_or(0.0)
    };
    (weights.iter().enumerate())
        .map(|(i, w)| w / 6.0 * value(i))
        .sum()
}

/// Gestures of all channels. Each channel is twice continuously differentiable in time.
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
    /// Raises a channel by `amount` within an interval and keeps the new level.
    pub(super) fn step(&mut self, channel: Channel, interval: Interval, amount: f64) {
        self.push(channel, interval, amount, GestureShape::Step);
    }

    /// Raises a channel by `amount` in the first `ease` seconds of an interval, and lowers it again
    /// in the last `ease` seconds.
    pub(super) fn hold(&mut self, channel: Channel, interval: Interval, ease: f64, amount: f64) {
        let Interval { start, end } = interval;
        self.step(channel, Interval::new(start, start + ease), amount);
        self.step(channel, Interval::new(end - ease, end), -amount);
    }

    /// Adds amount · sin(2π hz (t − start) + phase), faded in and out within the interval.
    pub(super) fn wave(&mut self, channel: Channel, interval: Interval, amount: f64, hz: f64, phase: f64) {
        self.push(channel, interval, amount, GestureShape::Wave { hz, phase });
    }

    /// Adds the course of `values` at equal steps from the start to the end of an interval. They
    /// begin and end with zeros.
    pub(super) fn samples(&mut self, channel: Channel, interval: Interval, values: Vec<f64>) {
        self.push(channel, interval, 1.0, GestureShape::Samples(values));
    }

    fn push(&mut self, channel: Channel, interval: Interval, amount: f64, shape: GestureShape) {
        self.channels[channel.index()].push(Gesture {
            interval,
            amount,
            shape,
        });
    }

    /// Value of a channel at a time in seconds: the sum of its gestures.
    pub(super) fn at(&self, channel: Channel, t: f64) -> f64 {
        // Gestures are added in the order in which they were written, so that sums repeat to the
        // bit.
        self.channels[channel.index()].iter().map(|g| g.at(t)).sum()
    }
}
