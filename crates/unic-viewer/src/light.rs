//! Three sources: a key light with a shadow map, a fill light, and the sky.

use glam::{Vec2, Vec3};

use crate::camera::Camera;
use crate::raster::{ScreenPoint, ScreenTriangle, depth_map};
use crate::surface::Surface;

/// Irradiance, linear, of a surface that faces the source; the sum stays near 1, so that a white
/// cloth is white and not clipped.
const KEY: Vec3 = Vec3::new(0.80, 0.77, 0.73);
const FILL: Vec3 = Vec3::new(0.10, 0.11, 0.13);
const SKY: Vec3 = Vec3::new(0.33, 0.35, 0.38);
const FLOOR: Vec3 = Vec3::new(0.20, 0.18, 0.17);

/// Light that fibres scatter at grazing angles: the soft rim of cloth.
const RIM: f32 = 0.10;

/// Part of the light that a back face reflects, so that the inside of a garment tells itself
/// apart from the outside.
const BACK_FACE: f32 = 0.70;

/// Pixels a side of the shadow map.
const MAP_SIDE: usize = 1024;

/// Half width of the shadow filter, texels: (2·HALF + 1)² texels with bilinear weights.
const FILTER_HALF: usize = 2;

/// Texels a side that the filter may touch, wherever it lies between texels.
const TAPS: usize = 2 * FILTER_HALF + 2;

/// Distance from the middle of the filter to its farthest texel, texels: (HALF + 1) · √2.
const FILTER_REACH: f32 = (FILTER_HALF + 1) as f32 * std::f32::consts::SQRT_2;

/// Smallest bias of the depth comparison, metres: below the gap between cloth and skin.
const BIAS_M: f32 = 0.002;

/// A point of a surface, ready for shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) position: Vec3,
    /// Unit normal of the smooth surface, on the side that faces the viewer.
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
        Self {
            to_key,
            to_fill,
            shadow: ShadowMap::new(surfaces, sphere, to_key),
        }
    }

    /// Linear radiance towards the eye.
    pub(crate) fn shade(&self, point: &Point) -> Vec3 {
        let Point { normal, albedo, .. } = *point;
        let cosine = normal.dot(self.to_key);
        let lit = if cosine > 0.0 {
            self.shadow.visibility(point.position, normal)
        } else {
            0.0
        };
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
    (towards * 0.75 - camera.right() * 0.85 + Vec3::Y * 1.0).normalize()
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
        let mut map = Self {
            sphere,
            axes: [u, v, to_light],
            nearness: Vec::new(),
        };
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
        ScreenPoint {
            pixel,
            nearness: light,
        }
    }

    fn texel_m(&self) -> f32 {
        2.0 * self.sphere.radius / MAP_SIDE as f32
    }

    /// Part of the key light that reaches a point, 0 to 1. A plane that leans by θ from the light
    /// rises by reach · tan θ within the filter; a lift of reach · sin θ along the normal raises the
    /// point above that, so that a surface does not shade itself.
    fn visibility(&self, position: Vec3, normal: Vec3) -> f32 {
        let slope = normal.cross(self.axes[2]).length();
        let lift = self.texel_m() * FILTER_REACH * slope;
        let point = self.project(position + normal * lift);
        let threshold = point.nearness + self.texel_m() + BIAS_M;
        let corner = point.pixel - (0.5 + FILTER_HALF as f32);
        let first = corner
            .clamp(Vec2::ZERO, Vec2::splat((MAP_SIDE - TAPS) as f32))
            .floor();
        let (x, y) = (tap_weights(corner.x - first.x), tap_weights(corner.y - first.y));
        let mut sum = 0.0;
        for (row, weight) in y.iter().enumerate() {
            let start = (first.y as usize + row) * MAP_SIDE + first.x as usize;
            let texels = &self.nearness[start..start + TAPS];
            let lit = |(texel, weight): (&f32, &f32)| if *texel <= threshold { *weight } else { 0.0 };
            sum += weight * texels.iter().zip(&x).map(lit).sum::<f32>();
        }
        sum / ((TAPS - 1) * (TAPS - 1)) as f32
    }
}

/// Weights of a box of 2·HALF + 1 texels that has slid by a fraction of a texel.
fn tap_weights(fraction: f32) -> [f32; TAPS] {
    let fraction = fraction.clamp(0.0, 1.0);
    let mut weights = [1.0; TAPS];
    (weights[0], weights[TAPS - 1]) = (1.0 - fraction, fraction);
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Colouring, vertex_normals};

    const SPHERE: Sphere = Sphere {
        centre: Vec3::ZERO,
        radius: 1.0,
    };

    /// An octahedron with four rounds of subdivision onto a sphere of radius 0.9 m.
    fn ball() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let side = |x: f32, y: f32, z: f32| [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
        let signs = [-1.0, 1.0];
        let mut triangles: Vec<[Vec3; 3]> = signs
            .iter()
            .flat_map(|&x| signs.iter().flat_map(move |&y| signs.map(|z| side(x, y, z))))
            .collect();
        for _ in 0..4 {
            triangles = triangles
                .into_iter()
                .flat_map(|[a, b, c]| {
                    let [p, q, r] = [a + b, b + c, c + a].map(Vec3::normalize);
                    [[a, p, r], [p, b, q], [r, q, c], [p, q, r]]
                })
                .collect();
        }
        let vertices: Vec<Vec3> = triangles.as_flattened().iter().map(|v| *v * 0.9).collect();
        let faces = (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        (vertices, faces)
    }

    #[test]
    fn a_convex_body_does_not_shade_itself_and_shades_what_is_behind() {
        let (vertices, faces) = ball();
        let normals = vertex_normals(&vertices, &faces).unwrap();
        let colour = Colouring::Solid([1.0; 3]);
        let surface = Surface {
            vertices: &vertices,
            faces: &faces,
            normals: &normals,
            colour,
        };
        let to_light = Vec3::new(0.3, 0.8, 0.5).normalize();
        let map = ShadowMap::new(&[surface], SPHERE, to_light);
        for vertex in &vertices {
            let normal = vertex.normalize();
            if normal.dot(to_light) > 0.3 {
                assert_eq!(map.visibility(*vertex, normal), 1.0, "{vertex}");
            } else if normal.dot(to_light) < -0.2 {
                assert_eq!(map.visibility(*vertex, normal), 0.0, "{vertex}");
            }
        }
    }

    #[test]
    fn tap_weights_keep_their_sum() {
        for fraction in [0.0, 0.3, 0.999] {
            assert!((tap_weights(fraction).iter().sum::<f32>() - (TAPS - 1) as f32).abs() < 1e-5);
        }
    }
}
