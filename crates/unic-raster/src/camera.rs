use glam::{Mat3, Mat4, Vec2, Vec3};

use crate::RasterError;

/// Distance of the near clipping plane, metres.
///
/// The depth test uses 1/distance, so that a small value costs no precision.
const NEAR_M: f32 = 0.01;

/// Vertical angle of view of [`Camera::framing`], radians: a portrait lens that keeps proportions.
const FRAMING_FOV: f32 = 0.52;

/// Share of the picture that [`Camera::framing`] fills; the rest is margin.
const FRAMING_FILL: f32 = 0.9;

/// A perspective camera without roll.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the eye, world, metres.
    eye: Vec3,
    /// Columns: right, up, back (towards the viewer). The view direction is the camera's −Z.
    world_from_camera: Mat3,
    /// Tangent of half the vertical angle of view.
    tan_half_fov: f32,
}

impl Camera {
    /// Camera at `eye` that is aimed at `target` (world, metres).
    ///
    /// `vertical_fov` is the vertical angle of view in radians. If the view is straight up or down,
    /// +X is to the right.
    ///
    /// # Errors
    /// [`RasterError::Camera`] if a value is not finite, `eye` is `target`, or the angle is not
    /// inside 0 to π.
    pub fn look_at(eye: Vec3, target: Vec3, vertical_fov: f32) -> Result<Self, RasterError> {
        let back = (eye - target)
            .try_normalize()
            .ok_or_else(|| RasterError::Camera {
                expected: "finite and distinct eye and target",
                found: format!("eye {eye}, target {target}"),
            })?;
        // Straight up or down, the cross product vanishes.
        let right = Vec3::Y.cross(back).try_normalize().unwrap_or(Vec3::X);
        Self::new(eye, right, back, vertical_fov)
    }

    /// Camera that is aimed at the centre of a box and shows all of it.
    ///
    /// `azimuth` (radians) turns the eye around +Y: 0 shows the front of a character that faces +Z,
    /// π/2 its left side, from +X. `elevation` (radians) lifts the eye above the horizon. `aspect`
    /// is width / height of the picture. To follow a character, frame it once and use
    /// [`Camera::moved_by`].
    ///
    /// # Errors
    /// [`RasterError::Camera`] if a value is not finite, `bounds_min` exceeds `bounds_max`, or
    /// `aspect` is not positive.
    pub fn framing(
        bounds_min: Vec3,
        bounds_max: Vec3,
        azimuth: f32,
        elevation: f32,
        aspect: f32,
    ) -> Result<Self, RasterError> {
        check_framing(bounds_min, bounds_max, azimuth, elevation, aspect)?;
        let (sin_a, cos_a) = azimuth.sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        // Spherical coordinates: azimuth from +Z towards +X, elevation towards +Y.
        let back = Vec3::new(cos_e * sin_a, sin_e, cos_e * cos_a);
        let aimed = Self::new(Vec3::ZERO, Vec3::new(cos_a, 0.0, -sin_a), back, FRAMING_FOV)?;
        let half = (bounds_max - bounds_min) * 0.5;
        // A box of one point would put the eye into it.
        let distance = aimed.fitting_distance(half, aspect).max(2.0 * NEAR_M);
        Ok(aimed.moved_by(bounds_min + half + back * distance))
    }

    /// Camera that shows all points from as near as their outline allows.
    ///
    /// It is nearer than [`Camera::framing`] with the box around the points. Points that are not
    /// finite are left out. Angles and aspect are those of [`Camera::framing`].
    ///
    /// # Errors
    /// [`RasterError::Camera`] if an angle is not finite, `aspect` is not positive, or no point is
    /// finite.
    pub fn around(points: &[Vec3], azimuth: f32, elevation: f32, aspect: f32) -> Result<Self, RasterError> {
        let points = || points.iter().copied().filter(|p| p.is_finite());
        // Only the axes of this camera are used: they do not depend on its box.
        let turned = Self::framing(Vec3::ZERO, Vec3::ZERO, azimuth, elevation, aspect)?.world_from_camera;
        let seen = |p: Vec3| turned.transpose() * p;
        let (min, max) = points()
            .map(seen)
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            });
        let centre = turned * ((min + max) * 0.5);
        // Without a finite point, min is still infinite and is refused.
        check_framing(min, max, azimuth, elevation, aspect)?;
        let aimed = Self::new(Vec3::ZERO, turned.x_axis, turned.z_axis, FRAMING_FOV)?;
        let distance = aimed.distance_to_fit(points().map(|p| p - centre), aspect);
        Ok(aimed.moved_by(centre + turned.z_axis * distance.max(2.0 * NEAR_M)))
    }

    fn new(eye: Vec3, right: Vec3, back: Vec3, vertical_fov: f32) -> Result<Self, RasterError> {
        let tan_half_fov = (vertical_fov * 0.5).tan();
        if !(vertical_fov > 0.0 && vertical_fov < std::f32::consts::PI) {
            return Err(RasterError::Camera {
                expected: "a vertical angle of view between 0 and pi radians",
                found: vertical_fov.to_string(),
            });
        }
        let world_from_camera = Mat3::from_cols(right, back.cross(right), back);
        Ok(Self {
            eye,
            world_from_camera,
            tan_half_fov,
        })
    }

    /// Smallest distance from the centre of a box with half extents `half` at which its eight
    /// corners project inside the picture, metres.
    fn fitting_distance(&self, half: Vec3, aspect: f32) -> f32 {
        let corner = |corner: u32| {
            let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            half * Vec3::new(sign(0), sign(1), sign(2))
        };
        self.distance_to_fit((0..8).map(corner), aspect)
    }

    /// Smallest distance from the origin at which points around it project inside the picture,
    /// metres.
    fn distance_to_fit(&self, points: impl Iterator<Item = Vec3>, aspect: f32) -> f32 {
        let tan_y = self.tan_half_fov * FRAMING_FILL;
        let distance_for = |point: Vec3| {
            let p = self.world_from_camera.transpose() * point;
            // At the distance d the point is d − z in front of the eye, and |x| must be at most
            // tan_x times that; likewise for y.
            p.z + (p.x.abs() / (tan_y * aspect)).max(p.y.abs() / tan_y)
        };
        points.map(distance_for).fold(0.0, f32::max)
    }

    /// Same view from an eye that is displaced by `offset` metres, to follow a moving character.
    #[must_use]
    pub fn moved_by(self, offset: Vec3) -> Self {
        Self {
            eye: self.eye + offset,
            ..self
        }
    }

    /// Position of the eye, world, metres.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Unit direction of the view, world.
    pub fn forward(&self) -> Vec3 {
        -self.world_from_camera.z_axis
    }

    pub(crate) fn right(&self) -> Vec3 {
        self.world_from_camera.x_axis
    }

    /// Clip space of a graphics API for a picture of width / height `aspect`.
    ///
    /// Depth is reversed: 1 at the near plane, 0 infinitely far.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let fov = 2.0 * self.tan_half_fov.atan();
        let clip_from_camera =
            glam::camera::rh::proj::directx::perspective_infinite_reverse(fov, aspect, NEAR_M);
        let camera_from_world = self.world_from_camera.transpose();
        let to_eye = camera_from_world * -self.eye;
        clip_from_camera * Mat4::from_translation(to_eye) * Mat4::from_mat3(camera_from_world)
    }

    /// Axes of rays through a picture of width / height `aspect`: right, up and forward, world.
    ///
    /// The ray through the place (x, y), each from −1 to 1 with +y up, is x · right + y · up +
    /// forward.
    pub fn ray_axes(&self, aspect: f32) -> [Vec3; 3] {
        let axes = self.world_from_camera;
        [
            axes.x_axis * (self.tan_half_fov * aspect),
            axes.y_axis * self.tan_half_fov,
            -axes.z_axis,
        ]
    }

    /// Projects a world point into a picture of `width` × `height` pixels.
    ///
    /// The result is in pixels from the top left corner, +Y down, and may lie outside the picture.
    /// It is `None` for points behind the eye or nearer than the near plane.
    pub fn project(&self, point: Vec3, width: u32, height: u32) -> Option<Vec2> {
        let view = self.view(width, height);
        let clip = view.clip_from_world(point);
        (clip.z >= NEAR_M).then(|| view.pixel_from_clip(clip))
    }

    pub(crate) fn view(&self, width: u32, height: u32) -> View {
        let size = Vec2::new(width as f32, height as f32);
        let tan = Vec2::new(self.tan_half_fov * size.x / size.y, self.tan_half_fov);
        View {
            camera: *self,
            tan,
            size,
        }
    }
}

fn check_framing(min: Vec3, max: Vec3, azimuth: f32, elevation: f32, aspect: f32) -> Result<(), RasterError> {
    let is_box = min.is_finite() && max.is_finite() && min.cmple(max).all();
    let are_angles = azimuth.is_finite() && elevation.is_finite();
    if is_box && are_angles && aspect.is_finite() && aspect > 0.0 {
        return Ok(());
    }
    Err(RasterError::Camera {
        expected: "a finite box with min <= max, finite angles and a positive aspect",
        found: format!("box {min} to {max}, angles [{azimuth:?}, {elevation:?}], aspect {aspect}"),
    })
}

/// A camera together with the size of the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    camera: Camera,
    /// Tangents of half the horizontal and half the vertical angle of view.
    tan: Vec2,
    /// Width and height, pixels.
    size: Vec2,
}

impl View {
    pub(crate) const NEAR: f32 = NEAR_M;

    pub(crate) fn eye(&self) -> Vec3 {
        self.camera.eye
    }

    /// Homogeneous clip coordinates (x, y, w) of a world point.
    ///
    /// Inside the picture x/w and y/w are within ±1; w is the distance along the view in metres.
    pub(crate) fn clip_from_world(&self, point: Vec3) -> Vec3 {
        let p = self.camera.world_from_camera.transpose() * (point - self.camera.eye);
        Vec3::new(p.x / self.tan.x, p.y / self.tan.y, -p.z)
    }

    /// Pixels from the top left corner, +Y down, for clip coordinates with w > 0.
    pub(crate) fn pixel_from_clip(&self, clip: Vec3) -> Vec2 {
        // Rows of a picture grow downward.
        let ndc = Vec2::new(clip.x, -clip.y) / clip.z;
        (ndc * 0.5 + 0.5) * self.size
    }

    /// World direction through a point of the picture, not normalised: one metre along the view.
    pub(crate) fn ray(&self, pixel: Vec2) -> Vec3 {
        let ndc = pixel / self.size * 2.0 - 1.0;
        let xy = Vec2::new(ndc.x, -ndc.y) * self.tan;
        self.camera.world_from_camera * xy.extend(-1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn framing_contains_all_corners_and_one_touches_the_margin() {
        let (min, max) = (Vec3::new(-0.4, 0.0, -0.2), Vec3::new(0.5, 1.8, 0.3));
        for (azimuth, elevation) in [(0.0, 0.0), (0.7, 0.3), (-2.0, -0.5), (3.0, 1.5)] {
            let camera = Camera::framing(min, max, azimuth, elevation, 0.75).unwrap();
            let mut widest = 0.0_f32;
            for corner in 0..8 {
                let pick = |axis: usize| {
                    if corner >> axis & 1 == 0 {
                        min[axis]
                    } else {
                        max[axis]
                    }
                };
                let point = Vec3::new(pick(0), pick(1), pick(2));
                let pixel = camera.project(point, 600, 800).unwrap();
                let ndc = (pixel / Vec2::new(300.0, 400.0) - 1.0).abs();
                widest = widest.max(ndc.max_element());
            }
            assert!((widest - FRAMING_FILL).abs() < 1e-3, "{widest}");
        }
    }

    #[test]
    fn a_camera_around_points_shows_all_of_them_from_nearer_than_their_box() {
        let ring = |k: usize| {
            Vec3::new(
                (k as f32).cos(),
                1.0 + 0.2 * (k as f32).sin(),
                (k as f32 * 0.7).sin(),
            )
        };
        let mut points: Vec<Vec3> = (0..40).map(ring).collect();
        let near = Camera::around(&points, 0.6, 0.3, 0.75).unwrap();
        for &point in &points {
            let pixel = near.project(point, 600, 800).unwrap();
            let ndc = (pixel / Vec2::new(300.0, 400.0) - 1.0).abs();
            assert!(ndc.max_element() < FRAMING_FILL + 1e-3, "{ndc}");
        }
        let min = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let max = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let far = Camera::framing(min, max, 0.6, 0.3, 0.75).unwrap();
        let distance = |camera: Camera| camera.eye().distance((min + max) * 0.5);
        assert!(distance(near) < distance(far));
        points.push(Vec3::NAN);
        assert_eq!(Camera::around(&points, 0.6, 0.3, 0.75).unwrap(), near);
        assert!(Camera::around(&[Vec3::NAN], 0.6, 0.3, 0.75).is_err());
    }

    #[test]
    fn image_axes_follow_the_conventions() {
        let camera = Camera::framing(-Vec3::ONE, Vec3::ONE, 0.0, 0.0, 1.0).unwrap();
        let centre = camera.project(Vec3::ZERO, 100, 100).unwrap();
        assert!((centre - Vec2::splat(50.0)).length() < 1e-3);
        assert!(camera.project(Vec3::X, 100, 100).unwrap().x > 50.0);
        assert!(camera.project(Vec3::Y, 100, 100).unwrap().y < 50.0);
        let side = Camera::framing(-Vec3::ONE, Vec3::ONE, std::f32::consts::FRAC_PI_2, 0.0, 1.0).unwrap();
        assert!(side.eye().x > 1.0);
        assert!(side.project(Vec3::Z, 100, 100).unwrap().x < 50.0);
    }

    #[test]
    fn rays_and_projection_are_inverse() {
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::Y, 0.8).unwrap();
        let pixel = Vec2::new(123.25, 45.5);
        let point = camera.eye() + camera.view(320, 200).ray(pixel) * 2.5;
        assert!((camera.project(point, 320, 200).unwrap() - pixel).length() < 1e-3);
    }

    #[test]
    fn clip_space_and_ray_axes_agree_with_the_projection() {
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::Y, 0.8).unwrap();
        let point = Vec3::new(0.3, 0.9, 0.4);
        let pixel = camera.project(point, 320, 200).unwrap();
        let clip = camera.clip_from_world(1.6) * point.extend(1.0);
        let place = Vec2::new(clip.x, clip.y) / clip.w;
        let shown = Vec2::new(place.x + 1.0, 1.0 - place.y) * Vec2::new(160.0, 100.0);
        assert!((shown - pixel).length() < 1e-2, "{shown} {pixel}");
        let depth = (point - camera.eye()).dot(camera.forward());
        assert!((clip.z / clip.w - NEAR_M / depth).abs() < 1e-6);
        let [right, up, forward] = camera.ray_axes(1.6);
        let through = camera.eye() + (right * place.x + up * place.y + forward) * depth;
        assert!((through - point).length() < 1e-4, "{through}");
    }

    #[test]
    fn invalid_cameras_are_refused() {
        assert!(Camera::look_at(Vec3::ONE, Vec3::ONE, 0.5).is_err());
        assert!(Camera::look_at(Vec3::ONE, Vec3::ZERO, 0.0).is_err());
        assert!(Camera::look_at(Vec3::NAN, Vec3::ZERO, 0.5).is_err());
        assert!(Camera::look_at(Vec3::Y, Vec3::ZERO, 0.5).is_ok());
        assert!(Camera::framing(Vec3::ONE, Vec3::ZERO, 0.0, 0.0, 1.0).is_err());
        assert!(Camera::framing(Vec3::ZERO, Vec3::ONE, 0.0, 0.0, 0.0).is_err());
        assert!(Camera::framing(Vec3::ZERO, Vec3::ZERO, 0.0, 0.0, 1.0).is_ok());
    }
}
