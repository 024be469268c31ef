//! From samples to every vertex.

use super::{NEIGHBOURS, Row};
use crate::{
    mesh::TriMesh,
    topology::{edges, weld},
};
use glam::Vec3;
use std::collections::VecDeque;

/// Weights in sum of magnitudes beyond which errors of the samples would grow.
const LARGEST: f64 = 2.0;
/// What is added to the moments of linear functions, relative to them: a flat neighbourhood does not determine
/// the slope across it.
const LEAST_RIDGE: f64 = 1e-6;

/// Paths over the garment, copies of a vertex counted as one.
pub(super) struct Neighbourhoods<'a> {
    rest: &'a TriMesh,
    samples: &'a [u32],
    welded: Vec<u32>,
    /// By welded vertex: copies that are samples.
    sampled: Vec<Vec<u32>>,
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

    pub(super) fn rows(&self) -> Vec<Row> {
        let mut search = Search {
            seen: vec![u32::MAX; self.welded.len()],
            queue: VecDeque::new(),
            found: Vec::new(),
        };
        (0..self.welded.len() as u32)
            .map(|v| self.row(v, &mut search))
            .collect()
    }

    fn row(&self, vertex: u32, search: &mut Search) -> Row {
        // One row for all copies of a vertex, so that seams stay closed.
        if let Some(&place) = self.sampled[self.welded[vertex as usize] as usize].first() {
            return alone(place);
        }
        self.search(vertex, search);
        if search.found.is_empty() {
            return alone(self.nearest(vertex));
        }
        let at = self.rest.vertices[vertex as usize];
        let offsets: Vec<Vec3> = (search.found.iter())
            .map(|&place| self.rest.vertices[self.samples[place as usize] as usize] - at)
            .collect();
        let mut row = alone(search.found[0]);
        for (i, (&place, weight)) in search.found.iter().zip(weights(&offsets)).enumerate() {
            (row.samples[i], row.weights[i]) = (place, weight);
        }
        row
    }

    /// The samples fewest edges away.
    fn search(&self, vertex: u32, search: &mut Search) {
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

    /// Where no path leads to a sample.
    fn nearest(&self, vertex: u32) -> u32 {
        let at = self.rest.vertices[vertex as usize];
        let gap = |&place: &u32| {
            let sample = self.samples[place as usize];
            self.rest.vertices[sample as usize].distance_squared(at)
        };
        let places = 0..self.samples.len() as u32;
        places.min_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(0)
    }
}

/// Buffers.
struct Search {
    /// By welded vertex, the last one that it was seen from.
    seen: Vec<u32>,
    queue: VecDeque<u32>,
    found: Vec<u32>,
}

fn alone(place: u32) -> Row {
    let mut weights = [0.0; NEIGHBOURS];
    weights[0] = 1.0;
    Row {
        samples: [place; NEIGHBOURS],
        weights,
    }
}

/// Moving least squares at the origin of `offsets`: Σ w = 1 and Σ w · offset = 0, near samples first; less of the
/// second where weights would grow beyond measure.
fn weights(offsets: &[Vec3]) -> Vec<f32> {
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
    let mut ridge = LEAST_RIDGE;
    loop {
        let shape = solve(moments(&points, &near, ridge));
        let dot = |p: &[f64; 4]| p.iter().zip(shape).map(|(a, b)| a * b).sum::<f64>();
        let weights: Vec<f64> = points.iter().zip(&near).map(|(p, n)| n * dot(p)).collect();
        let size: f64 = weights.iter().map(|w| w.abs()).sum();
        if size <= LARGEST || ridge > 1e6 {
            let sum: f64 = weights.iter().sum();
            return weights.iter().map(|w| (w / sum) as f32).collect();
        }
        ridge *= 10.0;
    }
}

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

/// m x = (1, 0, 0, 0) for a positive definite m, by elimination.
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
