//! Curves with continuous second derivatives.

/// Quintic smooth step from 0 at `u` ≤ 0 to 1 at `u` ≥ 1.
///
/// Its first and second derivatives are zero at both ends.
pub(super) fn step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// [`step`] over the time from `start` to `end`, seconds.
pub(super) fn step_between(t: f64, start: f64, end: f64) -> f64 {
    // The least duration makes an empty interval a jump instead of 0/0.
    step((t - start) / (end - start).max(1e-6))
}

/// Shares of a movement's duration spent on speeding up and on slowing down, each 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Easing {
    pub(super) ease_in: f64,
    pub(super) ease_out: f64,
}

/// Share of the distance covered at the share `u` of the time.
///
/// The velocity rises smoothly, stays constant and falls smoothly, as `easing` asks.
pub(super) fn travel(u: f64, easing: Easing) -> f64 {
    let u = u.clamp(0.0, 1.0);
    let Easing { ease_in, ease_out } = easing;
    // While speeding up or slowing down, the mean velocity is half of the peak velocity.
    let peak = 1.0 / (1.0 - 0.5 * (ease_in + ease_out));
    // Velocity is a cubic smoothstep 3x² − 2x³ there; this is its integral.
    let eased = |x: f64, length: f64| peak * length * x * x * x * (1.0 - 0.5 * x);
    if u < ease_in {
        eased(u / ease_in, ease_in)
    } else if u > 1.0 - ease_out {
        1.0 - eased((1.0 - u) / ease_out, ease_out)
    } else {
        peak * (u - 0.5 * ease_in)
    }
}

/// Parabola of height 1 over 0 < `u` < 1, flattened at both ends over the shares of `easing`.
pub(super) fn arc(u: f64, easing: Easing) -> f64 {
    let u = u.clamp(0.0, 1.0);
    4.0 * u * (1.0 - u) * step(u / easing.ease_in) * step((1.0 - u) / easing.ease_out)
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
    /// Knot with zero velocity and acceleration.
    pub(super) fn rest(time: f64, value: f64) -> Self {
        Self {
            time,
            value,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }
}

/// Quintic Hermite curve through knots of ascending time.
///
/// It is constant before the first knot and after the last one, and zero without knots.
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
    // The quadratic v, w has the first knot's derivatives. The residuals p, q and r of position,
    // velocity and acceleration at the second knot determine the cubic to quintic terms.
    let (v, w) = (a.velocity * h, 0.5 * a.acceleration * h * h);
    let p = b.value - a.value - v - w;
    let q = b.velocity * h - v - 2.0 * w;
    let r = b.acceleration * h * h - 2.0 * w;
    let c3 = 10.0 * p - 4.0 * q + 0.5 * r;
    let c4 = -15.0 * p + 7.0 * q - r;
    let c5 = 6.0 * p - 3.0 * q + 0.5 * r;
    a.value + u * (v + u * (w + u * (c3 + u * (c4 + u * c5))))
}

/// Signal sampled on a uniform grid that starts at time zero, and evaluated as a cubic B-spline.
///
/// The B-spline smooths over neighbouring samples instead of interpolating them.
#[derive(Clone, Debug)]
pub(super) struct Track {
    values: Vec<f64>,
}

impl Track {
    /// Samples per second.
    const RATE: f64 = 120.0;

    /// Samples `signal` from time zero to `seconds`.
    pub(super) fn sample(seconds: f64, signal: impl FnMut(f64) -> f64) -> Self {
        // One sample for time zero and one beyond the end, which the B-spline reaches for.
        let count = (seconds * Self::RATE).ceil() as usize + 2;
        Self {
            values: (0..count).map(|i| i as f64 / Self::RATE).map(signal).collect(),
        }
    }

    /// Weighted mean over ± `seconds` with the weights of a quadratic B-spline.
    pub(super) fn smoothed(mut self, seconds: f64) -> Self {
        // Three box filters, each a third of the reach, convolve to that B-spline.
        let reach = (seconds * Self::RATE / 3.0).round() as usize;
        for _ in 0..3 {
            self.values = box_mean(&self.values, reach);
        }
        self
    }

    /// Minimum filter: the least value within ± `seconds`.
    ///
    /// Followed by [`Track::smoothed`] over no longer a time, the result is smooth and nowhere
    /// above the signal.
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

    /// Value at a time in seconds; times outside the grid take its first or last sample.
    pub(super) fn at(&self, t: f64) -> f64 {
        let x = (t * Self::RATE).clamp(0.0, (self.values.len() - 1) as f64);
        let u = x.fract();
        let value = |offset: isize| {
            let last = self.values.len() as isize - 1;
            self.values[(x as isize + offset).clamp(0, last) as usize]
        };
        // Weights of the uniform cubic B-spline, times 6. The last one is the complement, so that a
        // constant signal stays constant.
        let (a, b) = ((1.0 - u).powi(3), u.powi(3));
        let c = 4.0 - 6.0 * u * u + 3.0 * b;
        let d = 6.0 - a - b - c;
        (a * value(-1) + c * value(0) + d * value(1) + b * value(2)) / 6.0
    }
}

/// Mean over 2 · `reach` + 1 samples; the first and last samples continue beyond the ends.
fn box_mean(values: &[f64], reach: usize) -> Vec<f64> {
    let last = values.len() as isize - 1;
    let value = |i: isize| values[i.clamp(0, last) as usize];
    let reach = reach as isize;
    // A running sum of floats would accumulate rounding errors. Windows are short enough to add
    // anew.
    (0..=last)
        .map(|i| (i - reach..=i + reach).map(value).sum::<f64>() / (2 * reach + 1) as f64)
        .collect()
}
