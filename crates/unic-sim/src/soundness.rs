//! Is a simulated clip fit to learn from? Penetration, strain and creeping, as numbers.

mod standing;

pub use standing::Standing;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use unic_core::{character::Character, folds::Folds, mesh::TriMesh, surface::Surface, topology::edges};

/// A vertex deeper than this counts as inside the body, metres.
const DEEP_M: f32 = 0.001;
/// Frames between two that are measured: closest points cost more than the simulation's own.
const STRIDE: usize = 5;
/// Of the edges' strains, the one that is reported.
const STRAIN_QUANTILE: f64 = 0.99;
/// Strains are counted in bins of this width, up to [`BINS`] of them.
const STRAIN_BIN: f32 = 1e-3;
const BINS: usize = 2000;

/// Numbers of one clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Soundness {
    /// Vertices more than 1 mm inside the body, where it does not fold into itself, % of all.
    pub inside_percent: f64,
    /// The deepest of them, mm.
    pub deepest_mm: f32,
    /// Stretch of an edge against its rest length that 99 % of all edges stay below, %.
    pub strain_p99_percent: f64,
    /// The fastest vertex between two frames, m/s.
    pub top_speed_m_per_s: f32,
}

/// Gathers the numbers of a clip frame by frame; depth and strain at every fifth.
#[derive(Debug)]
pub struct Gauge {
    surface: Surface,
    folds: Folds,
    edges: Vec<([u32; 2], f32)>,
    fps: f32,
    frames: usize,
    measured: usize,
    inside: usize,
    deepest: f32,
    strains: Vec<u64>,
    before: Vec<Vec3>,
    top_speed: f32,
}

impl Gauge {
    /// For a garment with this rest shape on this character, at `fps` frames a second.
    pub fn new(character: &Character, rest: &TriMesh, fps: f32) -> Self {
        Self::of(&character.body, rest, fps)
    }

    fn of(body: &TriMesh, rest: &TriMesh, fps: f32) -> Self {
        let length = |[a, b]: [u32; 2]| rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        Self {
            surface: Surface::build(body),
            folds: Folds::default(),
            edges: (edges(&rest.faces).into_iter())
                .map(|edge| (edge, length(edge)))
                .filter(|(_, length)| *length > 0.0)
                .collect(),
            fps,
            frames: 0,
            measured: 0,
            inside: 0,
            deepest: 0.0,
            strains: vec![0; BINS],
            before: Vec::new(),
            top_speed: 0.0,
        }
    }

    /// The next frame: vertices of the body and of the garment, world space, metres.
    pub fn push(&mut self, body: &[Vec3], garment: &[Vec3]) {
        if self.frames.is_multiple_of(STRIDE) {
            self.measure_depth(body, garment);
            self.measure_strain(garment);
        }
        let moved = self.before.iter().zip(garment).map(|(a, b)| a.distance(*b));
        self.top_speed = moved.fold(self.top_speed, |most, d| most.max(d * self.fps));
        self.before.clear();
        self.before.extend_from_slice(garment);
        self.frames += 1;
    }

    fn measure_depth(&mut self, body: &[Vec3], garment: &[Vec3]) {
        self.surface.refit(body);
        self.folds.find(&self.surface);
        for &vertex in garment {
            let Some(point) = self.surface.closest(vertex) else {
                continue;
            };
            let depth = -point.signed_distance;
            if depth > DEEP_M && !self.folds.has_face(point.face) {
                self.inside += 1;
                self.deepest = self.deepest.max(depth);
            }
        }
        self.measured += garment.len();
    }

    fn measure_strain(&mut self, garment: &[Vec3]) {
        for &([a, b], rest) in &self.edges {
            let strain = garment[a as usize].distance(garment[b as usize]) / rest - 1.0;
            let bin = (strain.max(0.0) / STRAIN_BIN) as usize;
            self.strains[bin.min(BINS - 1)] += 1;
        }
    }

    /// The numbers; zeros where there was no frame.
    pub fn finish(self) -> Soundness {
        Soundness {
            inside_percent: 100.0 * self.inside as f64 / self.measured.max(1) as f64,
            deepest_mm: 1000.0 * self.deepest,
            strain_p99_percent: 100.0 * quantile(&self.strains),
            top_speed_m_per_s: self.top_speed,
        }
    }
}

/// Upper end of the bin below which the quantile lies.
fn quantile(bins: &[u64]) -> f64 {
    let wanted = STRAIN_QUANTILE * bins.iter().sum::<u64>() as f64;
    let mut below = 0;
    let bin = bins.iter().position(|n| {
        below += n;
        below as f64 >= wanted
    });
    (bin.unwrap_or(0) + 1) as f64 * f64::from(STRAIN_BIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantile_is_that_of_the_sorted_list() {
        let mut bins = vec![0; BINS];
        bins[3] = 98;
        bins[7] = 2;
        assert!((quantile(&bins) - 0.008).abs() < 1e-9);
        bins[3] = 1000;
        assert!((quantile(&bins) - 0.004).abs() < 1e-9);
    }

    #[test]
    fn what_is_inside_stretched_and_fast_is_counted() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|v| v - 0.2);
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let body = TriMesh::new(corners.to_vec(), faces).unwrap();
        let rest = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let mut gauge = Gauge::of(&body, &rest, 10.0);
        let garment = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::X * 1.5, Vec3::Y];
        gauge.push(&body.vertices, &garment(0.0));
        gauge.push(&body.vertices, &garment(-0.1));
        let sound = gauge.finish();
        assert!((sound.inside_percent - 100.0 / 3.0).abs() < 1e-9, "{sound:?}");
        assert!(
            sound.deepest_mm > 100.0 && sound.strain_p99_percent > 49.0,
            "{sound:?}"
        );
        assert!((sound.top_speed_m_per_s - 1.0).abs() < 1e-5, "{sound:?}");
    }
}
