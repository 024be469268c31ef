//! Smooth surface through the convex outlines of the trunk, to lay cloth over.

use super::{BodyShape, GarmentError};
use glam::Vec3;
use std::{f32::consts::TAU, ops::Range};

/// Number of directions in which the support function of an outline is sampled.
const DIRECTIONS: usize = 180;

/// Distance between outlines, metres.
const STEP_M: f32 = 0.01;

/// Passes of the 1-2-1 filter over heights, with a standard deviation of 2 cm.
const HEIGHT_PASSES: usize = 8;

/// Passes of the 1-2-1 filter over directions, with a standard deviation of 4 degrees. They round
/// the corners of a hull.
const ANGLE_PASSES: usize = 8;

/// Most outlines of a surface but for one, whatever the size of the body.
const MOST_OUTLINES: f32 = 1000.0;

/// Convex outlines of the trunk at all heights, as a skirt that falls from the waist encloses them.
///
/// Below the waist outlines never shrink, and in every direction they follow a taut line. A point
/// on the surface is given by its height and by the share u of the outline's length: 0 at the front
/// (+Z) and growing towards the left (+X), modulo one.
#[derive(Clone, Debug)]
pub(crate) struct TrunkSurface {
    /// Height of the first outline, metres; the others follow every [`STEP_M`].
    lowest: f32,
    outlines: Vec<Outline>,
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    pub(crate) position: Vec3,
    /// Unit normal, away from the body.
    pub(crate) normal: Vec3,
}

impl SurfacePoint {
    /// Point at the distance `level` off the surface, metres.
    pub(crate) fn raised_by(self, level: f32) -> Vec3 {
        self.position + self.normal * level
    }

    pub(crate) fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            position: self.position.lerp(other.position, t),
            normal: self.normal.lerp(other.normal, t).normalize_or(self.normal),
        }
    }
}

/// Closed convex curve at one height.
#[derive(Clone, Debug)]
struct Outline {
    /// Points by the direction of their normal; the first is repeated at the end.
    points: Vec<Vec3>,
    /// Length of the curve up to each point, metres.
    along: Vec<f32>,
}

impl TrunkSurface {
    /// Computes the outlines within a range of heights (world y, metres) that contains the waist.
    ///
    /// From the height `straight` upward all outlines are the same one, around all of them.
    ///
    /// # Errors
    /// [`GarmentError::NoSection`] without a trunk at one of the heights.
    pub(crate) fn new(
        body: &BodyShape,
        heights: Range<f32>,
        waist: f32,
        straight: f32,
    ) -> Result<Self, GarmentError> {
        let lowest = heights.start;
        let count = ((heights.end - lowest) / STEP_M).ceil().clamp(1.0, MOST_OUTLINES) as usize + 1;
        let height = |row: usize| lowest + row as f32 * STEP_M;
        let mut supports = Vec::with_capacity(count);
        for row in 0..count {
            supports.push(support(body, height(row).min(heights.end))?);
        }
        drape_below(&mut supports, ((waist - lowest) / STEP_M) as usize);
        let straight = ((straight - lowest) / STEP_M).clamp(0.0, count as f32) as usize;
        enclose(&mut supports[straight..]);
        (0..HEIGHT_PASSES).for_each(|_| smooth_heights(&mut supports));
        let outlines = supports.iter().enumerate();
        Ok(Self {
            lowest,
            outlines: outlines.map(|(row, s)| Outline::new(s, height(row))).collect(),
        })
    }

    /// Point at a height and a share u of the outline's length.
    ///
    /// Heights outside the range of the surface are clamped to it.
    pub(crate) fn surface_point(&self, height: f32, u: f32) -> SurfacePoint {
        self.point_on_offset(height, u, 0.0)
    }

    /// Point below the share u of the outline that lies `level` metres off the surface.
    ///
    /// An offset outline is longer where the curve turns: its shares are other points.
    pub(crate) fn point_on_offset(&self, height: f32, u: f32, level: f32) -> SurfacePoint {
        let (row, t) = self.row(height);
        let of = |row: usize| self.outlines[row].surface_point(u, level);
        of(row).lerp(of(row + 1), t)
    }

    /// Length of the outline at a height that lies `level` metres off the surface, metres.
    pub(crate) fn circumference(&self, height: f32, level: f32) -> f32 {
        let (row, t) = self.row(height);
        let of = |row: usize| self.outlines[row].length();
        // Cauchy: the length is the integral of the support function, to which an offset adds a
        // constant.
        of(row) * (1.0 - t) + of(row + 1) * t + TAU * level
    }

    /// Share u at which the normal points to the left, on the outline `level` metres off the
    /// surface.
    pub(crate) fn left_side(&self, height: f32, level: f32) -> f32 {
        let (row, t) = self.row(height);
        let of = |row: usize| {
            let outline = &self.outlines[row];
            (outline.along[DIRECTIONS / 4] + 0.25 * TAU * level) / (outline.length() + TAU * level)
        };
        of(row) * (1.0 - t) + of(row + 1) * t
    }

    /// Outline below a height, and the share of the way from it to the next one.
    fn row(&self, height: f32) -> (usize, f32) {
        let last = self.outlines.len() - 1;
        let at = ((height - self.lowest) / STEP_M).clamp(0.0, last as f32);
        let row = (at as usize).min(last - 1);
        (row, at - row as f32)
    }
}

impl Outline {
    /// Envelope p(θ) = h n + h' n' of a support function h about the vertical axis.
    fn new(support: &[f32], height: f32) -> Self {
        let step = TAU / DIRECTIONS as f32;
        let of = |k: usize| support[k % DIRECTIONS];
        let point = |k: usize| {
            let slope = (of(k + 1) - of(k + DIRECTIONS - 1)) / (2.0 * step);
            let normal = direction(k as f32);
            let tangent = Vec3::Y.cross(normal);
            Vec3::Y * height + normal * of(k) + tangent * slope
        };
        let points: Vec<Vec3> = (0..=DIRECTIONS).map(point).collect();
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        Self { points, along }
    }

    fn length(&self) -> f32 {
        self.along[DIRECTIONS]
    }

    fn surface_point(&self, u: f32, level: f32) -> SurfacePoint {
        // An offset curve is longer by the offset times the angle turned.
        let along = |k: usize| self.along[k] + level * TAU * k as f32 / DIRECTIONS as f32;
        // A binary search: these lengths depend on the level and are not stored.
        let s = u.rem_euclid(1.0) * along(DIRECTIONS);
        let (mut last, mut next) = (0, DIRECTIONS);
        while next - last > 1 {
            let middle = last.midpoint(next);
            if along(middle) <= s {
                last = middle;
            } else {
                next = middle;
            }
        }
        let t = ((s - along(last)) / (along(next) - along(last)).max(1e-9)).clamp(0.0, 1.0);
        SurfacePoint {
            position: self.points[last].lerp(self.points[next], t),
            normal: direction(last as f32 + t),
        }
    }
}

/// Unit vector at the angle 2πk / [`DIRECTIONS`] from the front towards the left.
fn direction(k: f32) -> Vec3 {
    let (sin, cos) = (TAU * k / DIRECTIONS as f32).sin_cos();
    Vec3::new(sin, 0.0, cos)
}

/// Smoothed support function of the trunk at a height, about the world's vertical axis.
fn support(body: &BodyShape, height: f32) -> Result<Vec<f32>, GarmentError> {
    let ring = body.trunk_ring(height)?;
    // A ring's own support function refers to the origin of the ring.
    let reach = |k: usize| {
        let angle = TAU * k as f32 / DIRECTIONS as f32;
        ring.support(angle) + ring.origin().dot(direction(k as f32))
    };
    let mut support: Vec<f32> = (0..DIRECTIONS).map(reach).collect();
    for _ in 0..ANGLE_PASSES {
        let of = |k: usize| support[k % DIRECTIONS];
        let mean = |k: usize| 0.5 * of(k) + 0.25 * (of(k + 1) + of(k + DIRECTIONS - 1));
        support = (0..DIRECTIONS).map(mean).collect();
    }
    Ok(support)
}

/// Replaces all outlines by the smallest one around all of them.
///
/// The maximum of support functions is the support function of the common hull.
fn enclose(supports: &mut [Vec<f32>]) {
    for k in 0..DIRECTIONS {
        let most = supports.iter().map(|s| s[k]).fold(f32::MIN, f32::max);
        supports.iter_mut().for_each(|s| s[k] = most);
    }
}

/// Makes the outlines below the waist those of cloth drawn taut over hips and legs.
///
/// In every direction the support becomes the least function of the height that is nowhere below
/// the body's, concave, and does not decrease towards the hem.
fn drape_below(supports: &mut [Vec<f32>], waist: usize) {
    let top = waist.min(supports.len() - 1);
    for k in 0..DIRECTIONS {
        let mut reach: Vec<f32> = supports[..=top].iter().rev().map(|s| s[k]).collect();
        for down in 1..reach.len() {
            reach[down] = reach[down].max(reach[down - 1]);
        }
        let taut = concave_majorant(&reach);
        let below = supports[..=top].iter_mut().rev();
        below.zip(taut).for_each(|(support, reach)| support[k] = reach);
    }
}

/// Least concave sequence that is nowhere below the given one.
fn concave_majorant(values: &[f32]) -> Vec<f32> {
    // Upper convex hull of the points (i, values[i]) by a monotone chain.
    let mut corners: Vec<usize> = Vec::new();
    let slope = |a: usize, b: usize| (values[b] - values[a]) / (b - a) as f32;
    for i in 0..values.len() {
        while let [.., a, b] = corners[..]
            && slope(a, b) <= slope(b, i)
        {
            corners.pop();
        }
        corners.push(i);
    }
    let mut majorant = vec![values[0]];
    for pair in corners.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        majorant.extend((a + 1..=b).map(|i| values[a] + slope(a, b) * (i - a) as f32));
    }
    majorant
}

/// One pass of the 1-2-1 filter over heights; the first and last outlines stay.
fn smooth_heights(supports: &mut [Vec<f32>]) {
    let before = supports.to_vec();
    for row in 1..supports.len() - 1 {
        for k in 0..DIRECTIONS {
            supports[row][k] = 0.5 * before[row][k] + 0.25 * (before[row - 1][k] + before[row + 1][k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_concave_majorant_is_the_upper_hull() {
        assert_eq!(
            concave_majorant(&[0.0, 3.0, 3.5, 2.0, 5.0]),
            [0.0, 3.0, 3.6666667, 4.3333335, 5.0]
        );
        assert_eq!(concave_majorant(&[1.0]), [1.0]);
    }

    #[test]
    fn an_ellipse_is_walked_evenly_and_offset_along_its_normals() {
        let support = |k: usize| (direction(k as f32) * Vec3::new(0.2, 0.0, 0.1)).length();
        let supports: Vec<f32> = (0..DIRECTIONS).map(support).collect();
        let outlines = (0..3)
            .map(|row| Outline::new(&supports, row as f32 * STEP_M))
            .collect();
        let trunk = TrunkSurface {
            lowest: 0.0,
            outlines,
        };
        assert!((trunk.circumference(0.01, 0.03) - (0.9688 + TAU * 0.03)).abs() < 2e-3);
        assert!((trunk.left_side(0.005, 0.02) - 0.25).abs() < 1e-3);
        for k in 0..16 {
            let surface_point = trunk.surface_point(0.015, k as f32 / 16.0);
            let on = surface_point.position / Vec3::new(0.2, 1.0, 0.1);
            assert!((on.with_y(0.0).length() - 1.0).abs() < 2e-3);
            assert!((surface_point.position.y - 0.015).abs() < 1e-6);
            let gradient = surface_point.position / Vec3::new(0.04, 1.0, 0.01);
            assert!(gradient.with_y(0.0).normalize().dot(surface_point.normal) > 0.999);
        }
    }
}
