//! Settings of a controller.

use super::{feet::FootRules, inertia::OffsetSprings, object::ObjectSprings, spring::Spring};

/// Settings of a controller. [`ControllerSettings::new`] makes them from one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerSettings {
    /// Half-life of the spring of the object's velocity, seconds.
    pub velocity_half_life_s: f32,
    /// Half-life of the spring of the object's yaw, seconds.
    pub yaw_half_life_s: f32,
    /// Time between two searches, seconds.
    pub search_interval_s: f32,
    /// Advantage of the frame that plays, in squared standard deviations.
    pub continuing_bias: f32,
    /// Frames on both sides of the frame that plays which a search leaves out, seconds.
    pub window_s: f32,
    /// Change of the velocity asked for since the last search that forces one, m/s.
    pub forcing_velocity_m_s: f32,
    /// Change of the yaw asked for since the last search that forces one, radians.
    pub forcing_yaw_rad: f32,
    /// Half-life of the offset of the pose after a switch, seconds.
    pub pose_half_life_s: f32,
    /// Half-life of the offset of the root's velocity after a switch, seconds.
    pub root_half_life_s: f32,
    /// Half-life of the distance to the object, seconds.
    pub adjustment_half_life_s: f32,
    /// Largest speed of the adjustment by the speed of the character.
    pub adjustment_ratio: f32,
    /// Half-life of the difference from the object's yaw, seconds.
    pub yaw_adjustment_half_life_s: f32,
    /// Largest yaw rate of the adjustment by the yaw rate of the character.
    pub yaw_adjustment_ratio: f32,
    /// Further yaw rate of the adjustment for each metre a second of the character, rad/m.
    pub yaw_adjustment_rad_m: f32,
    /// Largest distance to the object, metres.
    pub clamp_m: f32,
    /// Largest difference from the object's yaw, radians.
    pub clamp_rad: f32,
    /// Distance at which a locked foot is torn off the ground, metres.
    pub unlock_radius_m: f32,
    /// Half-life of the offset of a foot after its release, seconds.
    pub foot_half_life_s: f32,
}

impl ControllerSettings {
    /// Makes settings between quality (0: motion as captured, slow turns) and responsiveness (1:
    /// commands are followed at once, by stronger adjustment).
    pub fn new(responsiveness: f32) -> Self {
        let share = responsiveness.clamp(0.0, 1.0);
        let between = |quality: f32, response: f32| quality + (response - quality) * share;
        Self {
            velocity_half_life_s: between(0.28, 0.16),
            yaw_half_life_s: between(0.32, 0.2),
            search_interval_s: between(0.3, 0.03),
            continuing_bias: between(1.0, 0.0),
            window_s: 1.0 / 3.0,
            forcing_velocity_m_s: between(0.8, 0.2),
            forcing_yaw_rad: between(0.9, 0.2),
            pose_half_life_s: between(0.12, 0.08),
            root_half_life_s: between(0.1, 0.08),
            adjustment_half_life_s: between(0.25, 0.07),
            adjustment_ratio: between(0.38, 0.6),
            yaw_adjustment_half_life_s: between(0.12, 0.05),
            yaw_adjustment_ratio: between(0.9, 1.7),
            yaw_adjustment_rad_m: between(0.4, 0.9),
            clamp_m: 0.42,
            clamp_rad: std::f32::consts::FRAC_PI_2,
            unlock_radius_m: 0.2,
            foot_half_life_s: 0.11,
        }
    }

    /// Springs of the simulated object.
    pub(super) fn object_springs(&self) -> ObjectSprings {
        ObjectSprings {
            velocity: Spring::of_half_life(self.velocity_half_life_s),
            yaw: Spring::of_half_life(self.yaw_half_life_s),
        }
    }

    /// Springs of the offset after a switch.
    pub(super) fn offset_springs(&self) -> OffsetSprings {
        OffsetSprings {
            pose: Spring::of_half_life(self.pose_half_life_s),
            root: Spring::of_half_life(self.root_half_life_s),
        }
    }

    /// Rules of foot locking.
    pub(super) fn foot_rules(&self) -> FootRules {
        FootRules {
            unlock_radius_m: self.unlock_radius_m,
            lock_speed_m_s: 0.4,
            lock_height_m: 0.05,
            spring: Spring::of_half_life(self.foot_half_life_s),
            lift_spring: Spring::of_half_life(0.5 * self.foot_half_life_s),
        }
    }
}

impl Default for ControllerSettings {
    fn default() -> Self {
        Self::new(0.5)
    }
}
