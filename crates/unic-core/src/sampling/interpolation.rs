//! Interpolation weights from samples to every vertex.

use super::{InterpolationRow, NEIGHBOURS};
use crate::{
    mesh::TriMesh,
    topology::{edges, weld},
};
use glam::Vec3;
use std::collections::VecDeque;

/// Largest sum of the magnitudes of a vertex's weights: the factor by which an error of the samples
/// may grow.
const MAX_MAGNITUDE: f64 = 2.0;

/// Smallest ridge (Tikhonov) term on the linear moments, relative to the constant one. A flat
/// neighbourhood does not determine the slope perpendicular to it.
const MIN_RIDGE: f64 = 1e-6;

/// Graph of the garment's edges with its samples; the copies of a seam vertex are one node.
pub(super) struct Neighbourhoods<'a> {
    rest: &'a TriMesh,
    samples: &'a [u32],
    /// Node of each vertex: the first vertex at the same place.
    welded: Vec<u32>,
    /// Samples at each node, as places in `samples`.
    sampled: Vec<Vec<u32>>,
    /// Neighbours of each node.
    next: Vec<Vec<u32>>,
}

impl<'a> Neighbourhoods<'a> {
    pub(super) fn new(rest: &'a TriMesh, samples: &'a [u32]) -> Self {
        let welded = weld(&rest.vertices);
        let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(|v| welded[v as usize])).collect();
        let mut next = vec![Vec::new(); welded.len()];
        for [a, b] in edges(&faces) {
            next[a as usize].push(b);
            next[b as usize].push(a);
        }
        let mut sampled = vec![Vec::new(); welded.len()];
        for (place, &vertex) in samples.iter().enumerate() {
            sampled[welded[vertex as usize] as usize].push(place as u32);
        }
        Self {
            rest,
            samples,
            welded,
            sampled,
            next,
        }
    }

    /// Computes the interpolation of every vertex.
    pub(super) fn rows(&self) -> Vec<InterpolationRow> {
        self.rows_of(0..self.welded.len() as u32)
    }

    /// Computes the interpolation of some vertices, each of them once.
    pub(super) fn rows_of(&self, vertices: impl Iterator<Item = u32>) -> Vec<InterpolationRow> {
        let mut search = Search {
            seen: vec![u32::MAX; self.welded.len()],
            queue: VecDeque::new(),
            found: Vec::new(),
        };
        vertices.map(|v| self.row(v, &mut search)).collect()
    }

    fn row(&self, vertex: u32, search: &mut Search) -> InterpolationRow {
        // All copies of a vertex get the same row, so that seams stay closed.
        if let Some(&place) = self.sampled[self.welded[vertex as usize] as usize].first() {
            return single_sample(place);
        }
        self.find_samples(vertex, search);
        if search.found.is_empty() {
            return single_sample(self.nearest(vertex));
        }
        let at = self.rest.vertices[vertex as usize];
        let offsets: Vec<Vec3> = (search.found.iter())
            .map(|&place| self.rest.vertices[self.samples[place as usize] as usize] - at)
            .collect();
        let mut row = single_sample(search.found[0]);
        for (i, (&place, weight)) in search.found.iter().zip(weights(&offsets)).enumerate() {
            (row.samples[i], row.weights[i]) = (place, weight);
        }
        row
    }

    /// Finds the samples that are fewest edges away, by a breadth-first search.
    // Distance over edges and not through space: a sleeve must not take samples from the trunk
    // beside it.
    fn find_samples(&self, vertex: u32, search: &mut Search) {
        let Search { seen, queue, found } = search;
        let start = self.welded[vertex as usize];
        found.clear();
        queue.clear();
        queue.push_back(start);
        seen[start as usize] = vertex;
        while let Some(here) = queue.pop_front() {
            for &place in &self.sampled[here as usize] {
                if found.len() < NEIGHBOURS {
                    found.push(place);
                }
            }
            if found.len() == NEIGHBOURS {
                return;
            }
            for &next in &self.next[here as usize] {
                if seen[next as usize] != vertex {
                    seen[next as usize] = vertex;
                    queue.push_back(next);
                }
            }
        }
    }

    /// Returns the sample nearest in space, for a vertex without a path to any.
    fn nearest(&self, vertex: u32) -> u32 {
        let at = self.rest.vertices[vertex as usize];
        let squared = |&place: &u32| {
            let sample = self.samples[place as usize];
            self.rest.vertices[sample as usize].distance_squared(at)
        };
        let places = 0..self.samples.len() as u32;
        places
            .min_by(|a, b| squared(a).total_cmp(&squared(b)))
            .unwrap_or(0)
    }
}

/// Buffers of a breadth-first search, reused for all vertices.
struct Search {
    /// Vertex whose search last visited each node: no reset is needed between searches.
    seen: Vec<u32>,
    queue: VecDeque<u32>,
    /// Samples that were found, as places in the list of samples.
    found: Vec<u32>,
}

/// Row of a vertex that takes the value of one sample.
fn single_sample(place: u32) -> InterpolationRow {
    let mut weights = [0.0; NEIGHBOURS];
    weights[0] = 1.0;
    InterpolationRow {
        samples: [place; NEIGHBOURS],
        weights,
    }
}

/// Computes moving-least-squares weights at the origin of `offsets`: Σ w = 1 and Σ w · offset = 0,
/// with larger weights for near samples.
///
/// Where the weights would exceed [`MAX_MAGNITUDE`], a larger ridge term relaxes the second
/// condition.
// In f64: the moments of an almost flat neighbourhood are badly conditioned.
fn weights(offsets: &[Vec3]) -> Vec<f32> {
    // Offsets in units of the farthest one, so that the ridge does not depend on the size of the
    // mesh.
    let reach = offsets
        .iter()
        .map(|o| f64::from(o.length()))
        .fold(f64::MIN_POSITIVE, f64::max);
    let points: Vec<[f64; 4]> = (offsets.iter())
        .map(|o| {
            [
                1.0,
                f64::from(o.x) / reach,
                f64::from(o.y) / reach,
                f64::from(o.z) / reach,
            ]
        })
        .collect();
    let near: Vec<f64> = (points.iter())
        .map(|p| (-4.0 * (p[1] * p[1] + p[2] * p[2] + p[3] * p[3])).exp())
        .collect();
    let mut ridge = MIN_RIDGE;
    loop {
        let coefficients = solve(moments(&points, &near, ridge));
        let dot = |p: &[f64; 4]| p.iter().zip(coefficients).map(|(a, b)| a * b).sum::<f64>();
        let weights: Vec<f64> = points.iter().zip(&near).map(|(p, n)| n * dot(p)).collect();
        let magnitude: f64 = weights.iter().map(|w| w.abs()).sum();
        // An infinite ridge leaves the positive weights `near`, so that the loop ends.
        if magnitude <= MAX_MAGNITUDE || ridge > 1e6 {
            let sum: f64 = weights.iter().sum();
            return weights.iter().map(|w| (w / sum) as f32).collect();
        }
        ridge *= 10.0;
    }
}

/// Weighted moment matrix of (1, x, y, z) with a ridge term on the linear part.
fn moments(points: &[[f64; 4]], near: &[f64], ridge: f64) -> [[f64; 4]; 4] {
    let mut m = [[0.0; 4]; 4];
    for (p, n) in points.iter().zip(near) {
        for (row, a) in m.iter_mut().zip(p) {
            row.iter_mut().zip(p).for_each(|(m, b)| *m += n * a * b);
        }
    }
    let scale = m[0][0];
    (1..4).for_each(|i| m[i][i] += ridge * scale);
    m
}

/// Solves m x = (1, 0, 0, 0) for a positive definite m by elimination without pivoting.
fn solve(mut m: [[f64; 4]; 4]) -> [f64; 4] {
    let mut x = [1.0, 0.0, 0.0, 0.0];
    for i in 0..4 {
        for j in i + 1..4 {
            let factor = m[j][i] / m[i][i];
            let above = m[i];
            m[j].iter_mut().zip(above).for_each(|(b, a)| *b -= factor * a);
            x[j] -= factor * x[i];
        }
    }
    for i in (0..4).rev() {
        let known: f64 = (i + 1..4).map(|j| m[i][j] * x[j]).sum();
        x[i] = (x[i] - known) / m[i][i];
    }
    x
}
