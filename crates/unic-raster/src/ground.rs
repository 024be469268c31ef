//! The floor: shadows and a grid laid over the background.

use glam::{Vec2, Vec3};

use crate::camera::View;
use crate::light::Sphere;
use crate::raster::{ScreenPoint, ScreenTriangle, depth_map};
use crate::surface::Surface;

/// Distance of the grid lines, metres.
const GRID_M: f32 = 0.5;

/// Width of a grid line, metres.
const LINE_M: f32 = 0.006;

/// Share of the light that a grid line takes away.
const LINE_DARKNESS: f32 = 0.22;

/// Share of the light that the key light's shadow takes away.
const KEY_DARKNESS: f32 = 0.42;

/// Share of the light that the occlusion of the sky takes away.
const SKY_DARKNESS: f32 = 0.38;

/// Blur radius of the key light's shadow, metres.
const KEY_BLUR_M: f32 = 0.025;

/// Blur radius of the occlusion of the sky, metres.
const SKY_BLUR_M: f32 = 0.14;

/// Pixels per side of a shadow map.
const MAP_SIDE: usize = 384;

/// A horizontal plane that receives shadows and fades out around the scene.
pub(crate) struct Floor {
    /// World y, metres.
    height: f32,
    /// Centre of the scene (x, z), metres.
    centre: Vec2,
    /// Distance from the centre at which the grid has faded out, metres.
    fade_radius: f32,
    key_shadow: FloorShadow,
    sky_shadow: FloorShadow,
}

impl Floor {
    /// Floor at a height with the shadows of all surfaces.
    pub(crate) fn new(surfaces: &[Surface], sphere: Sphere, height: f32, to_key: Vec3) -> Self {
        Self {
            height,
            centre: plan(sphere.centre),
            fade_radius: 1.5 + 1.5 * sphere.radius,
            key_shadow: FloorShadow::new(surfaces, height, to_key, KEY_BLUR_M),
            // A wide blur of the projection from above stands for the occlusion of the whole sky.
            sky_shadow: FloorShadow::new(surfaces, height, Vec3::Y, SKY_BLUR_M),
        }
    }

    /// Share of the background's light that remains at a pixel of the floor, 0 to 1.
    pub(crate) fn transmission(&self, view: &View, pixel: Vec2) -> f32 {
        let Some(hit) = self.hit(view, pixel) else {
            return 1.0;
        };
        let distance = hit.distance(self.centre) / self.fade_radius;
        if distance >= 1.0 {
            return 1.0;
        }
        // Value and slope of the grid's strength vanish at the fade radius: no edge is visible.
        let fade = (1.0 - distance * distance) * (1.0 - distance * distance);
        let key = 1.0 - KEY_DARKNESS * self.key_shadow.at(hit);
        let sky = 1.0 - SKY_DARKNESS * self.sky_shadow.at(hit);
        let line = 1.0 - LINE_DARKNESS * fade * self.lines(view, pixel, hit);
        key * sky * line
    }

    /// Point (x, z) in which the ray through a pixel meets the floor, metres.
    fn hit(&self, view: &View, pixel: Vec2) -> Option<Vec2> {
        let ray = view.ray(pixel);
        let t = (self.height - view.eye().y) / ray.y;
        (ray.y < 0.0 && t > 0.0).then(|| plan(view.eye() + ray * t))
    }

    /// Share of the pixel's footprint on the floor that grid lines cover.
    fn lines(&self, view: &View, pixel: Vec2, hit: Vec2) -> f32 {
        let step = |to: Vec2| self.hit(view, pixel + to).map(|next| (next - hit).abs());
        let (Some(right), Some(down)) = (step(Vec2::X), step(Vec2::Y)) else {
            return 0.0;
        };
        // Box around the parallelogram of the pixel; never empty, since it is divided by.
        let footprint = (right + down).max(Vec2::splat(1e-5));
        let x = line_coverage(hit.x, footprint.x);
        let z = line_coverage(hit.y, footprint.y);
        x + z - x * z
    }
}

/// World x and z of a point.
fn plan(point: Vec3) -> Vec2 {
    Vec2::new(point.x, point.z)
}

/// Share of an interval of length `width` around `at` that lies on grid lines.
///
/// It is a box filter of the line pattern in closed form, so that distant lines do not alias.
fn line_coverage(at: f32, width: f32) -> f32 {
    let duty = LINE_M / GRID_M;
    let integral = |t: f32| t.floor() * duty + (t - t.floor()).min(duty);
    let centred = (at + 0.5 * LINE_M) / GRID_M;
    let half = 0.5 * width / GRID_M;
    ((integral(centred + half) - integral(centred - half)) / (2.0 * half)).clamp(0.0, 1.0)
}

/// Blurred parallel projection of all surfaces onto the floor.
struct FloorShadow {
    /// Corner of the map with the least x and z, metres.
    first: Vec2,
    texels_per_metre: f32,
    /// Coverage from 0 to 1 (MAP_SIDE × MAP_SIDE), rows along z.
    coverage: Vec<f32>,
}

impl FloorShadow {
    /// Projects all surfaces away from a light in the direction `to_light`.
    fn new(surfaces: &[Surface], height: f32, to_light: Vec3, blur_m: f32) -> Self {
        let project = |p: Vec3| plan(p - to_light * ((p.y - height) / to_light.y));
        let (min, max) = surfaces
            .iter()
            .flat_map(|surface| surface.vertices)
            .map(|&vertex| project(vertex))
            .filter(|p| p.is_finite())
            .fold((Vec2::MAX, Vec2::MIN), |(min, max), p| (min.min(p), max.max(p)));
        // Three box filters reach three radii; beyond the margin the shadow is zero.
        let margin = 4.0 * blur_m;
        let first = min - margin;
        let extent = (max - min).max_element().max(0.0) + 2.0 * margin;
        let texels_per_metre = MAP_SIDE as f32 / extent;
        let screen_point = |corner: Vec3| ScreenPoint {
            pixel: (project(corner) - first) * texels_per_metre,
            nearness: 1.0,
        };
        let triangles: Vec<ScreenTriangle> = surfaces
            .iter()
            .flat_map(|surface| surface.faces.iter().map(|&face| surface.corners(face)))
            .filter_map(|corners| ScreenTriangle::new(corners.map(screen_point)))
            .collect();
        let mut coverage = depth_map(&triangles, MAP_SIDE);
        coverage.iter_mut().for_each(|n| *n = f32::from(n.is_finite()));
        blur(&mut coverage, (blur_m * texels_per_metre).round() as usize);
        Self {
            first,
            texels_per_metre,
            coverage,
        }
    }

    /// Bilinear coverage at a point of the floor, 0 outside the map.
    fn at(&self, point: Vec2) -> f32 {
        // Texel values belong to the centres of texels.
        let texel = (point - self.first) * self.texels_per_metre - 0.5;
        let limit = (MAP_SIDE - 1) as f32;
        if !(texel.min_element() >= 0.0 && texel.max_element() < limit) {
            return 0.0;
        }
        let (base, fraction) = (texel.floor(), texel - texel.floor());
        let corner = base.y as usize * MAP_SIDE + base.x as usize;
        let row =
            |start: usize| self.coverage[start] * (1.0 - fraction.x) + self.coverage[start + 1] * fraction.x;
        row(corner) * (1.0 - fraction.y) + row(corner + MAP_SIDE) * fraction.y
    }
}

/// Blurs a map by three box filters in each direction, close to a Gaussian.
fn blur(map: &mut Vec<f32>, radius: usize) {
    // Columns, transpose, columns, transpose: both passes read memory in order.
    for _ in 0..2 {
        (0..3).for_each(|_| *map = box_filter(map, radius));
        transpose(map);
    }
}

/// Running mean over 2·radius + 1 rows in all columns; rows beyond the ends count as zero.
fn box_filter(map: &[f32], radius: usize) -> Vec<f32> {
    let row = |y: usize| map.get(y * MAP_SIDE..(y + 1) * MAP_SIDE).unwrap_or(&[]);
    let scale = 1.0 / (2 * radius + 1) as f32;
    let mut sums = vec![0.0; MAP_SIDE];
    (0..radius).for_each(|y| accumulate(&mut sums, row(y), 1.0));
    let mut filtered = Vec::with_capacity(map.len());
    for y in 0..MAP_SIDE {
        accumulate(&mut sums, row(y + radius), 1.0);
        filtered.extend(sums.iter().map(|sum| sum * scale));
        accumulate(&mut sums, y.checked_sub(radius).map_or(&[], row), -1.0);
    }
    filtered
}

/// Adds a row, or subtracts it if `sign` is −1.
fn accumulate(sums: &mut [f32], row: &[f32], sign: f32) {
    sums.iter_mut()
        .zip(row)
        .for_each(|(sum, value)| *sum += sign * value);
}

fn transpose(map: &mut [f32]) {
    for y in 0..MAP_SIDE {
        for x in 0..y {
            map.swap(y * MAP_SIDE + x, x * MAP_SIDE + y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_keeps_the_sum() {
        let mut map = vec![0.0; MAP_SIDE * MAP_SIDE];
        map[200 * MAP_SIDE + 300] = 1.0;
        blur(&mut map, 7);
        assert!((map.iter().sum::<f32>() - 1.0).abs() < 1e-3);
        assert!(map[200 * MAP_SIDE + 300] > map[205 * MAP_SIDE + 300]);
        assert!(map[200 * MAP_SIDE + 330].abs() < 1e-6);
    }

    #[test]
    fn line_coverage_is_the_exact_mean() {
        assert!((line_coverage(0.0, 1e-4) - 1.0).abs() < 1e-3);
        assert!(line_coverage(0.25, 0.1) < 1e-6);
        assert!((line_coverage(0.1, GRID_M * 40.0) - LINE_M / GRID_M).abs() < 1e-4);
        assert!((line_coverage(GRID_M, 4.0 * LINE_M) - 0.25).abs() < 1e-3);
    }
}
