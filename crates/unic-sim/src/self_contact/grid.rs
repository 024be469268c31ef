//! Broad phase of self-contact: a periodic uniform grid of moving points.

use super::moving_points::MovingPoints;
use glam::Vec3;
use std::ops::Range;

/// Largest absolute cell coordinate. Points farther out are put into the outermost cells, because
/// f32 cannot tell their cells apart and i32 would overflow.
const HALF_AXIS: f32 = (1 << 20) as f32;

/// Target ratio of cells to points. Cloth is a surface, so that most cells are empty.
const CELLS_PER_POINT: f32 = 4.0;

/// Smallest and largest number of cells along an axis.
const SIDE_RANGE: [usize; 2] = [8, 64];

/// A uniform grid that repeats in all directions: a spatial hash whose hash is the cell coordinate
/// modulo the grid's side.
///
/// A cell holds the points of all cells of space that map to it, so that the grid covers any
/// extent. Queries must therefore test the positions of the points that they get. Cells that follow
/// one another along z do so in memory, so that a query visits few contiguous ranges. Rebuilding
/// does not allocate once the buffers have grown.
#[derive(Clone, Debug, Default)]
pub(super) struct PointGrid {
    /// Size of a cell, metres.
    cell_m: f32,
    /// Number of cells along an axis; a power of two.
    side: usize,
    /// Row starts of `points`: those of cell i are `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    points: MovingPoints,
}

impl PointGrid {
    /// Sorts points into cells of `cell_m` metres. Points that are not finite are left out.
    pub(super) fn build(&mut self, points: &[Vec3], velocities: &[Vec3], cell_m: f32) {
        self.cell_m = cell_m;
        let side = (CELLS_PER_POINT * points.len() as f32).cbrt() as usize;
        self.side = side.next_power_of_two().clamp(SIDE_RANGE[0], SIDE_RANGE[1]);
        self.count(points);
        let count = self.starts.last().map_or(0, |&count| count as usize);
        self.points.reset(count);
        // Backwards, so that the points of a cell keep their order: the second half of a counting
        // sort, which turns the ends of the cells into their starts.
        for (index, (&position, &velocity)) in points.iter().zip(velocities).enumerate().rev() {
            if position.is_finite() {
                let cell = self.index(self.cell(position));
                self.starts[cell] -= 1;
                self.points
                    .set(self.starts[cell] as usize, index as u32, position, velocity);
            }
        }
    }

    /// Returns the points, sorted by cell.
    pub(super) fn points(&self) -> &MovingPoints {
        &self.points
    }

    /// Counts the points of each cell and leaves the end of each cell in `starts`.
    fn count(&mut self, points: &[Vec3]) {
        self.starts.clear();
        self.starts.resize(self.side.pow(3) + 1, 0);
        for &point in points.iter().filter(|p| p.is_finite()) {
            let cell = self.index(self.cell(point));
            self.starts[cell] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
    }

    /// Calls `visit` with ranges of points that contain all points of the box from `low` to `high`.
    ///
    /// The ranges also contain other points. No point is visited twice, and the order is always the
    /// same.
    #[inline]
    pub(super) fn ranges_around(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(Range<usize>)) {
        let (first, last) = (self.cell(low), self.cell(high));
        let side = self.side as i32;
        // A box as wide as the grid would visit cells twice.
        if (0..3).any(|axis| last[axis] - first[axis] >= side) {
            return visit(0..self.points.len());
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                let [from, to] = [first[2], last[2]].map(|z| self.index([x, y, z]));
                if from <= to {
                    visit(self.row(from..to + 1));
                } else {
                    // The range wraps around the end of the row.
                    let row = self.index([x, y, 0]);
                    visit(self.row(from..row + self.side));
                    visit(self.row(row..to + 1));
                }
            }
        }
    }

    #[inline]
    fn row(&self, cells: Range<usize>) -> Range<usize> {
        self.starts[cells.start] as usize..self.starts[cells.end] as usize
    }

    #[inline]
    fn cell(&self, p: Vec3) -> [i32; 3] {
        (p / self.cell_m)
            .floor()
            .clamp(Vec3::splat(-HALF_AXIS), Vec3::splat(HALF_AXIS - 1.0))
            .to_array()
            .map(|x| x as i32)
    }

    #[inline]
    fn index(&self, cell: [i32; 3]) -> usize {
        let [x, y, z] = cell.map(|x| x as usize & (self.side - 1));
        (x * self.side + y) * self.side + z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{collection::vec, prelude::*};

    fn point(reach: f32) -> impl Strategy<Value = Vec3> {
        let axis = || -reach..=reach;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn every_point_in_a_box_is_found_once(
            points in vec(point(1.0), 0..200), a in point(1.2), b in point(1.2), cell_m in 0.01f32..0.5,
        ) {
            let (low, high) = (a.min(b), a.max(b));
            let mut grid = PointGrid::default();
            let velocities: Vec<Vec3> = points.iter().map(|p| -p).collect();
            grid.build(&points, &velocities, cell_m);
            let is_in = |p: Vec3| p.cmpge(low).all() && p.cmple(high).all();
            let mut found = Vec::new();
            grid.ranges_around(low, high, |range| for entry in range {
                let (index, point) = (grid.points().index(entry), grid.points().point(entry));
                assert_eq!(point, (points[index as usize], velocities[index as usize]));
                found.extend(is_in(point.0).then_some(index));
            });
            found.sort_unstable();
            let expected: Vec<u32> = (0..points.len() as u32).filter(|&i| is_in(points[i as usize])).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn points_that_are_not_finite_are_left_out() {
        let mut grid = PointGrid::default();
        let points = [Vec3::NAN, Vec3::INFINITY, Vec3::ONE * 1e20];
        grid.build(&points, &points, 0.1);
        let mut found = 0;
        grid.ranges_around(Vec3::MIN, Vec3::MAX, |range| found += range.len());
        assert_eq!(found, 1);
    }
}
