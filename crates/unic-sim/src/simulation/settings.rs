//! How a simulation runs.

use crate::{Air, SimulationError, contact::ContactSettings, self_contact::SelfContactSettings};
use glam::Vec3;

/// How a simulation runs.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationSettings {
    /// Frames a second of the poses that come in and the shapes that go out.
    pub fps: f32,
    /// Parts of a frame, for each of which the body is posed and contacts are looked for.
    pub intervals_per_frame: u32,
    /// Steps of each part.
    pub substeps_per_interval: u32,
    /// m/s².
    pub gravity: Vec3,
    /// Drag.
    pub air: Air,
    /// Rate at which motion relative to the garment's mean motion dies, 1/s.
    pub damping_per_s: f32,
    /// No particle moves faster than this, m/s: what no garment does, and a bound to every error.
    pub max_speed: f32,
    /// Contact with the body; none takes the cloth's material and no ground.
    pub contact: Option<ContactSettings>,
    /// Contact of the cloth with itself; none lets it pass through.
    pub self_contact: Option<SelfContactSettings>,
    /// How a clip is begun.
    pub settle: SettleSettings,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self {
            fps: 30.0,
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

/// How the garment gets from its rest shape on the bind pose to a clip's first frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettleSettings {
    /// Time in the bind pose, in which the garment leaves the body that its rest shape cuts into, s.
    pub hold_s: f32,
    /// Time of the way to the first pose, s.
    pub move_s: f32,
    /// Time to come to rest in it, s.
    pub rest_s: f32,
    /// Time constant with which the clip's first velocity is picked up at the end, s.
    pub start_s: f32,
    /// Damping meanwhile, 1/s, which gives way to the simulation's own in the end.
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
    /// Time of it all.
    pub fn seconds(&self) -> f32 {
        self.hold_s + self.move_s + self.rest_s
    }
}

impl SimulationSettings {
    /// Length of a substep, seconds.
    pub fn substep_s(&self) -> f32 {
        self.interval_s() / self.substeps_per_interval as f32
    }

    /// Length of an interval, seconds.
    pub fn interval_s(&self) -> f32 {
        (self.fps * self.intervals_per_frame as f32).recip()
    }

    /// # Errors
    /// The first setting out of range.
    pub(super) fn check(&self) -> Result<(), SimulationError> {
        let settle = &self.settle;
        let positive = |x: f32| x.is_finite() && x > 0.0;
        let not_negative = |x: f32| x.is_finite() && x >= 0.0;
        let count = |n: u32| n as f32;
        let checks = [
            ("fps", self.fps, positive(self.fps), "more than zero"),
            (
                "intervals_per_frame",
                count(self.intervals_per_frame),
                self.intervals_per_frame > 0,
                "at least one",
            ),
            (
                "substeps_per_interval",
                count(self.substeps_per_interval),
                self.substeps_per_interval > 0,
                "at least one",
            ),
            (
                "gravity",
                self.gravity.length(),
                self.gravity.is_finite(),
                "finite",
            ),
            (
                "max_speed",
                self.max_speed,
                positive(self.max_speed),
                "more than zero",
            ),
            (
                "settle.start_s",
                settle.start_s,
                positive(settle.start_s),
                "more than zero",
            ),
        ];
        let others = [
            ("air.density", self.air.density),
            ("air.normal_drag", self.air.normal_drag),
            ("air.tangential_drag", self.air.tangential_drag),
            ("damping_per_s", self.damping_per_s),
            ("settle.hold_s", settle.hold_s),
            ("settle.move_s", settle.move_s),
            ("settle.rest_s", settle.rest_s),
            ("settle.damping_per_s", settle.damping_per_s),
        ];
        let others = others.map(|(name, found)| (name, found, not_negative(found), "not negative"));
        let bad = checks.into_iter().chain(others).find(|check| !check.2);
        bad.map_or(Ok(()), |(name, found, _, expected)| {
            Err(SimulationError::Setting {
                name,
                expected,
                found,
            })
        })
    }
}
