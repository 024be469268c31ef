//! Critically damped springs, in closed form.

use std::ops::{Add, Mul, Sub};

/// Vector space over f32 that springs move in: numbers and vectors.
pub trait SpringValue: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f32, Output = Self> {}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>> SpringValue for T {}

/// Critically damped spring: the fastest approach to a goal that does not swing past it.
///
/// The distance to the goal is (j₀ + j₁ t) e^(−y t), with the rate y = 2 ln 2 / half-life. The
/// solution is exact, so that results do not depend on the number of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Rate y, 1/s.
    rate: f32,
}

/// Value of a spring with its rate of change.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Moving<T> {
    /// Value.
    pub value: T,
    /// Rate of change, a second.
    pub rate: T,
}

/// Position whose velocity follows a spring.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Driven<T> {
    /// Position.
    pub position: T,
    /// Velocity, a second.
    pub velocity: T,
    /// Acceleration, a squared second.
    pub acceleration: T,
}

impl Spring {
    /// Makes a spring from its half-life in seconds. A half-life of zero jumps to the goal.
    // Half-lives below a millisecond would overflow squares of the rate.
    pub fn of_half_life(seconds: f32) -> Self {
        Self {
            rate: 2.0 * std::f32::consts::LN_2 / seconds.max(1e-3),
        }
    }

    /// Advances a value towards a goal by `dt` seconds.
    pub fn toward<T: SpringValue>(self, from: Moving<T>, goal: T, dt: f32) -> Moving<T> {
        let decay = (-self.rate * dt).exp();
        let distance = from.value - goal;
        let slope = from.rate + distance * self.rate;
        Moving {
            value: goal + (distance + slope * dt) * decay,
            rate: (from.rate - slope * (self.rate * dt)) * decay,
        }
    }

    /// Advances a value towards zero by `dt` seconds.
    pub fn decay<T: SpringValue + Default>(self, from: Moving<T>, dt: f32) -> Moving<T> {
        self.toward(from, T::default(), dt)
    }

    /// Advances a position whose velocity goes to `goal` by `dt` seconds.
    pub fn drive<T: SpringValue>(self, from: Driven<T>, goal: T, dt: f32) -> Driven<T> {
        let rate = self.rate;
        let decay = (-rate * dt).exp();
        let distance = from.velocity - goal;
        let slope = from.acceleration + distance * rate;
        // The integral of (distance + slope t) e^(−rate t) from 0 to dt.
        let travelled =
            distance * ((1.0 - decay) / rate) + slope * ((1.0 - decay * (1.0 + rate * dt)) / (rate * rate));
        Driven {
            position: from.position + goal * dt + travelled,
            velocity: goal + (distance + slope * dt) * decay,
            acceleration: (from.acceleration - slope * (rate * dt)) * decay,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_LIFE: f32 = 0.27;

    fn steps(count: usize, seconds: f32) -> Moving<f32> {
        let spring = Spring::of_half_life(HALF_LIFE);
        let start = Moving {
            value: 0.0,
            rate: 0.0,
        };
        (0..count).fold(start, |x, _| spring.toward(x, 1.0, seconds / count as f32))
    }

    #[test]
    fn value_follows_the_closed_form_whatever_the_steps() {
        let rate = 2.0 * std::f32::consts::LN_2 / HALF_LIFE;
        for seconds in [0.1f32, 0.5, 1.3] {
            let expected = 1.0 - (1.0 + rate * seconds) * (-rate * seconds).exp();
            for count in [1, 7, 60] {
                assert!((steps(count, seconds).value - expected).abs() < 1e-5);
            }
        }
    }

    /// 90 % of a change take 0.76 s with a half-life of 0.27 s.
    #[test]
    fn nine_tenths_take_the_published_time() {
        assert!(steps(1, 0.75).value < 0.9 && steps(1, 0.77).value > 0.9);
    }

    #[test]
    fn driven_position_is_the_integral_of_its_velocity() {
        let spring = Spring::of_half_life(HALF_LIFE);
        let start = Driven {
            position: 2.0f32,
            velocity: -1.0,
            acceleration: 3.0,
        };
        let whole = spring.drive(start, 1.5, 0.8);
        let (mut fine, mut sum, dt) = (start, start.position, 0.8 / 4000.0);
        for _ in 0..4000 {
            let next = spring.drive(fine, 1.5, dt);
            sum += 0.5 * (fine.velocity + next.velocity) * dt;
            fine = next;
        }
        assert!((whole.position - sum).abs() < 1e-3 && (whole.position - fine.position).abs() < 1e-3);
        assert!((whole.velocity - fine.velocity).abs() < 1e-3);
        assert!((whole.acceleration - fine.acceleration).abs() < 1e-2);
    }
}
