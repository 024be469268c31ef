//! Search for the pairs of vertices that may have to push each other.
//!
//! Most vertices that are near each other are neighbours in the mesh and no pair. So each vertex is
//! compared with several others at once, in the lanes of vector instructions, without branches.

use super::Pair;
use crate::{parallel::for_each_chunk, projection::sweep::PART, simd::Instructions};
use glam::{IVec3, Vec3, Vec3A};
use std::ops::Range;

/// Size of a cell of the search by the distance from which vertices are no pair: a little more than 1,
/// so that rounding hides no pair.
pub const CELL: f32 = 1.01;

/// Largest number of other vertices that each one is compared with, on average over a part of the
/// garment. A limit for shapes that have gone wrong.
const MOST_COMPARED: usize = 512;

/// Bits of each index of a cell in its key.
const BITS: u32 = 21;

/// Largest index of a cell, counted from that of the first vertex: its neighbours have keys, too.
/// Vertices farther away are in the outermost cells.
const FARTHEST: i32 = (1 << (BITS - 1)) - 2;

/// Steps from a cell to the columns after it, whose vertices it is compared with: x and y. The vertices
/// of each column are those of three cells, one above the other.
const COLUMNS: [[i64; 2]; 4] = [[0, 1], [1, -1], [1, 0], [1, 1]];

/// Number of vertices that one is compared with at once.
const LANES: usize = 8;

/// A vertex that is compared with others.
// `Vec3`, because a `Vec3A` is a vector register, which leaves no lanes for other vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compared {
    /// Position, metres.
    pub(super) position: Vec3,
    /// Place on the smoothed shape, metres, or outward normal.
    pub(super) vector: Vec3,
    /// Height at rest, metres, or 0.
    pub(super) number: f32,
}

/// Values of [`LANES`] consecutive sorted vertices: one array for each of the seven numbers of a
/// [`Compared`]. Lanes beyond the last vertex hold NaN.
type Block = [[f32; LANES]; 7];

impl Compared {
    #[inline(always)]
    fn to_array(self) -> [f32; 7] {
        let ([x, y, z], [u, v, w]) = (self.position.to_array(), self.vector.to_array());
        [x, y, z, u, v, w, self.number]
    }

    #[inline(always)]
    fn from_array([x, y, z, u, v, w, number]: [f32; 7]) -> Self {
        Self {
            position: Vec3::new(x, y, z),
            vector: Vec3::new(u, v, w),
            number,
        }
    }

    /// Returns the vertex in a lane.
    #[inline(always)]
    fn of_lane(block: &Block, lane: usize) -> Self {
        let [x, y, z, u, v, w, number] = block;
        Self::from_array([x[lane], y[lane], z[lane], u[lane], v[lane], w[lane], number[lane]])
    }
}

/// Which vertices are a pair.
pub(super) trait Rule: Sync {
    /// Distance from which vertices are no pair, metres.
    fn near_m(&self) -> f32;

    /// Returns whether two vertices that are near each other may be a pair, before a root is taken.
    // Without branches and always inlined: it runs in the lanes of vector instructions.
    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool;

    /// Returns the pair of two vertices that may be one.
    fn pair(&self, ends: [u32; 2], own: &Compared, other: &Compared) -> Option<Pair>;
}

/// Buffers of the search.
#[derive(Clone, Debug, Default)]
pub(super) struct SearchScratch {
    /// Keys of cells with the vertices there, in ascending order.
    keys: Vec<(u64, u32)>,
    /// The vertices in that order.
    sorted: Vec<Block>,
}

/// Vertices in the order of their cells. Those of neighbouring cells in a column follow each other.
pub(super) struct Search<'a, R> {
    rule: R,
    keys: &'a [(u64, u32)],
    sorted: &'a [Block],
}

impl<'a, R: Rule> Search<'a, R> {
    /// Sorts some vertices at their places, given the positions of all vertices, metres, and what is
    /// compared.
    pub(super) fn new(
        rule: R,
        vertices: impl Iterator<Item = u32>,
        positions: &[Vec3A],
        compared: impl Fn(u32) -> Compared,
        scratch: &'a mut SearchScratch,
    ) -> Self {
        let SearchScratch { keys, sorted } = scratch;
        let size = CELL * rule.near_m();
        let cell_of = |p: Vec3A| (p / size).floor().as_ivec3();
        let origin = positions.first().map_or(IVec3::ZERO, |p| cell_of(*p));
        let key_of = |vertex: u32| key(cell_of(positions[vertex as usize]).saturating_sub(origin));
        keys.clear();
        keys.extend(vertices.map(|vertex| (key_of(vertex), vertex)));
        keys.sort_unstable();
        sorted.clear();
        sorted.extend(keys.chunks(LANES).map(|keys| {
            let mut block = [[f32::NAN; LANES]; 7];
            for (lane, &(_, vertex)) in keys.iter().enumerate() {
                for (numbers, number) in block.iter_mut().zip(compared(vertex).to_array()) {
                    numbers[lane] = number;
                }
            }
            block
        }));
        Self { rule, keys, sorted }
    }

    /// Finds the pairs, part by part of the sorted vertices.
    pub(super) fn find(&self, pairs: &mut Vec<Vec<Pair>>) {
        self.find_on(Instructions::best(), pairs);
    }

    fn find_on(&self, instructions: Instructions, pairs: &mut Vec<Vec<Pair>>) {
        let count = self.keys.len();
        pairs.resize_with(count.div_ceil(PART), Vec::new);
        for_each_chunk(pairs, 1, |part, pairs| {
            for (part, pairs) in (part..).zip(pairs) {
                let vertices = part * PART..count.min((part + 1) * PART);
                instructions.run(
                    #[inline(always)]
                    || self.find_of(vertices, pairs),
                );
            }
        });
    }

    /// Finds the pairs of some of the sorted vertices with those after them: in their own cell and the
    /// one above it, which follow them, and in the other [`COLUMNS`].
    #[inline(always)]
    fn find_of(&self, vertices: Range<usize>, pairs: &mut Vec<Pair>) {
        pairs.clear();
        let mut left = MOST_COMPARED * vertices.len();
        let first = vertices.start;
        let mut own_end = first;
        let mut columns = COLUMNS.map(|column| {
            let ends = column_of(self.keys[first].0, column);
            ends.map(|key| self.keys.partition_point(|(k, _)| *k < key))
        });
        let mut last = None;
        for vertex in vertices {
            let key = self.keys[vertex].0;
            // Vertices of one cell are compared with the same ones. Keys ascend, and so do all ends.
            if last.replace(key) != Some(key) {
                own_end = self.first_from(own_end, key + 2);
                for (column, range) in COLUMNS.iter().zip(&mut columns) {
                    let [start, end] = column_of(key, *column);
                    *range = [self.first_from(range[0], start), self.first_from(range[1], end)];
                }
            }
            let others = columns.iter().map(|[start, end]| *start..*end);
            for others in std::iter::once(vertex + 1..own_end).chain(others) {
                let others = others.start..others.end.min(others.start + left);
                left -= others.len();
                self.compare(vertex, others, pairs);
            }
        }
    }

    /// Returns the first place, from one on, with at least this key.
    fn first_from(&self, place: usize, key: u64) -> usize {
        let before = self.keys[place..].iter().take_while(|(k, _)| *k < key);
        place + before.count()
    }

    /// Compares a sorted vertex with others, and adds those that make a pair with it.
    #[inline(always)]
    fn compare(&self, vertex: usize, others: Range<usize>, pairs: &mut Vec<Pair>) {
        if others.is_empty() {
            return;
        }
        let own = self.vertex_at(vertex);
        let blocks = others.start / LANES..others.end.div_ceil(LANES);
        for (first, block) in blocks.clone().zip(&self.sorted[blocks]) {
            let marks = self.mark_pairs(&own, block);
            // An OR over all lanes has no branches.
            if marks.iter().fold(0, |any, mark| any | mark) == 0 {
                continue;
            }
            for (place, mark) in (first * LANES..).zip(marks) {
                if mark != 0 && others.contains(&place) {
                    let ends = [vertex, place].map(|v| self.keys[v].1);
                    pairs.extend(self.rule.pair(ends, &own, &self.vertex_at(place)));
                }
            }
        }
    }

    /// Returns a sorted vertex.
    #[inline(always)]
    fn vertex_at(&self, place: usize) -> Compared {
        Compared::of_lane(&self.sorted[place / LANES], place % LANES)
    }

    /// Returns 1 for each vertex of a block that is near another one and may be its pair, and 0 for the
    /// others.
    // Integers as wide as the numbers that are compared, so that all have the same lanes.
    #[inline(always)]
    fn mark_pairs(&self, own: &Compared, block: &Block) -> [u32; LANES] {
        let near = self.rule.near_m().powi(2);
        let mut marks = [0; LANES];
        for (lane, mark) in marks.iter_mut().enumerate() {
            let other = Compared::of_lane(block, lane);
            let is_near = (other.position - own.position).length_squared() < near;
            *mark = u32::from(is_near & self.rule.may_be_pair(own, &other));
        }
        marks
    }
}

/// Key of a cell. Keys ascend by x, then y, then z; that of the next z is the next number.
fn key(cell: IVec3) -> u64 {
    let cell = cell.clamp(IVec3::splat(-FARTHEST), IVec3::splat(FARTHEST));
    let [x, y, z] = cell.to_array().map(|index| (index + FARTHEST + 1) as u64);
    (x << (2 * BITS)) | (y << BITS) | z
}

/// Keys of the first cell of the three around a cell in another column, and of the one after the last.
fn column_of(key: u64, [x, y]: [i64; 2]) -> [u64; 2] {
    let middle = key.wrapping_add_signed((x << (2 * BITS)) + (y << BITS));
    [middle - 1, middle + 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    /// Vertices that are nearer than a metre and have different numbers are a pair.
    struct Near;

    impl Rule for Near {
        fn near_m(&self) -> f32 {
            1.0
        }

        #[inline(always)]
        fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
            own.number != other.number
        }

        fn pair(&self, ends: [u32; 2], _: &Compared, _: &Compared) -> Option<Pair> {
            Some(Pair {
                ends,
                along: Vec3A::X,
                weight: 1.0,
            })
        }
    }

    /// Pairs in the order in which they are found, with one comparison at a time.
    fn pairs_one_by_one(search: &Search<Near>, positions: &[Vec3A]) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        let at = |place: usize| positions[search.keys[place].1 as usize];
        for part in (0..search.keys.len()).step_by(PART) {
            let vertices = part..search.keys.len().min(part + PART);
            let mut left = MOST_COMPARED * vertices.len();
            for vertex in vertices {
                let key = search.keys[vertex].0;
                let own = [key, key + 2];
                for (column, [start, end]) in [own]
                    .into_iter()
                    .chain(COLUMNS.map(|c| column_of(key, c)))
                    .enumerate()
                {
                    let others = (0..search.keys.len()).filter(|&other| {
                        let is_after = column > 0 || other > vertex;
                        (start..end).contains(&search.keys[other].0) && is_after
                    });
                    for other in others.take(left).collect::<Vec<_>>() {
                        left -= 1;
                        let ends = [vertex, other].map(|place| search.keys[place].1);
                        let is_near = at(vertex).distance_squared(at(other)) < 1.0;
                        if is_near && ends[0] % 3 != ends[1] % 3 {
                            pairs.push(ends);
                        }
                    }
                }
            }
        }
        pairs
    }

    fn check_pairs(positions: &[Vec3A]) {
        let mut scratch = SearchScratch::default();
        let compared = |vertex: u32| Compared {
            position: positions[vertex as usize].into(),
            vector: Vec3::ZERO,
            number: (vertex % 3) as f32,
        };
        let vertices = 0..positions.len() as u32;
        let search = Search::new(Near, vertices, positions, compared, &mut scratch);
        let expected = pairs_one_by_one(&search, positions);
        for instructions in Instructions::available() {
            let mut pairs = Vec::new();
            search.find_on(instructions, &mut pairs);
            let found: Vec<_> = pairs.iter().flatten().map(|pair| pair.ends).collect();
            assert_eq!(found, expected, "{instructions:?}");
        }
    }

    proptest! {
        #[test]
        fn pairs_are_those_of_one_comparison_at_a_time_in_the_same_order(
            points in vec(point(2.0), 0..60), broken in 0usize..60,
        ) {
            let mut positions: Vec<Vec3A> = points.iter().map(|p| Vec3A::from(*p)).collect();
            if let Some(position) = positions.get_mut(broken) {
                *position = Vec3A::NAN;
            }
            check_pairs(&positions);
        }
    }

    #[test]
    fn a_crowd_in_one_cell_is_compared_up_to_the_limit() {
        // The first part alone has 480,000 pairs, and may compare 262,144.
        let place = |k: u32| Vec3A::new(0.3, 0.3, 0.001 * (k % 251) as f32);
        let crowd: Vec<Vec3A> = (0..1200).map(place).collect();
        check_pairs(&crowd);
    }

    #[test]
    fn keys_of_far_cells_have_neighbours() {
        let far = IVec3::new(i32::MAX, i32::MIN, i32::MAX);
        for cell in [far, -far, IVec3::ZERO] {
            for column in COLUMNS {
                let [start, end] = column_of(key(cell), column);
                assert_eq!(end - start, 3);
                let [x, y] = column.map(|step| step as i32);
                let clamped = cell.clamp(IVec3::splat(-FARTHEST), IVec3::splat(FARTHEST));
                let next = clamped + IVec3::new(x, y, 0);
                if next.max_element() <= FARTHEST && next.min_element() >= -FARTHEST {
                    assert_eq!(start + 1, key(next));
                }
            }
        }
    }
}
