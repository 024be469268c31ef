//! Scan conversion in fixed point: triangles with a common edge leave no gap and no overlap.

use std::ops::Range;

use glam::{IVec2, Vec2};
use rayon::prelude::*;

/// Fixed-point steps per pixel.
const STEPS: i64 = 256;

/// Largest accepted coordinate, fixed point.
///
/// Edge functions add products of two differences of coordinates, which stay far inside an `i64`.
const MAX_COORDINATE: f32 = (1_u32 << 28) as f32;

/// Number of rows of a band, the unit of parallel work.
pub(crate) const BAND_ROWS: usize = 16;

/// Sample positions inside a pixel, fixed point.
///
/// On this rotated grid no two samples share a row or a column: edges close to horizontal or
/// vertical get four shades between their two colours rather than two.
pub(crate) const PIXEL_SAMPLES: [IVec2; 4] = [
    IVec2::new(96, 32),
    IVec2::new(224, 96),
    IVec2::new(32, 160),
    IVec2::new(160, 224),
];

/// A single sample position at the centre of the pixel, fixed point.
const CENTRE_SAMPLE: [IVec2; 1] = [IVec2::new(128, 128)];

/// A projected vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenPoint {
    /// Position in pixels from the top left corner.
    pub(crate) pixel: Vec2,
    /// Depth that is linear on the screen and grows towards the viewer, such as 1/distance.
    pub(crate) nearness: f32,
}

/// A triangle ready for scan conversion.
#[derive(Clone, Debug)]
pub(crate) struct ScreenTriangle {
    /// Edges, of which edge i lies opposite to corner i.
    edges: [Edge; 3],
    /// 1 over twice the area, fixed point.
    inverse_area: f32,
    /// Nearness of the corners.
    nearness: [f32; 3],
    /// First column and row of pixels that may be covered.
    first: IVec2,
    /// Last column and row of pixels that may be covered, inclusive.
    last: IVec2,
}

/// Edge function a·x + b·y + c, positive inside the triangle.
///
/// Coefficients are integers: the neighbour's function of the same edge is the exact negative.
#[derive(Clone, Copy, Debug)]
struct Edge {
    a: i64,
    b: i64,
    c: i64,
    /// 0 if points on the edge belong to this triangle, −1 if they belong to the neighbour.
    tie: i64,
}

impl Edge {
    fn new(from: IVec2, to: IVec2, sign: i64) -> Self {
        let (from, to) = (from.as_i64vec2(), to.as_i64vec2());
        let (a, b) = (-sign * (to.y - from.y), sign * (to.x - from.x));
        // Of two opposite edges exactly one has these signs: the rule assigns ties to one triangle.
        let owns_ties = a > 0 || (a == 0 && b > 0);
        Self {
            a,
            b,
            c: -(a * from.x + b * from.y),
            tie: i64::from(owns_ties) - 1,
        }
    }

    fn at(&self, x: i64, y: i64) -> i64 {
        self.a * x + self.b * y + self.c
    }
}

impl ScreenTriangle {
    /// Prepares a triangle; `None` if it has no area or coordinates out of range.
    pub(crate) fn new(points: [ScreenPoint; 3]) -> Option<Self> {
        let scaled = points.map(|point| (point.pixel * STEPS as f32).round());
        // NaN fails this comparison too.
        if !scaled.iter().all(|p| p.abs().max_element() <= MAX_COORDINATE) {
            return None;
        }
        let [p, q, r] = scaled.map(|point| point.as_ivec2());
        let area = Edge::new(p, q, 1).at(i64::from(r.x), i64::from(r.y));
        if area == 0 {
            return None;
        }
        // Both windings are drawn: the sign makes edge functions positive inside.
        let sign = area.signum();
        Some(Self {
            edges: [
                Edge::new(q, r, sign),
                Edge::new(r, p, sign),
                Edge::new(p, q, sign),
            ],
            inverse_area: 1.0 / area.abs() as f32,
            nearness: points.map(|point| point.nearness),
            first: p.min(q).min(r).div_euclid(IVec2::splat(STEPS as i32)),
            last: p.max(q).max(r).div_euclid(IVec2::splat(STEPS as i32)),
        })
    }

    /// Barycentric coordinates on the screen of a point at `offset` fixed-point steps from the top
    /// left corner of a pixel.
    pub(crate) fn weights(&self, pixel: IVec2, offset: IVec2) -> [f32; 3] {
        let at = pixel.as_i64vec2() * STEPS + offset.as_i64vec2();
        self.edges
            .map(|edge| edge.at(at.x, at.y) as f32 * self.inverse_area)
    }

    /// Perspective correction: barycentric coordinates in space for those on the screen.
    ///
    /// The nearness must be 1/distance.
    pub(crate) fn perspective(&self, weights: [f32; 3]) -> [f32; 3] {
        let scaled: [f32; 3] = std::array::from_fn(|i| weights[i] * self.nearness[i]);
        let sum: f32 = scaled.iter().sum();
        scaled.map(|weight| weight / sum)
    }

    /// Nearness of a point with the given values of the edge functions.
    fn nearness_at(&self, edge_values: [i64; 3]) -> f32 {
        // Rounding to f32 affects the depth alone: coverage is decided in integers.
        let sum: f32 = (0..3).map(|i| edge_values[i] as f32 * self.nearness[i]).sum();
        sum * self.inverse_area
    }
}

/// Visible triangle at a sample position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Nearness of the triangle at the sample.
    pub(crate) nearness: f32,
    /// Index of the triangle; that of [`Sample::EMPTY`] if there is none.
    pub(crate) triangle: u32,
}

impl Sample {
    /// Sample without a triangle.
    pub(crate) const EMPTY: Self = Self {
        nearness: f32::NEG_INFINITY,
        triangle: u32::MAX,
    };
}

/// Visible triangles of all samples in some rows of a picture, with N samples per pixel.
pub(crate) struct Band<const N: usize> {
    first_row: i32,
    /// Pixels per row.
    width: usize,
    pixels: Vec<[Sample; N]>,
    /// Sample positions inside a pixel, fixed point.
    offsets: [IVec2; N],
}

impl<const N: usize> Band<N> {
    /// Empty band.
    pub(crate) fn new(rows: Range<usize>, width: usize, offsets: [IVec2; N]) -> Self {
        let pixels = vec![[Sample::EMPTY; N]; rows.len() * width];
        Self {
            first_row: rows.start as i32,
            width,
            pixels,
            offsets,
        }
    }

    /// Samples of all pixels, row by row.
    pub(crate) fn pixels(&self) -> &[[Sample; N]] {
        &self.pixels
    }

    /// Draws a triangle. Of two equally near ones, the one drawn first stays.
    pub(crate) fn draw(&mut self, index: u32, triangle: &ScreenTriangle) {
        let rows = (self.pixels.len() / self.width) as i32;
        let last = triangle
            .last
            .min(IVec2::new(self.width as i32, self.first_row + rows) - 1);
        let first = triangle.first.max(IVec2::new(0, self.first_row));
        if first.x > last.x {
            return;
        }
        // Edge functions are linear: values at the samples are those at the pixel's corner plus
        // these.
        let offsets = self
            .offsets
            .map(|o| triangle.edges.map(|e| e.a * o.x as i64 + e.b * o.y as i64));
        for y in first.y..=last.y {
            let start = (y - self.first_row) as usize * self.width;
            let span = start + first.x as usize..=start + last.x as usize;
            let (left, top) = (i64::from(first.x) * STEPS, i64::from(y) * STEPS);
            let mut corner = triangle.edges.map(|edge| edge.at(left, top));
            for pixel in &mut self.pixels[span] {
                draw_pixel(pixel, index, triangle, corner, &offsets);
                (0..3).for_each(|i| corner[i] += triangle.edges[i].a * STEPS);
            }
        }
    }
}

/// Draws a triangle into the samples of one pixel.
///
/// `corner` holds the values of the edge functions at the top left corner of the pixel, `offsets`
/// the differences from there to each sample.
#[inline]
fn draw_pixel<const N: usize>(
    pixel: &mut [Sample; N],
    index: u32,
    triangle: &ScreenTriangle,
    corner: [i64; 3],
    offsets: &[[i64; 3]; N],
) {
    for (sample, offset) in pixel.iter_mut().zip(offsets) {
        let values: [i64; 3] = std::array::from_fn(|i| corner[i] + offset[i]);
        // The sign bit of the union is set if any edge has the sample outside: one branch, not
        // three.
        let outside = (0..3).fold(0, |signs, i| signs | (values[i] + triangle.edges[i].tie));
        if outside < 0 {
            continue;
        }
        let nearness = triangle.nearness_at(values);
        if nearness > sample.nearness {
            *sample = Sample {
                nearness,
                triangle: index,
            };
        }
    }
}

/// Triangles that touch each band of [`BAND_ROWS`] rows, in their order.
pub(crate) fn bands(triangles: &[ScreenTriangle], height: usize) -> Vec<Vec<u32>> {
    let mut bands = vec![Vec::new(); height.div_ceil(BAND_ROWS)];
    for (index, triangle) in (0..).zip(triangles) {
        if triangle.last.y < 0 || triangle.first.y >= height as i32 {
            continue;
        }
        let first = triangle.first.y.max(0) as usize / BAND_ROWS;
        let last = (triangle.last.y as usize).min(height - 1) / BAND_ROWS;
        bands[first..=last].iter_mut().for_each(|band| band.push(index));
    }
    bands
}

/// Greatest nearness in each pixel of a square map with `side` pixels per side, row by row.
///
/// Pixels without a triangle have negative infinity.
pub(crate) fn depth_map(triangles: &[ScreenTriangle], side: usize) -> Vec<f32> {
    let mut map = vec![f32::NEG_INFINITY; side * side];
    map.par_chunks_mut(BAND_ROWS * side)
        .zip(bands(triangles, side))
        .enumerate()
        .for_each(|(index, (out, members))| {
            let first_row = index * BAND_ROWS;
            let rows = first_row..first_row + out.len() / side;
            let mut band = Band::new(rows, side, CENTRE_SAMPLE);
            members.iter().for_each(|&i| band.draw(i, &triangles[i as usize]));
            out.iter_mut()
                .zip(band.pixels())
                .for_each(|(out, [sample])| *out = sample.nearness);
        });
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f32; 2]; 3]) -> ScreenTriangle {
        let points = corners.map(|c| ScreenPoint {
            pixel: Vec2::from(c),
            nearness: 1.0,
        });
        ScreenTriangle::new(points).unwrap()
    }

    fn covered(triangle: &ScreenTriangle, side: usize) -> Vec<bool> {
        depth_map(std::slice::from_ref(triangle), side)
            .iter()
            .map(|n| n.is_finite())
            .collect()
    }

    #[test]
    fn right_triangle_covers_exactly_the_expected_pixels() {
        let side = 20;
        let map = covered(&triangle([[2.0, 3.0], [12.0, 3.0], [2.0, 13.0]]), side);
        for (i, &hit) in map.iter().enumerate() {
            // The centre (x + ½, y + ½) is inside if x > 2, y > 3 and (x − 2) + (y − 3) < 10.
            // Centres on the hypotenuse belong to the other triangle.
            let (x, y) = (i % side, i / side);
            assert_eq!(hit, x >= 2 && y >= 3 && (x - 2) + (y - 3) < 9, "{x} {y}");
        }
    }

    #[test]
    fn a_fan_covers_every_pixel_once() {
        let rim: Vec<[f32; 2]> = (0..12)
            .map(|i| (i as f32 / 12.0 * std::f32::consts::TAU).sin_cos())
            .map(|(s, c)| [16.0 + 14.0 * c, 16.0 + 14.0 * s])
            .collect();
        // The hub is the centre of a pixel, which lies on all twelve edges that end there.
        let hub = [16.5, 16.5];
        let mut hits = vec![0; 32 * 32];
        for i in 0..12 {
            let map = covered(&triangle([hub, rim[i], rim[(i + 1) % 12]]), 32);
            hits.iter_mut()
                .zip(map)
                .for_each(|(count, hit)| *count += u32::from(hit));
        }
        assert_eq!(hits[16 * 32 + 16], 1);
        for (i, &count) in hits.iter().enumerate() {
            let centre = Vec2::new((i % 32) as f32, (i / 32) as f32) + 0.5;
            let depth = |i: usize| {
                let (from, to) = (Vec2::from(rim[i]), Vec2::from(rim[(i + 1) % 12]));
                (to - from).normalize().perp_dot(centre - from)
            };
            let depth = (0..12).map(depth).fold(f32::MAX, f32::min);
            // Corners are rounded to 1/256 of a pixel: close to the rim both answers are right.
            if depth.abs() > 0.01 {
                assert_eq!(count, u32::from(depth > 0.0), "{centre}");
            }
        }
    }

    #[test]
    fn coverage_ignores_winding_and_first_corner() {
        let [a, b, c] = [[1.3, 2.1], [17.9, 5.2], [6.4, 18.8]];
        let reference = covered(&triangle([a, b, c]), 20);
        for corners in [[b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]] {
            assert_eq!(covered(&triangle(corners), 20), reference);
        }
    }

    #[test]
    fn out_of_range_and_degenerate_triangles_are_none() {
        let point = |x: f32| ScreenPoint {
            pixel: Vec2::new(x, 0.0),
            nearness: 1.0,
        };
        assert!(ScreenTriangle::new([point(0.0), point(1.0), point(2.0)]).is_none());
        assert!(ScreenTriangle::new([point(f32::NAN), point(1.0), point(2.0)]).is_none());
        assert!(ScreenTriangle::new([point(1e30), point(1.0), point(2.0)]).is_none());
    }
}
