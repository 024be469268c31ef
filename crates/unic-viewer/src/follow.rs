//! Camera that follows a character.

use crate::Orbit;
use glam::Vec3;
use unic_core::motion_matching::RootFrame;

/// Third-person camera. Its direction is the user's; its target follows the character softly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowCamera {
    /// Direction and distance, and the point that is looked at.
    pub orbit: Orbit,
}

/// Unit vector to the sun of a play: over the left shoulder of the camera at the start.
pub const SUN: Vec3 = Vec3::new(-0.42, 0.72, -0.5524);

/// Height of the point that the camera looks at, metres.
const HEIGHT_M: f32 = 0.95;
/// Time in which the camera makes up half of its distance to the character, seconds.
const HALF_LIFE_S: f32 = 0.12;

impl FollowCamera {
    /// Camera behind a character, to its left.
    pub fn new(root: RootFrame) -> Self {
        let orbit = Orbit {
            target: target(root),
            // From behind, as in games: forward is away from the eye.
            azimuth: root.yaw + std::f32::consts::PI - 0.5,
            elevation: 0.16,
            distance: 3.5,
        };
        Self { orbit }
    }

    /// Follows the character for `seconds`.
    pub fn follow(&mut self, root: RootFrame, seconds: f32) {
        let share = 1.0 - 0.5f32.powf(seconds / HALF_LIFE_S);
        self.orbit.target = self.orbit.target.lerp(target(root), share);
    }
}

fn target(root: RootFrame) -> Vec3 {
    Vec3::new(root.position.x, HEIGHT_M, root.position.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn the_camera_reaches_a_character_at_any_frame_rate() {
        let far = RootFrame {
            position: Vec2::new(2.0, 0.0),
            yaw: 0.0,
        };
        let after = |steps: usize| {
            let mut camera = FollowCamera::new(RootFrame::default());
            for _ in 0..steps {
                camera.follow(far, 0.12 / steps as f32);
            }
            camera.orbit.target.x
        };
        assert!((after(1) - 1.0).abs() < 1e-5);
        assert!((after(7) - 1.0).abs() < 1e-5);
    }
}
