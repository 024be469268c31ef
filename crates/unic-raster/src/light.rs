//! Lighting from three sources: a key light with a shadow map, a fill light, and the sky.

use glam::{Vec2, Vec3};

use crate::camera::Camera;
use crate::raster::{ScreenPoint, ScreenTriangle, depth_map};
use crate::surface::Surface;

/// Linear irradiance from the key light on a surface that faces it.
///
/// The sum of all sources stays near 1, so that white cloth is white and not clipped.
const KEY: Vec3 = Vec3::new(0.80, 0.77, 0.73);

/// Linear irradiance from the fill light on a surface that faces it.
const FILL: Vec3 = Vec3::new(0.10, 0.11, 0.13);

/// Linear irradiance from the sky on a surface that faces up.
const SKY: Vec3 = Vec3::new(0.33, 0.35, 0.38);

/// Linear irradiance from the floor on a surface that faces down.
const FLOOR: Vec3 = Vec3::new(0.20, 0.18, 0.17);

/// Strength of the light that fibres scatter at grazing angles: the soft rim of cloth.
const RIM: f32 = 0.10;

/// Share of the light that a back face reflects: the inside of a garment is darker than its
/// outside.
const BACK_FACE: f32 = 0.70;

/// Pixels per side of the shadow map.
const MAP_SIDE: usize = 1024;

/// Half width of the shadow filter, texels: (2·HALF + 1)² texels with bilinear weights.
const FILTER_HALF: usize = 2;

/// Texels per side that the filter may touch at any position between texels.
const TAPS: usize = 2 * FILTER_HALF + 2;

/// Distance from the middle of the filter to its farthest texel, texels: (HALF + 1) · √2.
const FILTER_REACH: f32 = (FILTER_HALF + 1) as f32 * std::f32::consts::SQRT_2;

/// Smallest bias of the depth comparison, metres: below the gap between cloth and skin.
const BIAS_M: f32 = 0.002;

/// A point of a surface with all inputs of shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingPoint {
    /// Position, world, metres.
    pub(crate) position: Vec3,
    /// Unit normal of the smooth surface, on the side that faces the viewer.
    pub(crate) normal: Vec3,
    /// Unit direction towards the eye.
    pub(crate) to_eye: Vec3,
    /// Linear albedo.
    pub(crate) albedo: Vec3,
    pub(crate) side: FaceSide,
}

/// Side of a face that is turned towards the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaceSide {
    /// Side from which the corners run counter-clockwise.
    Front,
    /// Side from which the corners run clockwise: the lining of a garment.
    Back,
}

/// Lights of a scene, placed relative to the camera.
pub(crate) struct Lights {
    /// Unit direction towards the key light.
    to_key: Vec3,
    /// Unit direction towards the fill light.
    to_fill: Vec3,
    shadow: ShadowMap,
}

impl Lights {
    /// Places the lights and draws the shadow map of the surfaces in a sphere.
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

    /// Linear radiance of a point towards the eye.
    pub(crate) fn shade(&self, point: &ShadingPoint) -> Vec3 {
        let ShadingPoint { normal, albedo, .. } = *point;
        let cosine = normal.dot(self.to_key);
        // Points that face away from the light need no shadow lookup.
        let lit = if cosine > 0.0 {
            self.shadow.visibility(point.position, normal)
        } else {
            0.0
        };
        // Half Lambert: the fill light is soft and reaches around the body.
        let half_lambert = normal.dot(self.to_fill) * 0.5 + 0.5;
        let ambient = FLOOR.lerp(SKY, normal.y * 0.5 + 0.5);
        let light = KEY * (cosine.max(0.0) * lit) + FILL * (half_lambert * half_lambert) + ambient;
        // Cubed below, so that only grazing angles get a rim.
        let grazing = (1.0 - normal.dot(point.to_eye)).clamp(0.0, 1.0);
        let rim = ambient * (RIM * grazing * grazing * grazing);
        let reflected = albedo * light + rim;
        match point.side {
            FaceSide::Front => reflected,
            FaceSide::Back => reflected * BACK_FACE,
        }
    }
}

/// Unit direction towards the key light, over the left shoulder of the viewer.
///
/// It turns with the camera's azimuth, so that all pictures of a sheet have the same lighting.
pub(crate) fn key_direction(camera: &Camera) -> Vec3 {
    let towards = camera.right().cross(Vec3::Y);
    (towards * 0.75 - camera.right() * 0.85 + Vec3::Y * 1.0).normalize()
}

/// Sphere around all surfaces that cast shadows, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere {
    pub(crate) centre: Vec3,
    pub(crate) radius: f32,
}

/// Depth map of the surfaces as seen from a light at infinity.
struct ShadowMap {
    sphere: Sphere,
    /// Unit directions of the map's columns and rows, and towards the light.
    axes: [Vec3; 3],
    /// Distance of the first surface towards the light from the sphere's centre, by texel, metres.
    nearness: Vec<f32>,
}

impl ShadowMap {
    /// Draws the map.
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

    /// Projects a world point into the map.
    fn project(&self, point: Vec3) -> ScreenPoint {
        let offset = point - self.sphere.centre;
        let [u, v, light] = self.axes.map(|axis| axis.dot(offset));
        let pixel = (Vec2::new(u, v) / self.sphere.radius * 0.5 + 0.5) * MAP_SIDE as f32;
        ScreenPoint {
            pixel,
            nearness: light,
        }
    }

    /// Side of a texel, metres.
    fn texel_m(&self) -> f32 {
        2.0 * self.sphere.radius / MAP_SIDE as f32
    }

    /// Share of the key light that reaches a point, 0 to 1.
    fn visibility(&self, position: Vec3, normal: Vec3) -> f32 {
        // Within the filter, a plane at the angle θ to the light rises by reach · tan θ. Moving the
        // point by reach · sin θ along the normal raises it above that: a surface does not shade
        // itself.
        let slope = normal.cross(self.axes[2]).length();
        let lift = self.texel_m() * FILTER_REACH * slope;
        let point = self.project(position + normal * lift);
        let threshold = point.nearness + self.texel_m() + BIAS_M;
        let corner = point.pixel - (0.5 + FILTER_HALF as f32);
        // At the border of the map the filter is moved inside: the weights are clamped below.
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

/// Filter weights of a box of 2·HALF + 1 texels that is shifted by a fraction of a texel.
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

    /// Sphere of radius 0.9 m: an octahedron after four rounds of subdivision.
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
    fn a_convex_body_shades_its_far_side_alone() {
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
