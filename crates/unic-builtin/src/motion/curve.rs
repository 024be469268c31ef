//! Curves with continuous second derivatives.

/// Smoothly from 0 at `u` ≤ 0 to 1 at `u` ≥ 1, with zero first and second derivatives at both ends.
pub(super) fn step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// [`step`] over the time from `start` to `end`, seconds.
pub(super) fn step_between(t: f64, start: f64, end: f64) -> f64 {
    step((t - start) / (end - start).max(1e-6))
}

/// From 0 to 1 with an even velocity between a start and an end that take the shares `ramps` of the way
/// to gather speed and to lose it.
pub(super) fn travel(u: f64, ramps: [f64; 2]) -> f64 {
    let u = u.clamp(0.0, 1.0);
    let peak = 1.0 / (1.0 - 0.5 * (ramps[0] + ramps[1]));
    // Distance after the share x of a ramp: the integral of a smoothstep.
    let ramp = |x: f64, length: f64| peak * length * x * x * x * (1.0 - 0.5 * x);
    if u < ramps[0] {
        ramp(u / ramps[0], ramps[0])
    } else if u > 1.0 - ramps[1] {
        1.0 - ramp((1.0 - u) / ramps[1], ramps[1])
    } else {
        peak * (u - 0.5 * ramps[0])
    }
}

/// A parabola of height 1 over 0 < `u` < 1 that leaves and meets the ground within the shares `ramps`.
pub(super) fn arc(u: f64, ramps: [f64; 2]) -> f64 {
    let u = u.clamp(0.0, 1.0);
    4.0 * u * (1.0 - u) * step(u / ramps[0]) * step((1.0 - u) / ramps[1])
}

/// A point that a [`Spline`] passes with given velocity and acceleration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    pub(super) time: f64,
    pub(super) value: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
}

impl Knot {
    /// A point of rest.
    pub(super) fn rest(time: f64, value: f64) -> Self {
        Self {
            time,
            value,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }
}

/// Quintic Hermite curve through knots of ascending time; constant before the first and after the last.
#[derive(Clone, Debug, Default)]
pub(super) struct Spline {
    pub(super) knots: Vec<Knot>,
}

impl Spline {
    pub(super) fn at(&self, t: f64) -> f64 {
        let next = self.knots.partition_point(|k| k.time <= t);
        match (next.checked_sub(1).map(|i| self.knots[i]), self.knots.get(next)) {
            (Some(a), Some(b)) => hermite(a, *b, t),
            (Some(a), None) => a.value,
            (None, Some(b)) => b.value,
            (None, None) => 0.0,
        }
    }
}

fn hermite(a: Knot, b: Knot, t: f64) -> f64 {
    let h = b.time - a.time;
    let u = (t - a.time) / h;
    // The quadratic of the first knot, and the quintic remainder that meets the second.
    let (v, w) = (a.velocity * h, 0.5 * a.acceleration * h * h);
    let p = b.value - a.value - v - w;
    let q = b.velocity * h - v - 2.0 * w;
    let r = b.acceleration * h * h - 2.0 * w;
    let c3 = 10.0 * p - 4.0 * q + 0.5 * r;
    let c4 = -15.0 * p + 7.0 * q - r;
    let c5 = 6.0 * p - 3.0 * q + 0.5 * r;
    a.value + u * (v + u * (w + u * (c3 + u * (c4 + u * c5))))
}

/// A signal on a uniform grid that starts at time zero, read as a cubic B-spline.
#[derive(Clone, Debug)]
pub(super) struct Track {
    values: Vec<f64>,
}

impl Track {
    /// Samples a second.
    const RATE: f64 = 120.0;

    /// Samples `signal` from time zero to `seconds`.
    pub(super) fn sample(seconds: f64, signal: impl FnMut(f64) -> f64) -> Self {
        let count = (seconds * Self::RATE).ceil() as usize + 2;
        Self {
            values: (0..count).map(|i| i as f64 / Self::RATE).map(signal).collect(),
        }
    }

    /// Weighted mean over ± `seconds` (a quadratic B-spline).
    pub(super) fn smoothed(mut self, seconds: f64) -> Self {
        let reach = (seconds * Self::RATE / 3.0).round() as usize;
        for _ in 0..3 {
            self.values = box_mean(&self.values, reach);
        }
        self
    }

    /// The least value within ± `seconds`. Followed by [`Track::smoothed`] over no longer a time,
    /// the result is smooth and nowhere above the signal.
    pub(super) fn eroded(self, seconds: f64) -> Self {
        // Two more samples cover the reach of the B-spline, one the rounding of the box lengths.
        let reach = (seconds * Self::RATE).ceil() as usize + 3;
        let least = |i: usize| {
            let end = (i + reach + 1).min(self.values.len());
            let window = &self.values[i.saturating_sub(reach)..end];
            window.iter().copied().fold(f64::INFINITY, f64::min)
        };
        Self {
            values: (0..self.values.len()).map(least).collect(),
        }
    }

    pub(super) fn at(&self, t: f64) -> f64 {
        let x = (t * Self::RATE).clamp(0.0, (self.values.len() - 1) as f64);
        let u = x.fract();
        let value = |offset: isize| {
            let last = self.values.len() as isize - 1;
            self.values[(x as isize + offset).clamp(0, last) as usize]
        };
        let (a, b) = ((1.0 - u).powi(3), u.powi(3));
        let c = 4.0 - 6.0 * u * u + 3.0 * b;
        let d = 6.0 - a - b - c;
        (a * value(-1) + c * value(0) + d * value(1) + b * value(2)) / 6.0
    }
}

fn box_mean(values: &[f64], reach: usize) -> Vec<f64> {
    let last = values.len() as isize - 1;
    let value = |i: isize| values[i.clamp(0, last) as usize];
    let reach = reach as isize;
    // Integer-free running sums drift; windows are short enough to add anew.
    (0..=last)
        .map(|i| (i - reach..=i + reach).map(value).sum::<f64>() / (2 * reach + 1) as f64)
        .collect()
}
