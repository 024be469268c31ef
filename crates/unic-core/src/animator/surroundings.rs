//! Surroundings of a live garment, and how it is shown.

use glam::Vec3;

/// Garment that is shown between two ticks of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Display {
    /// The cloth is interpolated on the pose of each frame, up to a tick behind.
    #[default]
    Interpolated,
    /// The cloth moves with the ticks alone.
    Ticks,
}

/// Surroundings of a live garment in a frame, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Size of the character in the world, 1 for that of the model; above 0. Poses are divided by
    /// it, wind and ground are not.
    pub size: f32,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Height of the ground, metres.
    pub ground_height: f32,
    /// Movements of the character that are teleports.
    pub teleports: TeleportLimit,
}

impl Default for Surroundings {
    /// Still air on ground at height 0, around a character of the model's size.
    fn default() -> Self {
        Self {
            size: 1.0,
            wind: Vec3::ZERO,
            ground_height: 0.0,
            teleports: TeleportLimit::default(),
        }
    }
}

/// Largest movement of the character's root within a frame that is no teleport.
///
/// The limit is a speed, because a runner goes far within a long frame. A movement that is shorter
/// than `least_m` is no teleport, however short the frame is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TeleportLimit {
    /// Smallest limit, metres.
    pub least_m: f32,
    /// Speed above which a movement is a teleport, m/s. At 0 or below no movement is one.
    pub speed_m_s: f32,
}

impl TeleportLimit {
    /// Limit with another speed than the default one, m/s; 0 for no teleports.
    pub fn with_speed(speed_m_s: f32) -> Self {
        Self {
            speed_m_s,
            ..Self::default()
        }
    }

    /// Returns whether the root teleports that moves by `moved_m` metres in `frame_s` seconds.
    pub fn is_exceeded(&self, moved_m: f32, frame_s: f64) -> bool {
        // `max` gives the smallest limit for times that are NaN.
        let most_m = (f64::from(self.speed_m_s) * frame_s).max(f64::from(self.least_m));
        self.speed_m_s > 0.0 && f64::from(moved_m) > most_m
    }
}

impl Default for TeleportLimit {
    /// Half a metre, or 30 m/s: faster than people move, and slower than they are cut away.
    fn default() -> Self {
        Self {
            least_m: 0.5,
            speed_m_s: 30.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_runner_does_not_teleport_at_any_frame_time() {
        let limit = TeleportLimit::default();
        for frame_s in [1e-4, 1.0 / 144.0, 1.0 / 60.0, 1.0 / 30.0, 0.25, 2.0] {
            let moved_m = (5.0 * frame_s) as f32;
            assert!(!limit.is_exceeded(moved_m, frame_s), "{frame_s} s");
        }
    }

    #[test]
    fn the_limit_is_a_speed_and_half_a_metre_at_least() {
        let limit = TeleportLimit::default();
        // A short frame: 30 m/s are 0.3 m.
        assert!(!limit.is_exceeded(0.49, 0.01));
        assert!(limit.is_exceeded(0.51, 0.01));
        // A long one: 3 m.
        assert!(!limit.is_exceeded(2.9, 0.1));
        assert!(limit.is_exceeded(3.1, 0.1));
        // Frames without time, or with none that can be used.
        assert!(limit.is_exceeded(0.51, 0.0));
        assert!(limit.is_exceeded(0.51, f64::NAN));
        assert!(!limit.is_exceeded(f32::NAN, 0.1));
    }

    #[test]
    fn a_speed_of_0_is_no_limit() {
        assert!(!TeleportLimit::with_speed(0.0).is_exceeded(1e6, 0.01));
    }
}
