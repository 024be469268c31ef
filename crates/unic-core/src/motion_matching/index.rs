//! Search index: normalised features in blocks of 16 frames, with bounding boxes.

use super::search::{Candidate, FrameFilter};
use crate::simd::{AlignedWords, Instructions};

/// Frames of a block, which are compared at once, and boxes whose distances are computed at once.
pub(super) const LANES: usize = 16;
/// Blocks of 16 frames in a large box.
const BLOCKS_A_LARGE_BOX: usize = 4;

/// One number of 16 frames or boxes.
type Lanes = [f32; LANES];

/// Features of all frames as `[block][feature][lane]`, and two levels of bounding boxes.
///
/// A distance is a sum of squared differences in the order of the features, without fused
/// operations, on every instruction set. Rounding is monotonic, and a box is summed in the same
/// order. So the computed distance to a box never exceeds the computed distance to a frame in it,
/// and pruning by boxes is exact.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FeatureIndex {
    dimensions: usize,
    frames: usize,
    features: AlignedWords,
    /// A bit for each frame of each block where a search may end.
    searchable: Vec<u16>,
    /// Boxes around 16 frames.
    small: Boxes,
    /// Boxes around 64 frames.
    large: Boxes,
}

/// Boxes as `[group of 16 boxes][feature][lowest or highest][lane]`.
#[derive(Clone, Debug, PartialEq)]
struct Boxes {
    count: usize,
    bounds: AlignedWords,
}

/// Buffers of a search.
#[derive(Clone, Debug, Default)]
pub struct SearchScratch {
    /// Squared distances to the large boxes.
    large: Vec<Lanes>,
}

impl FeatureIndex {
    /// Makes the index of normalised rows.
    pub(super) fn new(dimensions: usize, rows: &[f32], is_searchable: &[bool]) -> Self {
        let frames = is_searchable.len();
        let blocks = frames.div_ceil(LANES);
        let mut features = AlignedWords::zeroed(blocks * dimensions * LANES);
        let flat = features.as_mut_slice::<f32>();
        for (frame, row) in rows.chunks_exact(dimensions).enumerate() {
            let block = frame / LANES * dimensions * LANES;
            for (d, x) in row.iter().enumerate() {
                flat[block + d * LANES + frame % LANES] = *x;
            }
        }
        let bits = |block: &[bool]| {
            let set = |(lane, is_set): (usize, &bool)| u16::from(*is_set) << lane;
            block.iter().enumerate().map(set).fold(0, |a, b| a | b)
        };
        let frames_of = |size: usize| Boxes::new(dimensions, rows, is_searchable, size);
        Self {
            dimensions,
            frames,
            features,
            searchable: is_searchable.chunks(LANES).map(bits).collect(),
            small: frames_of(LANES),
            large: frames_of(LANES * BLOCKS_A_LARGE_BOX),
        }
    }

    /// Number of features.
    pub(super) fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Number of frames.
    pub(super) fn frames(&self) -> usize {
        self.frames
    }

    /// Features of a frame.
    pub(super) fn row(&self, frame: usize) -> impl Iterator<Item = f32> + '_ {
        let first = frame / LANES * self.dimensions * LANES + frame % LANES;
        let flat = self.features.as_slice::<f32>();
        (0..self.dimensions).map(move |d| flat[first + d * LANES])
    }

    /// Returns whether a search may end at a frame.
    pub(super) fn is_searchable(&self, frame: usize) -> bool {
        self.searchable[frame / LANES] >> (frame % LANES) & 1 != 0
    }

    /// Squared distance of a frame to a query.
    pub(super) fn distance(&self, frame: usize, query: &[f32]) -> f32 {
        let terms = self.row(frame).zip(query);
        terms.fold(0.0, |sum, (x, q)| sum + (q - x) * (q - x))
    }

    /// Finds the frame that is better than `best` and all other frames that the filter accepts.
    pub(super) fn search(
        &self,
        query: &[f32],
        filter: &FrameFilter<'_>,
        best: Candidate,
        scratch: &mut SearchScratch,
    ) -> Candidate {
        Instructions::best().run(
            #[inline(always)]
            || {
                let mut search = Search {
                    index: self,
                    query,
                    filter,
                    best,
                };
                search.run(scratch);
                search.best
            },
        )
    }

    #[inline(always)]
    fn block(&self, block: usize) -> &[Lanes] {
        let flat: &[Lanes] = bytemuck::cast_slice(self.features.as_slice::<f32>());
        &flat[block * self.dimensions..(block + 1) * self.dimensions]
    }
}

impl Boxes {
    /// Makes the boxes around every `size` frames. Frames where no search may end are left out.
    fn new(dimensions: usize, rows: &[f32], is_searchable: &[bool], size: usize) -> Self {
        let count = is_searchable.len().div_ceil(size);
        let groups = count.div_ceil(LANES);
        let mut bounds = AlignedWords::zeroed(groups * dimensions * 2 * LANES);
        let flat: &mut [Lanes] = bytemuck::cast_slice_mut(bounds.as_mut_slice::<f32>());
        // Boxes without frames are infinitely far away.
        for pair in flat.chunks_exact_mut(2) {
            (pair[0], pair[1]) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        }
        let frames = rows.chunks_exact(dimensions).zip(is_searchable).enumerate();
        for (frame, (row, _)) in frames.filter(|(_, (_, is_searchable))| **is_searchable) {
            let (group, lane) = (frame / size / LANES, frame / size % LANES);
            for (d, &x) in row.iter().enumerate() {
                let at = (group * dimensions + d) * 2;
                flat[at][lane] = flat[at][lane].min(x);
                flat[at + 1][lane] = flat[at + 1][lane].max(x);
            }
        }
        Self { count, bounds }
    }

    fn groups(&self) -> usize {
        self.count.div_ceil(LANES)
    }

    /// Squared distances of 16 boxes to a query.
    #[inline(always)]
    fn distances(&self, group: usize, query: &[f32]) -> Lanes {
        let flat: &[[Lanes; 2]] = bytemuck::cast_slice(self.bounds.as_slice::<f32>());
        let bounds = &flat[group * query.len()..(group + 1) * query.len()];
        let mut sums = [0.0; LANES];
        for ([lowest, highest], &q) in bounds.iter().zip(query) {
            for lane in 0..LANES {
                let beyond = positive(lowest[lane] - q) + positive(q - highest[lane]);
                sums[lane] += beyond * beyond;
            }
        }
        sums
    }
}

#[inline(always)]
fn positive(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// Search in progress.
struct Search<'a> {
    index: &'a FeatureIndex,
    query: &'a [f32],
    filter: &'a FrameFilter<'a>,
    best: Candidate,
}

impl Search<'_> {
    #[inline(always)]
    fn run(&mut self, scratch: &mut SearchScratch) {
        let large = &self.index.large;
        scratch.large.clear();
        for group in 0..large.groups() {
            scratch.large.push(large.distances(group, self.query));
        }
        // The nearest box first: its best frame keeps most other boxes out.
        if let Some(nearest) = nearest(&scratch.large, large.count) {
            self.visit_large(nearest);
        }
        // Four large boxes are one group of small ones.
        for (group, distances) in scratch.large.iter().enumerate() {
            for four in 0..LANES / BLOCKS_A_LARGE_BOX {
                let first = four * BLOCKS_A_LARGE_BOX;
                let of_four = &distances[first..first + BLOCKS_A_LARGE_BOX];
                if of_four.iter().any(|&d| d <= self.best.cost) {
                    self.visit_small(group * (LANES / BLOCKS_A_LARGE_BOX) + four);
                }
            }
        }
    }

    /// Compares the blocks of one large box.
    #[inline(always)]
    fn visit_large(&mut self, large: usize) {
        let first = large * BLOCKS_A_LARGE_BOX;
        for block in first..(first + BLOCKS_A_LARGE_BOX).min(self.index.small.count) {
            self.visit_block(block);
        }
    }

    /// Compares the blocks of a group of small boxes that may hold a better frame.
    #[inline(always)]
    fn visit_small(&mut self, group: usize) {
        if group >= self.index.small.groups() {
            return;
        }
        let distances = self.index.small.distances(group, self.query);
        for (lane, distance) in distances.iter().enumerate() {
            let block = group * LANES + lane;
            // Equal distances too: a tie goes to the lowest index.
            if *distance <= self.best.cost && block < self.index.small.count {
                self.visit_block(block);
            }
        }
    }

    /// Compares 16 frames, and stops once all are too far.
    #[inline(always)]
    fn visit_block(&mut self, block: usize) {
        let mut sums = [0.0; LANES];
        let parts = self
            .index
            .block(block)
            .chunks(EARLY_OUT)
            .zip(self.query.chunks(EARLY_OUT));
        for (features, query) in parts {
            for (lanes, &q) in features.iter().zip(query) {
                for lane in 0..LANES {
                    sums[lane] += (q - lanes[lane]) * (q - lanes[lane]);
                }
            }
            if !sums.iter().fold(false, |any, &sum| any | (sum <= self.best.cost)) {
                return;
            }
        }
        for (lane, &cost) in sums.iter().enumerate() {
            let frame = block * LANES + lane;
            let candidate = Candidate::frame(frame, cost);
            let is_open = self.index.searchable[block] >> lane & 1 != 0;
            if is_open && candidate.is_better(&self.best) && self.filter.accepts(frame) {
                self.best = candidate;
            }
        }
    }
}

/// Features after which a block is checked for being too far.
const EARLY_OUT: usize = 9;

/// Index of the smallest distance.
#[inline(always)]
fn nearest(distances: &[Lanes], count: usize) -> Option<usize> {
    let flat: &[f32] = bytemuck::cast_slice(distances);
    let mut best = None;
    let mut least = f32::INFINITY;
    for (i, &d) in flat[..count].iter().enumerate() {
        if d < least {
            (best, least) = (Some(i), d);
        }
    }
    best
}
