//! Points by the cell of a uniform grid that they lie in.

use glam::Vec3;

/// Largest number of cells that a query looks into one by one: beyond it, all points are looked at.
const MOST_CELLS: u64 = 4096;

/// Cells along an axis, on each side of the origin: 21 bits an axis fill a key.
const HALF_AXIS: f32 = (1 << 20) as f32;

/// A hashed grid, rebuilt without allocating once its buffers have grown.
#[derive(Clone, Debug, Default)]
pub(super) struct PointGrid {
    cell_m: f32,
    /// Points of bucket i are `entries[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    key: u64,
    position: Vec3,
    index: u32,
}

impl Entry {
    const NONE: Self = Self {
        key: 0,
        position: Vec3::ZERO,
        index: 0,
    };
}

impl PointGrid {
    /// Sorts points into cells of `cell_m` metres; those that are not finite are in none.
    pub(super) fn build(&mut self, points: &[Vec3], cell_m: f32) {
        self.cell_m = cell_m;
        let buckets = (2 * points.len()).next_power_of_two();
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        let finite = || points.iter().enumerate().filter(|(_, p)| p.is_finite());
        for (_, &p) in finite() {
            let bucket = bucket(key(self.cell(p)), buckets);
            self.starts[bucket] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.entries.clear();
        self.entries.resize(sum as usize, Entry::NONE);
        // Backwards, so that every bucket ends up in the order of the points.
        for (index, &position) in points.iter().enumerate().rev() {
            if position.is_finite() {
                let key = key(self.cell(position));
                let start = &mut self.starts[bucket(key, buckets)];
                *start -= 1;
                self.entries[*start as usize] = Entry {
                    key,
                    position,
                    index: index as u32,
                };
            }
        }
    }

    /// Calls `visit` with every point of the box from `low` to `high`, always in the same order.
    pub(super) fn in_box(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u32, Vec3)) {
        let (first, last) = (self.cell(low), self.cell(high));
        let mut visit_within = |entry: &Entry| {
            if entry.position.cmpge(low).all() && entry.position.cmple(high).all() {
                visit(entry.index, entry.position);
            }
        };
        let counts = [0, 1, 2].map(|k| (last[k] - first[k] + 1).max(0) as u64);
        if counts.iter().product::<u64>() > MOST_CELLS {
            self.entries.iter().for_each(visit_within);
            return;
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                for z in first[2]..=last[2] {
                    self.in_cell(key([x, y, z])).for_each(&mut visit_within);
                }
            }
        }
    }

    fn in_cell(&self, key: u64) -> impl Iterator<Item = &Entry> {
        let bucket = bucket(key, self.starts.len() - 1);
        let row = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
        self.entries[row].iter().filter(move |entry| entry.key == key)
    }

    fn cell(&self, p: Vec3) -> [i32; 3] {
        (p / self.cell_m)
            .to_array()
            .map(|x| x.floor().clamp(-HALF_AXIS, HALF_AXIS - 1.0) as i32)
    }
}

fn key(cell: [i32; 3]) -> u64 {
    let axis = |x: i32| (x + HALF_AXIS as i32) as u64;
    axis(cell[0]) << 42 | axis(cell[1]) << 21 | axis(cell[2])
}

/// Fibonacci hashing: the upper bits of a product with 2⁶⁴ over the golden ratio.
fn bucket(key: u64, buckets: usize) -> usize {
    let hash = key.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (hash >> 32) as usize & (buckets - 1)
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
            grid.build(&points, cell_m);
            let mut found = Vec::new();
            grid.in_box(low, high, |index, position| {
                assert_eq!(points[index as usize], position);
                found.push(index);
            });
            found.sort_unstable();
            let is_in = |p: Vec3| p.cmpge(low).all() && p.cmple(high).all();
            let expected: Vec<u32> = (0..points.len() as u32).filter(|&i| is_in(points[i as usize])).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn what_is_not_finite_is_nowhere() {
        let mut grid = PointGrid::default();
        grid.build(&[Vec3::NAN, Vec3::INFINITY, Vec3::ONE * 1e20], 0.1);
        let mut found = 0;
        grid.in_box(Vec3::MIN, Vec3::MAX, |_, _| found += 1);
        assert_eq!(found, 1);
    }
}
