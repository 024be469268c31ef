//! Search for the nearest neighbour among the frames of a capture.

use crate::{error::Result, kinematics::ClipKinematics, training::FrameIndex};
use faer::{Mat, Side};
use rayon::prelude::*;
use unic_core::motion::{MotionSlices, Normalisation, NormalisationRule, NormalisedElements, motion_len};

/// Least standard deviation of an element: 5 cm, 5 cm/s, or rotations by 3°. An element that hardly
/// moves in the capture must not count more than the others.
const LEAST_STD: f32 = 0.05;

/// Number of coordinates that are compared between two tests against the best distance.
///
/// The first coordinates hold most of a distance, because they belong to the principal directions.
/// Those of ten thousand frames stay in cache.
const HEAD: usize = 32;

/// Number of frames from which the principal directions are computed. Any orthonormal directions
/// give the same distances.
const BASIS_FRAMES: usize = 2_000;

/// Number of frames of a motion that one task searches in turn. The neighbour of one frame is a
/// good first guess for the next.
const RUN: usize = 64;

/// Nearest frame of a capture, and its distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Neighbour {
    /// Root mean square difference of the normalised elements.
    pub(super) distance: f32,
    /// Clip and frame in the capture.
    pub(super) at: FrameIndex,
}

/// Frames of a capture as normalised vectors.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    normalisation: Normalisation,
    /// Number of elements that count: all but the contacts, which jump and follow from the others.
    len: usize,
    /// Principal directions: `len` orthonormal rows, the direction of largest variance first.
    basis: Vec<f32>,
    /// First [`HEAD`] coordinates of every frame, in the principal directions.
    heads: Vec<f32>,
    /// Coordinates of every frame after the first [`HEAD`].
    tails: Vec<f32>,
    /// Clip and frame of each row.
    places: Vec<FrameIndex>,
}

impl Frames {
    /// Reads at most `most` frames of all clips.
    pub(super) fn fit(joints: usize, clips: &[ClipKinematics], most: usize) -> Result<Self> {
        let rule = NormalisationRule {
            elements: NormalisedElements::All,
            least_std: LEAST_STD,
            limit: None,
        };
        let all = || {
            let frames = |(clip, kinematics): (usize, &ClipKinematics)| {
                (0..kinematics.len()).map(move |frame| FrameIndex { clip, frame })
            };
            clips.iter().enumerate().flat_map(frames)
        };
        let motion = |at: FrameIndex| clips[at.clip].motion(at.frame);
        let vectors = all().map(motion);
        let normalisation = Normalisation::fit(joints, motion_len(joints), rule, vectors)?;
        let len = MotionSlices::new(joints).contacts.start;
        let stride = all().count().div_ceil(most).max(1);
        let places: Vec<FrameIndex> = all().step_by(stride).collect();
        // Directions need no more than a sample, since any orthonormal basis keeps distances.
        let sparse = places.iter().step_by(places.len().div_ceil(BASIS_FRAMES).max(1));
        let normalised = sparse.map(|&at| normalised(&normalisation, motion(at), len));
        let basis = principal_directions(&normalised.collect::<Vec<_>>(), len);
        let mut frames = Self {
            normalisation,
            len,
            basis,
            heads: Vec::new(),
            tails: Vec::new(),
            places,
        };
        let places = frames.places.par_iter();
        let vectors: Vec<Vec<f32>> = places.map(|&at| frames.vector(motion(at))).collect();
        for vector in &vectors {
            let (head, tail) = vector.split_at(HEAD.min(len));
            frames.heads.extend(head);
            frames.tails.extend(tail);
        }
        Ok(frames)
    }

    /// Returns the coordinates of a motion vector along the principal directions.
    fn vector(&self, motion: &[f32]) -> Vec<f32> {
        let elements = normalised(&self.normalisation, motion, self.len);
        let directions = self.basis.chunks_exact(self.len);
        directions
            .map(|direction| product(direction, &elements))
            .collect()
    }

    /// Returns the nearest frame for each frame of a clip.
    pub(super) fn nearest(&self, clip: &ClipKinematics) -> Vec<Neighbour> {
        let frames: Vec<usize> = (0..clip.len()).collect();
        // Runs have a fixed length: with equal distances the neighbour depends on the first guess,
        // which must not depend on the number of threads.
        let search_run = |run: &[usize]| {
            let mut guess = None;
            let search = |&frame: &usize| {
                let (row, neighbour) = self.search(&self.vector(clip.motion(frame)), guess, |_| true);
                // Motion goes on: the row after the last neighbour is the likely next one.
                guess = row.map(|row| (row + 1) % self.places.len());
                neighbour
            };
            run.iter().map(search).collect::<Vec<_>>()
        };
        frames.par_chunks(RUN).flat_map_iter(search_run).collect()
    }

    /// Returns the distances of at most `most` frames to the nearest others. Frames of the same
    /// clip within `gap` frames do not count. Frames without others are left out.
    pub(super) fn own_distances(&self, most: usize, gap: usize) -> Vec<f32> {
        let stride = self.places.len().div_ceil(most).max(1);
        let rows: Vec<usize> = (0..self.places.len()).step_by(stride).collect();
        let search_run = |run: &[usize]| {
            let mut guess = None;
            let search = |&row: &usize| {
                let own = self.places[row];
                let is_other = |at: FrameIndex| at.clip != own.clip || at.frame.abs_diff(own.frame) > gap;
                let vector = [self.head(row), self.tail(row)].concat();
                let (found, neighbour) = self.search(&vector, guess, is_other);
                guess = found;
                neighbour.distance
            };
            run.iter().map(search).collect::<Vec<_>>()
        };
        let all: Vec<f32> = rows.par_chunks(RUN).flat_map_iter(search_run).collect();
        all.into_iter().filter(|d| d.is_finite()).collect()
    }

    /// Returns the distance of two motion vectors, element by element.
    #[cfg(test)]
    pub(super) fn plain_distance(&self, a: &[f32], b: &[f32]) -> f32 {
        let [a, b] = [a, b].map(|c| normalised(&self.normalisation, c, self.len));
        let squares = a.iter().zip(&b).map(|(x, y)| (x - y) * (x - y));
        (squares.sum::<f32>() / self.len as f32).sqrt()
    }

    /// Returns the first coordinates of a row.
    fn head(&self, row: usize) -> &[f32] {
        let len = HEAD.min(self.len);
        &self.heads[row * len..(row + 1) * len]
    }

    /// Returns the other coordinates of a row.
    fn tail(&self, row: usize) -> &[f32] {
        let len = self.len - HEAD.min(self.len);
        &self.tails[row * len..(row + 1) * len]
    }

    /// Returns the nearest row that counts. The result is exact: a row is given up only when it is
    /// farther than the best. The search begins with the row `guess`.
    fn search(
        &self,
        vector: &[f32],
        guess: Option<usize>,
        counts: impl Fn(FrameIndex) -> bool,
    ) -> (Option<usize>, Neighbour) {
        let (head, tail) = vector.split_at(HEAD.min(vector.len()));
        let (mut best, mut best_row) = (f32::INFINITY, None);
        for row in guess.into_iter().chain(0..self.places.len()) {
            let near = squared(head, self.head(row));
            // The cheap comparison comes first, and `counts` is asked only for rows that can be
            // nearer.
            if near < best && counts(self.places[row]) {
                let whole = squared_below(near, tail, self.tail(row), best);
                if let Some(whole) = whole {
                    (best, best_row) = (whole, Some(row));
                }
            }
        }
        let first = FrameIndex { clip: 0, frame: 0 };
        let neighbour = Neighbour {
            distance: (best / self.len as f32).sqrt(),
            at: best_row.map_or(first, |row| self.places[row]),
        };
        (best_row, neighbour)
    }
}

/// Returns the elements that count, normalised.
fn normalised(normalisation: &Normalisation, motion: &[f32], len: usize) -> Vec<f32> {
    let mut elements = motion.to_vec();
    normalisation.apply(&mut elements);
    elements.truncate(len);
    elements
}

/// Returns the eigenvectors of the samples' second moments as rows, the largest eigenvalue first,
/// or the identity where they cannot be computed.
fn principal_directions(samples: &[Vec<f32>], len: usize) -> Vec<f32> {
    // Sums of squares in f32 would lose directions of small variance.
    let matrix = Mat::from_fn(samples.len(), len, |t, k| f64::from(samples[t][k]));
    let moments = matrix.transpose() * &matrix;
    match moments.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) => (0..len * len)
            .map(|i| eigen.U()[(i % len, len - 1 - i / len)] as f32)
            .collect(),
        Err(_) => (0..len * len)
            .map(|i| if i % len == i / len { 1.0 } else { 0.0 })
            .collect(),
    }
}

/// Returns `start` plus the squared distance of `a` and `b`, or `None` where the sum is not below
/// the limit.
fn squared_below(start: f32, a: &[f32], b: &[f32], limit: f32) -> Option<f32> {
    let mut sum = start;
    for (a, b) in a.chunks(HEAD).zip(b.chunks(HEAD)) {
        sum += squared(a, b);
        if sum >= limit {
            return None;
        }
    }
    (sum < limit).then_some(sum)
}

/// Number of independent partial sums, which the compiler maps to SIMD lanes.
const LANES: usize = 16;

/// Returns the squared distance of two vectors.
fn squared(a: &[f32], b: &[f32]) -> f32 {
    summed(a, b, |x, y| (x - y) * (x - y))
}

/// Returns the inner product of two vectors.
fn product(a: &[f32], b: &[f32]) -> f32 {
    summed(a, b, |x, y| x * y)
}

/// Sums a term over the elements of two vectors.
#[inline(always)]
fn summed(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut lanes = [0.0_f32; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            lanes[k] += term(a[k], b[k]);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(x, y)| term(*x, *y)).sum();
    lanes.iter().sum::<f32>() + rest
}
