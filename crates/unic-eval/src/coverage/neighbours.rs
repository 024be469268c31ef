//! Nearest neighbours among the frames of a capture.

use crate::{error::Result, kinematics::ClipKinematics};
use faer::{Mat, Side};
use rayon::prelude::*;
use unic_core::motion::{MotionSlices, Normalisation, NormalisationRule, NormalisedElements};

/// An element that hardly moves in the capture must not count for more than the rest: 5 cm, 5 cm/s,
/// rotations by 3°.
const LEAST_STD: f32 = 0.05;

/// Coordinates that are looked at first, and between two looks at the best distance after that.
/// Along the principal directions the first hold most of a distance, and for ten thousand frames
/// they stay in cache.
const HEAD: usize = 32;

/// Frames that the principal directions are taken from: any orthonormal ones give the same
/// distances.
const BASIS_FRAMES: usize = 2_000;

/// Frames of a motion that are searched in turn: the neighbour of one is a good first guess for the
/// next.
const RUN: usize = 64;

/// The frame of a capture that is most like another, and how far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Neighbour {
    /// Root mean square difference of the normalised elements.
    pub(super) distance: f32,
    pub(super) clip: usize,
    pub(super) frame: usize,
}

/// Frames as vectors of order one.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    normalisation: Normalisation,
    /// Elements that count: all but the contacts, which jump and follow from the rest.
    len: usize,
    /// `len` orthonormal rows, the direction of largest variance first.
    basis: Vec<f32>,
    /// Rows of the first [`HEAD`] coordinates, and of the others.
    heads: Vec<f32>,
    tails: Vec<f32>,
    /// (clip, frame) of each row.
    places: Vec<(usize, usize)>,
}

impl Frames {
    /// Of all clips, at most `most` frames.
    pub(super) fn fit(joints: usize, clips: &[ClipKinematics], most: usize) -> Result<Self> {
        let rule = NormalisationRule {
            elements: NormalisedElements::All,
            least_std: LEAST_STD,
            limit: None,
        };
        let all = || {
            let of = |(c, clip): (usize, &ClipKinematics)| (0..clip.len()).map(move |t| (c, t));
            clips.iter().enumerate().flat_map(of)
        };
        let vectors = all().map(|(clip, frame)| clips[clip].motion(frame));
        let normalisation = Normalisation::fit(joints, rule, vectors)?;
        let len = MotionSlices::new(joints).contacts.start;
        let stride = all().count().div_ceil(most).max(1);
        let places: Vec<(usize, usize)> = all().step_by(stride).collect();
        let sparse = places.iter().step_by(places.len().div_ceil(BASIS_FRAMES).max(1));
        let normalised = sparse.map(|&(c, t)| normalised(&normalisation, clips[c].motion(t), len));
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
        let vectors: Vec<Vec<f32>> = places.map(|&(c, t)| frames.vector(clips[c].motion(t))).collect();
        for vector in &vectors {
            let (head, tail) = vector.split_at(HEAD.min(len));
            frames.heads.extend(head);
            frames.tails.extend(tail);
        }
        Ok(frames)
    }

    fn vector(&self, motion: &[f32]) -> Vec<f32> {
        let elements = normalised(&self.normalisation, motion, self.len);
        let directions = self.basis.chunks_exact(self.len);
        directions
            .map(|direction| product(direction, &elements))
            .collect()
    }

    /// The nearest frame to each frame of a clip.
    pub(super) fn nearest(&self, clip: &ClipKinematics) -> Vec<Neighbour> {
        let frames: Vec<usize> = (0..clip.len()).collect();
        let search_run = |run: &[usize]| {
            let mut guess = None;
            let search = |&frame: &usize| {
                let (row, neighbour) = self.search(&self.vector(clip.motion(frame)), guess, |_| true);
                guess = row.map(|row| (row + 1) % self.places.len());
                neighbour
            };
            run.iter().map(search).collect::<Vec<_>>()
        };
        frames.par_chunks(RUN).flat_map_iter(search_run).collect()
    }

    /// Distances of at most `most` of the frames to the others, those of their own clip within `own`
    /// frames left out; frames that have no others do not appear.
    pub(super) fn own_distances(&self, most: usize, own: usize) -> Vec<f32> {
        let stride = self.places.len().div_ceil(most).max(1);
        let rows: Vec<usize> = (0..self.places.len()).step_by(stride).collect();
        let search_run = |run: &[usize]| {
            let mut guess = None;
            let search = |&row: &usize| {
                let (clip, frame) = self.places[row];
                let is_other = |place: (usize, usize)| place.0 != clip || place.1.abs_diff(frame) > own;
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

    /// Of two motion vectors, element by element.
    #[cfg(test)]
    pub(super) fn plain_distance(&self, a: &[f32], b: &[f32]) -> f32 {
        let [a, b] = [a, b].map(|c| normalised(&self.normalisation, c, self.len));
        let squares = a.iter().zip(&b).map(|(x, y)| (x - y) * (x - y));
        (squares.sum::<f32>() / self.len as f32).sqrt()
    }

    fn head(&self, row: usize) -> &[f32] {
        let len = HEAD.min(self.len);
        &self.heads[row * len..(row + 1) * len]
    }

    fn tail(&self, row: usize) -> &[f32] {
        let len = self.len - HEAD.min(self.len);
        &self.tails[row * len..(row + 1) * len]
    }

    /// The nearest row that counts, exactly: a row is given up only once it is further than the best.
    /// `guess` is looked at first.
    fn search(
        &self,
        vector: &[f32],
        guess: Option<usize>,
        counts: impl Fn((usize, usize)) -> bool,
    ) -> (Option<usize>, Neighbour) {
        let (head, tail) = vector.split_at(HEAD.min(vector.len()));
        let (mut best, mut best_row) = (f32::INFINITY, None);
        for row in guess.into_iter().chain(0..self.places.len()) {
            let near = squared(head, self.head(row));
            if near < best && counts(self.places[row]) {
                let whole = squared_below(near, tail, self.tail(row), best);
                if let Some(whole) = whole {
                    (best, best_row) = (whole, Some(row));
                }
            }
        }
        let (clip, frame) = best_row.map_or((0, 0), |row| self.places[row]);
        let distance = (best / self.len as f32).sqrt();
        let neighbour = Neighbour {
            distance,
            clip,
            frame,
        };
        (best_row, neighbour)
    }
}

fn normalised(normalisation: &Normalisation, motion: &[f32], len: usize) -> Vec<f32> {
    let mut elements = motion.to_vec();
    normalisation.apply(&mut elements);
    elements.truncate(len);
    elements
}

/// Eigenvectors of the samples' second moments as rows, the largest eigenvalue first; the identity
/// should that fail.
fn principal_directions(samples: &[Vec<f32>], len: usize) -> Vec<f32> {
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

/// `start` and the squared distance of the rest, if together they are below a limit.
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

/// Sums that do not wait for each other, so that the compiler lays them side by side.
const LANES: usize = 16;

/// Squared distance.
fn squared(a: &[f32], b: &[f32]) -> f32 {
    summed(a, b, |x, y| (x - y) * (x - y))
}

fn product(a: &[f32], b: &[f32]) -> f32 {
    summed(a, b, |x, y| x * y)
}

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
