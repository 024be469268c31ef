//! Settings of a simulation and of the phase that settles the garment.

use crate::{Air, SimulationError, contact::ContactSettings, self_contact::SelfContactSettings};
use glam::Vec3;

/// Settings of a [`Simulation`](crate::Simulation).
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationSettings {
    /// Frame rate of the input poses and of the output shapes, frames a second.
    pub fps: f32,
    /// Number of intervals in a frame. At the start of each one the body is posed and contacts are
    /// detected.
    pub intervals_per_frame: u32,
    /// Number of solver steps in an interval.
    pub substeps_per_interval: u32,
    /// Acceleration by gravity, m/s².
    pub gravity: Vec3,
    /// Air around the cloth, which causes drag.
    pub air: Air,
    /// Exponential damping rate of motion relative to the garment's mean motion, 1/s.
    pub damping_per_s: f32,
    /// Upper limit of a particle's speed, m/s. It is above all speeds of real garments and bounds
    /// the effect of errors.
    pub max_speed: f32,
    /// Contact with the body and the ground; `None` uses the thickness and friction of the cloth's
    /// material, and no ground.
    pub contact: Option<ContactSettings>,
    /// Contact of the cloth with itself; `None` disables it.
    pub self_contact: Option<SelfContactSettings>,
    /// Settling before the first frame of a clip.
    pub settle: SettleSettings,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self {
            fps: 30.0,
            // Small steps converge better than many sweeps per step (Macklin et al. 2019). Contacts
            // change more slowly, so that they are detected once per interval.
            intervals_per_frame: 4,
            substeps_per_interval: 5,
            gravity: Vec3::NEG_Y * 9.81,
            air: Air::default(),
            damping_per_s: 0.2,
            max_speed: 40.0,
            contact: None,
            self_contact: None,
            settle: SettleSettings::default(),
        }
    }
}

/// Phases of settling, which brings the garment from its rest shape on the bind pose to the first
/// frame of a clip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettleSettings {
    /// Duration of the bind pose, seconds. The garment leaves the body where its rest shape
    /// intersects it.
    pub hold_s: f32,
    /// Duration of the motion from the bind pose to the clip's first pose, seconds.
    pub move_s: f32,
    /// Duration of the first pose, in which the garment comes to rest, seconds.
    pub rest_s: f32,
    /// Time constant with which the character picks up the clip's first velocity at the end,
    /// seconds.
    pub start_s: f32,
    /// Damping rate while settling, 1/s. It fades to the simulation's own rate in the rest phase.
    pub damping_per_s: f32,
}

impl Default for SettleSettings {
    fn default() -> Self {
        Self {
            hold_s: 0.5,
            move_s: 1.5,
            rest_s: 0.7,
            start_s: 0.1,
            damping_per_s: 5.0,
        }
    }
}

impl SettleSettings {
    /// Returns the duration of settling, seconds.
    pub fn seconds(&self) -> f32 {
        self.hold_s + self.move_s + self.rest_s
    }
}

/// One setting with the range that it must lie in.
struct RangeCheck {
    name: &'static str,
    value: f32,
    is_valid: bool,
    expected: &'static str,
}

impl RangeCheck {
    fn positive(name: &'static str, value: f32) -> Self {
        Self {
            name,
            value,
            is_valid: value.is_finite() && value > 0.0,
            expected: "more than zero",
        }
    }

    fn not_negative(name: &'static str, value: f32) -> Self {
        Self {
            name,
            value,
            is_valid: value.is_finite() && value >= 0.0,
            expected: "not negative",
        }
    }

    fn at_least_one(name: &'static str, count: u32) -> Self {
        Self {
            name,
            value: count as f32,
            is_valid: count > 0,
            expected: "at least one",
        }
    }
}

impl SimulationSettings {
    /// Returns the length of a substep, seconds.
    pub fn substep_s(&self) -> f32 {
        self.interval_s() / self.substeps_per_interval as f32
    }

    /// Returns the length of an interval, seconds.
    pub fn interval_s(&self) -> f32 {
        (self.fps * self.intervals_per_frame as f32).recip()
    }

    /// Checks all settings and returns an error for the first one out of range.
    pub(super) fn check(&self) -> Result<(), SimulationError> {
        let settle = &self.settle;
        let checks = [
            RangeCheck::positive("fps", self.fps),
            RangeCheck::at_least_one("intervals_per_frame", self.intervals_per_frame),
            RangeCheck::at_least_one("substeps_per_interval", self.substeps_per_interval),
            RangeCheck {
                name: "gravity",
                value: self.gravity.length(),
                is_valid: self.gravity.is_finite(),
                expected: "finite",
            },
            RangeCheck::positive("max_speed", self.max_speed),
            RangeCheck::positive("settle.start_s", settle.start_s),
            RangeCheck::not_negative("air.density", self.air.density),
            RangeCheck::not_negative("air.normal_drag", self.air.normal_drag),
            RangeCheck::not_negative("air.tangential_drag", self.air.tangential_drag),
            RangeCheck::not_negative("damping_per_s", self.damping_per_s),
            RangeCheck::not_negative("settle.hold_s", settle.hold_s),
            RangeCheck::not_negative("settle.move_s", settle.move_s),
            RangeCheck::not_negative("settle.rest_s", settle.rest_s),
            RangeCheck::not_negative("settle.damping_per_s", settle.damping_per_s),
        ];
        match checks.into_iter().find(|check| !check.is_valid) {
            None => Ok(()),
            Some(check) => Err(SimulationError::Setting {
                name: check.name,
                expected: check.expected,
                found: check.value,
            }),
        }
    }
}
