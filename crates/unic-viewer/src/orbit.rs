//! Camera that turns around a point.

use glam::{Vec2, Vec3};
use unic_raster::{Camera, RasterError};

/// Camera around a target, turned, moved and zoomed by the mouse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Point in the middle of the picture, world, metres.
    pub target: Vec3,
    /// Angle of the eye around +Y, radians: 0 is in front of a character that faces +Z, π/2 on its
    /// left side.
    pub azimuth: f32,
    /// Angle of the eye above the horizon, radians.
    pub elevation: f32,
    /// Distance of the eye from the target, metres.
    pub distance: f32,
}

/// Vertical angle of view, radians.
const FOV: f32 = 0.6;
/// Largest elevation, radians: straight above there is no up.
const STEEPEST: f32 = 1.45;
/// Lowest elevation, radians.
const LOWEST: f32 = -0.35;
/// Distances, metres.
const DISTANCES_M: [f32; 2] = [0.25, 40.0];
/// Radians for a drag over the height of the picture.
const TURN_PER_HEIGHT: f32 = 4.0;
/// Factor of the distance for a step of the wheel.
const ZOOM_PER_STEP: f32 = 0.9;

impl Orbit {
    /// Camera that shows a whole person, three quarters from the front.
    pub fn person(target: Vec3) -> Self {
        Self {
            target,
            azimuth: 0.5,
            elevation: 0.12,
            distance: 3.6,
        }
    }

    /// Turns by a drag of the mouse, in heights of the picture; +y is down.
    pub fn turn(&mut self, drag: Vec2) {
        self.azimuth -= drag.x * TURN_PER_HEIGHT;
        self.elevation = (self.elevation + drag.y * TURN_PER_HEIGHT).clamp(LOWEST, STEEPEST);
    }

    /// Moves the target with a drag of the mouse, in heights of the picture; +y is down.
    pub fn pan(&mut self, drag: Vec2) {
        let metres = 2.0 * self.distance * (FOV * 0.5).tan();
        let back = self.back();
        let right = Vec3::Y.cross(back).normalize_or_zero();
        self.target += (back.cross(right) * drag.y - right * drag.x) * metres;
    }

    /// Goes nearer by steps of the wheel; negative steps go away.
    pub fn zoom(&mut self, steps: f32) {
        let [nearest, farthest] = DISTANCES_M;
        self.distance = (self.distance * ZOOM_PER_STEP.powf(steps)).clamp(nearest, farthest);
    }

    /// Yaw of the view from +Z towards +X, radians: the direction in which the camera looks.
    pub fn view_yaw(&self) -> f32 {
        self.azimuth + std::f32::consts::PI
    }

    /// Camera of a picture.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn camera(&self) -> Result<Camera, RasterError> {
        Camera::look_at(self.target + self.back() * self.distance, self.target, FOV)
    }

    /// Unit vector from the target to the eye.
    fn back(&self) -> Vec3 {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        Vec3::new(cos_e * sin_a, sin_e, cos_e * cos_a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_to_the_right_shows_the_left_side_of_what_was_in_front() {
        let mut orbit = Orbit::person(Vec3::Y);
        let before = orbit.camera().unwrap();
        orbit.turn(Vec2::new(0.1, 0.0));
        let after = orbit.camera().unwrap();
        // The front of the target moves to the right in the picture, as if it was held.
        let front = Vec3::Y + before.forward() * -0.3;
        let x = |camera: &Camera| camera.project(front, 100, 100).unwrap().x;
        assert!(x(&after) > x(&before));
    }

    #[test]
    fn panning_moves_what_is_seen_with_the_mouse() {
        let mut orbit = Orbit::person(Vec3::Y);
        orbit.pan(Vec2::new(0.2, 0.1));
        let pixel = orbit.camera().unwrap().project(Vec3::Y, 100, 100).unwrap();
        assert!((pixel - Vec2::new(70.0, 60.0)).length() < 1.0, "{pixel}");
    }

    #[test]
    fn elevation_and_distance_stay_in_their_ranges() {
        let mut orbit = Orbit::person(Vec3::Y);
        orbit.turn(Vec2::new(0.0, 100.0));
        orbit.zoom(1e3);
        assert!(orbit.camera().is_ok());
        orbit.zoom(-1e6);
        assert_eq!(orbit.distance, DISTANCES_M[1]);
    }
}
