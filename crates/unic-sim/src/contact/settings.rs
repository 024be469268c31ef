//! Settings and limits of body contact.

use super::response::Friction;

/// Largest depth of a penetration that contact tracks, metres.
///
/// Up to this depth penetrations are detected, and a particle leaves the body through the side that
/// it entered by. A forearm is 6 to 8 cm thick.
pub const MAX_TRACKED_DEPTH_M: f32 = 0.05;

/// Settings of contact with the body and the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Distance that particles keep from the body and from the ground, metres.
    pub thickness_m: f32,
    /// Friction between cloth and body.
    pub body_friction: Friction,
    /// Friction between cloth and ground.
    pub ground_friction: Friction,
    /// Speed at which existing penetrations are undone, m/s.
    pub recovery_m_per_s: f32,
    /// Height of the ground, world space, metres; `None` without a ground.
    pub ground_height_m: Option<f32>,
}

impl Default for ContactSettings {
    /// Returns a thickness of 3 mm, the friction of cotton on skin, a recovery of 0.5 m/s and no
    /// ground.
    fn default() -> Self {
        Self {
            thickness_m: 0.003,
            body_friction: Friction {
                r#static: 0.6,
                dynamic: 0.5,
            },
            ground_friction: Friction {
                r#static: 0.6,
                dynamic: 0.5,
            },
            recovery_m_per_s: 0.5,
            ground_height_m: None,
        }
    }
}
