//! Commands: what a player asks of a character, whatever device it comes from.

use super::{
    object::SimulatedObject,
    root::{RootFrame, direction_of, yaw_of},
};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Velocity and direction that a player asks for, in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Velocity (x, z), m/s.
    pub velocity: Vec2,
    /// Direction to face.
    pub facing: Facing,
}

/// Direction that a character is asked to face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Facing {
    /// Along the velocity. Without a velocity, the last direction stays.
    #[default]
    Travel,
    /// This yaw, radians.
    Yaw(f32),
}

impl Command {
    /// Command to stand.
    pub const STAND: Self = Self {
        velocity: Vec2::ZERO,
        facing: Facing::Travel,
    };

    /// Moves along the direction of travel.
    pub fn travel(velocity: Vec2) -> Self {
        Self {
            velocity,
            facing: Facing::Travel,
        }
    }

    /// Converts the deflection of a stick or of four keys to a command.
    ///
    /// `stick` is (right, forward), at most of length 1; `camera_yaw` the yaw of the camera's view,
    /// radians; `top_speed_m_s` the speed at full deflection.
    pub fn from_stick(stick: Vec2, camera_yaw: f32, top_speed_m_s: f32) -> Self {
        let forward = direction_of(camera_yaw);
        // Right of a viewer who looks along +Z is −X, with +Y up.
        let right = Vec2::new(-forward.y, forward.x);
        let deflection = stick.clamp_length_max(1.0);
        Self::travel((right * deflection.x + forward * deflection.y) * top_speed_m_s)
    }

    /// Yaw that the command asks for; `last` where it asks for none.
    pub(super) fn goal_yaw(&self, last: f32) -> f32 {
        match self.facing {
            Facing::Yaw(yaw) => yaw,
            Facing::Travel if self.velocity.length() > LEAST_SPEED_M_S => yaw_of(self.velocity),
            Facing::Travel => last,
        }
    }

    /// Returns whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let is_yaw_finite = match self.facing {
            Facing::Travel => true,
            Facing::Yaw(yaw) => yaw.is_finite(),
        };
        self.velocity.is_finite() && is_yaw_finite
    }
}

/// Speed below which a velocity has no direction to face, m/s.
const LEAST_SPEED_M_S: f32 = 0.05;

/// Mouse buttons that are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MouseButtons {
    /// None: the character stands.
    #[default]
    Released,
    /// The left one: the character walks to the pointer.
    Left,
    /// Left and right together: the character also turns to the pointer.
    LeftAndRight,
}

/// Mouse control after the demonstration of Codebook Matching (Starke et al. 2024).
///
/// The pointer's place on the ground, clamped to 1 m around the root, draws a target along. The
/// velocity asked for is 2 (target − root) / 0.5 s, less what the object still travels. The guide
/// `docs/guides/control.md` lists the differences from the demonstration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MouseControl {
    /// Target on the ground relative to the root, metres, world directions.
    offset: Vec2,
    /// Largest speed asked for, m/s. The published control has none, and so reaches 4 m/s.
    pub top_speed_m_s: f32,
}

/// Largest distance of the target from the root, metres.
const REACH_M: f32 = 1.0;
/// Share of the pointer in the next target.
const BLEND: f32 = 0.75;
/// Time in which the target is to be reached, seconds.
const HORIZON_S: f32 = 0.5;
/// Distance of the target at which the character has arrived, metres.
const ARRIVED_M: f32 = 0.15;
/// Distance of the pointer from which on it has a direction to turn to, metres.
const TURNING_M: f32 = 0.5;
/// Time by which the object's velocity lags behind the command, seconds. It is about 2 / rate of the
/// object's spring with the default settings, 0.32 s, and the same for all settings.
const LAG_S: f32 = 0.33;
/// Factor of the velocity.
const GAIN: f32 = 2.0;

impl MouseControl {
    /// Makes a control with its target at the root.
    pub fn new(top_speed_m_s: f32) -> Self {
        Self {
            offset: Vec2::ZERO,
            top_speed_m_s,
        }
    }

    /// Target on the ground (x, z), metres.
    pub fn target(&self, root: &RootFrame) -> Vec2 {
        root.position + self.offset
    }

    /// Moves the target towards the pointer's place on the ground (x, z), and returns the command
    /// for the tick. `object` is what the character follows. A pointer that is not finite leaves the
    /// target in its place.
    pub fn command(&mut self, object: &SimulatedObject, pointer: Vec2, buttons: MouseButtons) -> Command {
        let root = object.root();
        let to_pointer = match pointer - root.position {
            way if way.length_squared().is_finite() => way,
            _ => self.offset,
        };
        let wanted = match buttons {
            MouseButtons::Released => Vec2::ZERO,
            _ => to_pointer.clamp_length_max(REACH_M),
        };
        self.offset = self.offset.lerp(wanted, BLEND);
        // The object's velocity lags behind the command. Where it comes to rest counts, or it would
        // swing about the target.
        let missing = self.offset - object.motion.velocity * LAG_S;
        let beyond = (missing.length() - ARRIVED_M).max(0.0);
        let velocity = missing.normalize_or_zero() * (beyond * GAIN / HORIZON_S);
        let facing = match buttons {
            MouseButtons::LeftAndRight if to_pointer.length() > TURNING_M => Facing::Yaw(yaw_of(to_pointer)),
            _ => Facing::Yaw(root.yaw),
        };
        Command {
            velocity: velocity.clamp_length_max(self.top_speed_m_s),
            facing,
        }
    }
}
