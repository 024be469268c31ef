//! Three sources: a key light with a shadow map, a fill light, and the sky.

use glam::{Vec2, Vec3};

use crate::camera::Camera;
use crate::raster::{ScreenPoint, ScreenTriangle, depth_map};
use crate::surface::Surface;

/// Irradiance, linear, of a surface that faces the source; the sum stays near 1, so that a white
/// cloth is white and not clipped.
const KEY: Vec3 = Vec3::new(0.62, 0.59, 0.55);
const FILL: Vec3 = Vec3::new(0.10, 0.11, 0.13);
const SKY: Vec3 = Vec3::new(0.36, 0.38, 0.41);
const FLOOR: Vec3 = Vec3::new(0.20, 0.18, 0.17);

/// Light that fibres scatter at grazing angles: the soft rim of cloth.
const RIM: f32 = 0.10;

/// Part of the light that a back face reflects, so that the inside of a garment tells itself
/// apart from the outside.
const BACK_FACE: f32 = 0.70;

/// Pixels a side of the shadow map.
const MAP_SIDE: usize = 1024;

/// Half width of the shadow filter, texels: (2·HALF + 1)² texels with bilinear weights.
const FILTER_HALF: i32 = 2;

/// Smallest bias of the depth comparison, metres: below the gap between cloth and skin.
const BIAS_M: f32 = 0.002;

/// A point of a surface, ready for shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) position: Vec3,
    /// Unit normals towards the viewer: of the smooth surface and of the face.
    pub(crate) normal: Vec3,
    /// Unit direction towards the eye.
    pub(crate) to_eye: Vec3,
    pub(crate) albedo: Vec3,
    pub(crate) side: Side,
}

/// Which side of a face the viewer sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// The side from which the corners run counter-clockwise.
    Front,
    /// The other: the lining of a garment.
    Back,
}

pub(crate) struct Lights {
    to_key: Vec3,
    to_fill: Vec3,
    shadow: ShadowMap,
}

impl Lights {
    pub(crate) fn new(surfaces: &[Surface], sphere: Sphere, camera: &Camera) -> Self {
        let to_key = key_direction(camera);
        let towards = camera.right().cross(Vec3::Y);
        let to_fill = (camera.right() + towards * 0.5 + Vec3::Y * 0.2).normalize();
        Self { to_key, to_fill, shadow: ShadowMap::new(surfaces, sphere, to_key) }
    }

    /// Linear radiance towards the eye.
    pub(crate) fn shade(&self, point: &Point) -> Vec3 {
        let Point { normal, albedo, .. } = *point;
        let cosine = normal.dot(self.to_key);
        let lit = if cosine > 0.0 { self.shadow.visibility(point.position, normal) } else { 0.0 };
        let half_lambert = normal.dot(self.to_fill) * 0.5 + 0.5;
        let ambient = FLOOR.lerp(SKY, normal.y * 0.5 + 0.5);
        let light = KEY * (cosine.max(0.0) * lit) + FILL * (half_lambert * half_lambert) + ambient;
        let grazing = (1.0 - normal.dot(point.to_eye)).clamp(0.0, 1.0);
        let rim = ambient * (RIM * grazing * grazing * grazing);
        let reflected = albedo * light + rim;
        match point.side {
            Side::Front => reflected,
            Side::Back => reflected * BACK_FACE,
        }
    }
}

/// Unit direction towards the key light: over the left shoulder of the viewer, whatever the
/// azimuth, so that every picture of a sheet is lit alike.
pub(crate) fn key_direction(camera: &Camera) -> Vec3 {
    let towards = camera.right().cross(Vec3::Y);
    (towards * 0.75 - camera.right() * 0.6 + Vec3::Y * 1.15).normalize()
}

/// A sphere around everything that casts a shadow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere {
    pub(crate) centre: Vec3,
    pub(crate) radius: f32,
}

/// Distances towards a light at infinity, seen from it.
struct ShadowMap {
    sphere: Sphere,
    /// Columns of the map, rows of the map, towards the light.
    axes: [Vec3; 3],
    nearness: Vec<f32>,
}

impl ShadowMap {
    fn new(surfaces: &[Surface], sphere: Sphere, to_light: Vec3) -> Self {
        let (u, v) = to_light.any_orthonormal_pair();
        let mut map = Self { sphere, axes: [u, v, to_light], nearness: Vec::new() };
        let triangles: Vec<ScreenTriangle> = surfaces
            .iter()
            .flat_map(|surface| surface.faces.iter().map(|&face| surface.corners(face)))
            .filter_map(|corners| ScreenTriangle::new(corners.map(|corner| map.project(corner))))
            .collect();
        map.nearness = depth_map(&triangles, MAP_SIDE);
        map
    }

    fn project(&self, point: Vec3) -> ScreenPoint {
        let offset = point - self.sphere.centre;
        let [u, v, light] = self.axes.map(|axis| axis.dot(offset));
        let pixel = (Vec2::new(u, v) / self.sphere.radius * 0.5 + 0.5) * MAP_SIDE as f32;
        ScreenPoint { pixel, nearness: light }
    }

    fn texel_m(&self) -> f32 {
        2.0 * self.sphere.radius / MAP_SIDE as f32
    }

    /// Part of the key light that reaches a point, 0 to 1. The point is lifted along its normal by
    /// the filter's width: a surface must not shade itself.
    fn visibility(&self, position: Vec3, normal: Vec3) -> f32 {
        let lift = self.texel_m() * (FILTER_HALF as f32 + 0.5);
        let point = self.project(position + normal * lift);
        let threshold = point.nearness + self.texel_m() + BIAS_M;
        let corner = point.pixel - 0.5;
        let base = corner.floor();
        let fraction = corner - base;
        let taps = -FILTER_HALF..=FILTER_HALF + 1;
        let sum: f32 = taps
            .clone()
            .map(|y| {
                let row: f32 = taps
                    .clone()
                    .filter(|&x| self.texel(base, x, y) <= threshold)
                    .map(|x| tap_weight(x, fraction.x))
                    .sum();
                row * tap_weight(y, fraction.y)
            })
            .sum();
        sum / ((2 * FILTER_HALF + 1) * (2 * FILTER_HALF + 1)) as f32
    }

    fn texel(&self, base: Vec2, x: i32, y: i32) -> f32 {
        let (x, y) = (base.x as i32 + x, base.y as i32 + y);
        let inside = 0..MAP_SIDE as i32;
        if !inside.contains(&x) || !inside.contains(&y) {
            return f32::NEG_INFINITY;
        }
        self.nearness[y as usize * MAP_SIDE + x as usize]
    }
}

/// A box of 2·HALF + 1 texels that slides by a fraction of a texel.
fn tap_weight(tap: i32, fraction: f32) -> f32 {
    if tap == -FILTER_HALF {
        1.0 - fraction
    } else if tap == FILTER_HALF + 1 {
        fraction
    } else {
        1.0
    }
}
