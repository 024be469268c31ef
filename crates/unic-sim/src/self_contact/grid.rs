//! Particles by the cell of a uniform grid that they lie in.

use super::points::Points;
use glam::Vec3;
use std::ops::Range;

/// Cells along an axis, on each side of the origin, that an index can tell apart.
const HALF_AXIS: f32 = (1 << 20) as f32;

/// Cells of the grid are as many as points times this, within these bounds along an axis.
const CELLS_A_POINT: f32 = 4.0;
const SIDES: [usize; 2] = [8, 64];

/// A grid that repeats in all directions, rebuilt without allocating once its buffers have grown.
///
/// Space is cut into cubes of `side`³ cells that lie on top of one another, so that any extent
/// fits: a cell holds the points of all cells that it stands for, and who looks into it must look
/// at where they are. Cells that follow one another along z do so in memory.
#[derive(Clone, Debug, Default)]
pub(super) struct PointGrid {
    cell_m: f32,
    /// A power of two.
    side: usize,
    /// Points of cell i are `starts[i]..starts[i + 1]` of `points`.
    starts: Vec<u32>,
    points: Points,
}

impl PointGrid {
    /// Sorts points into cells of `cell_m` metres; those that are not finite are in none.
    pub(super) fn build(&mut self, points: &[Vec3], velocities: &[Vec3], cell_m: f32) {
        self.cell_m = cell_m;
        let side = (CELLS_A_POINT * points.len() as f32).cbrt() as usize;
        self.side = side.next_power_of_two().clamp(SIDES[0], SIDES[1]);
        self.count(points);
        let count = self.starts.last().map_or(0, |&count| count as usize);
        self.points.reset(count);
        // Backwards, so that every cell ends up in the order of the points.
        for (index, (&position, &velocity)) in points.iter().zip(velocities).enumerate().rev() {
            if position.is_finite() {
                let cell = self.index(self.cell(position));
                self.starts[cell] -= 1;
                self.points
                    .set(self.starts[cell] as usize, index as u32, position, velocity);
            }
        }
    }

    /// The points, by cell.
    pub(super) fn points(&self) -> &Points {
        &self.points
    }

    /// Leaves the end of each cell in `starts`.
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

    /// Calls `visit` with ranges of points that hold those of the box from `low` to `high` and
    /// others, none twice, always in the same order.
    #[inline]
    pub(super) fn around(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(Range<usize>)) {
        let (first, last) = (self.cell(low), self.cell(high));
        let side = self.side as i32;
        if (0..3).any(|axis| last[axis] - first[axis] >= side) {
            return visit(0..self.points.len());
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                let [from, to] = [first[2], last[2]].map(|z| self.index([x, y, z]));
                if from <= to {
                    visit(self.row(from..to + 1));
                } else {
                    // Around the end of the grid: the row goes on at its beginning.
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
        fn every_point_of_a_box_is_found_once(
            points in vec(point(1.0), 0..200), a in point(1.2), b in point(1.2), cell_m in 0.01f32..0.5,
        ) {
            let (low, high) = (a.min(b), a.max(b));
            let mut grid = PointGrid::default();
            let velocities: Vec<Vec3> = points.iter().map(|p| -p).collect();
            grid.build(&points, &velocities, cell_m);
            let is_in = |p: Vec3| p.cmpge(low).all() && p.cmple(high).all();
            let mut found = Vec::new();
            grid.around(low, high, |range| for entry in range {
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
    fn what_is_not_finite_is_nowhere() {
        let mut grid = PointGrid::default();
        let points = [Vec3::NAN, Vec3::INFINITY, Vec3::ONE * 1e20];
        grid.build(&points, &points, 0.1);
        let mut found = 0;
        grid.around(Vec3::MIN, Vec3::MAX, |range| found += range.len());
        assert_eq!(found, 1);
    }
}
