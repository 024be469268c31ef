//! Rhythm of the feet as a function of speed.

use super::curve::step_between;

/// Acceleration of gravity, m/s².
pub(super) const GRAVITY: f64 = 9.81;

/// Froude number v²/(g·leg) near which people begin to run (reviewed in Alexander 1989,
/// "Optimization and gaits in the locomotion of vertebrates", Physiological Reviews 69).
const RUNNING_FROUDE: f64 = 0.5;

/// Lowest stride frequency, Hz: even a single step from a stand is no slower.
const LEAST_STRIDE_HZ: f64 = 0.72;

/// Largest change of heading within one stride, radians: the range of both hip joints together.
const MOST_TURN_PER_STRIDE: f64 = 1.1;

/// Rhythm of the steps at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gait {
    /// Strides a second, of two steps each.
    pub stride_hz: f64,
    /// Share of a stride for which one foot is on the ground. Below one half there is a flight
    /// phase.
    pub duty: f64,
    /// Distance of each foot from the path, in half hip widths.
    pub width: f64,
}

/// Body size that sets the gait, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stature {
    /// Height from the soles to the crown, metres.
    pub height: f64,
    /// Length of the straight leg from the hip to the ankle, metres.
    pub leg: f64,
}

impl Stature {
    /// Speed at which walking gives way to running, m/s.
    pub fn running_speed(&self) -> f64 {
        (RUNNING_FROUDE * GRAVITY * self.leg).sqrt()
    }

    /// Blend weight of running: zero for walking, one for running, smooth around the transition.
    pub(super) fn running_weight(&self, speed: f64) -> f64 {
        let limit = self.running_speed();
        step_between(speed, 0.85 * limit, 1.2 * limit)
    }

    /// Rhythm at a speed (m/s) while the heading turns at `turn_rate` (rad/s).
    ///
    /// Walking takes 64.8·V^0.57 strides a minute, with V in statures a second. This is a power law
    /// of the kind that Grieve & Gear 1966 (Ergonomics 9, 379-399) fit to adults, with typical
    /// coefficients. Running from 3 to 5 m/s is within 4 % (strides) and 6 % (duty) of the
    /// regressions of Gray, Price & Jenkins, "Predicting temporal gait kinematics from running
    /// velocity".
    pub fn gait(&self, speed: f64, turn_rate: f64) -> Gait {
        let mut gait = if speed < self.running_speed() {
            self.walk(speed)
        } else {
            run(speed)
        };
        gait.stride_hz = gait.stride_hz.max(turn_rate.abs() / MOST_TURN_PER_STRIDE);
        gait
    }

    fn walk(&self, speed: f64) -> Gait {
        let relative = (speed / self.height).max(0.0);
        let stride_hz = 64.8 / 60.0 * relative.powf(0.57);
        Gait {
            stride_hz: stride_hz.max(LEAST_STRIDE_HZ),
            duty: 0.69 - 0.055 * speed.clamp(0.4, 2.0),
            // Feet are placed nearer to the midline the faster the walk.
            width: 0.95 - 0.25 * step_between(speed, 0.0, 1.2),
        }
    }
}

fn run(speed: f64) -> Gait {
    let above = speed - 2.5;
    // The clamps keep the linear fits from extrapolating beyond the measured speeds.
    Gait {
        stride_hz: 1.3 + 0.08 * above.clamp(-1.0, 4.0),
        duty: 0.39 - 0.045 * above.clamp(-0.8, 3.0),
        width: 0.5,
    }
}
