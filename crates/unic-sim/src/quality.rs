//! Quality of simulated clips: penetration, strain, speed and creep, which tell whether a clip is
//! fit for training.

mod creep;

pub use creep::CreepReference;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use unic_core::{character::Character, folds::Folds, mesh::TriMesh, surface::Surface, topology::edges};

/// Smallest depth at which a vertex counts as inside the body, metres.
const DEEP_M: f32 = 0.001;

/// Stride of the frames in which depth and strain are measured, because closest-point queries for
/// all vertices are expensive.
const STRIDE: usize = 5;

/// Quantile of the edges' strains that is reported.
const STRAIN_QUANTILE: f64 = 0.99;

/// Width of a bin of the strain histogram.
const STRAIN_BIN: f32 = 1e-3;

/// Number of bins of the strain histogram; larger strains count in the last one.
const BINS: usize = 2000;

/// Quality metrics of one simulated clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipQuality {
    /// Vertices more than 1 mm inside the body, % of all vertices. Folds of the body do not count.
    pub inside_percent: f64,
    /// Largest depth of a vertex inside the body, mm. Folds of the body do not count.
    pub deepest_mm: f32,
    /// 99th percentile of the stretch of all edges relative to their rest lengths, %.
    pub strain_p99_percent: f64,
    /// Largest speed of a vertex between two frames, m/s.
    pub top_speed_m_per_s: f32,
}

/// Measures the quality of a clip frame by frame. Depth and strain are measured in every fifth
/// frame.
#[derive(Debug)]
pub struct QualityMeter {
    surface: Surface,
    folds: Folds,
    edges: Vec<RestEdge>,
    fps: f32,
    /// Number of frames so far.
    frames: usize,
    /// Number of vertices whose depth was measured, in all frames.
    measured: usize,
    /// Number of them inside the body.
    inside: usize,
    /// Largest depth, metres.
    deepest: f32,
    /// Histogram of strains.
    strains: Vec<u64>,
    /// Vertices of the previous frame, metres.
    before: Vec<Vec3>,
    /// Largest speed, m/s.
    top_speed: f32,
}

/// An edge of the garment with its rest length.
#[derive(Debug)]
struct RestEdge {
    ends: [u32; 2],
    /// Rest length, metres; not zero.
    length: f32,
}

impl QualityMeter {
    /// Creates a meter for a garment with this rest shape on this character, at `fps` frames a
    /// second.
    pub fn new(character: &Character, rest: &TriMesh, fps: f32) -> Self {
        Self::for_body(&character.body, rest, fps)
    }

    fn for_body(body: &TriMesh, rest: &TriMesh, fps: f32) -> Self {
        let length = |[a, b]: [u32; 2]| rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        Self {
            surface: Surface::build(body),
            folds: Folds::default(),
            edges: (edges(&rest.faces).into_iter())
                .map(|ends| RestEdge {
                    ends,
                    length: length(ends),
                })
                .filter(|edge| edge.length > 0.0)
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

    /// Measures the next frame, given the vertices of the body and of the garment in world space,
    /// metres.
    pub fn push(&mut self, body: &[Vec3], garment: &[Vec3]) {
        if self.frames.is_multiple_of(STRIDE) {
            self.measure_depth(body, garment);
            self.measure_strain(garment);
        }
        // The first frame has no predecessor: `before` is empty then, and the zip ends at once.
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
            // In a fold a point is outside one part of the body and inside another, and its depth
            // is meaningless.
            if depth > DEEP_M && !self.folds.is_face_folded(point.face) {
                self.inside += 1;
                self.deepest = self.deepest.max(depth);
            }
        }
        self.measured += garment.len();
    }

    fn measure_strain(&mut self, garment: &[Vec3]) {
        for edge in &self.edges {
            let [a, b] = edge.ends.map(|v| garment[v as usize]);
            let strain = a.distance(b) / edge.length - 1.0;
            // Compression counts as zero: cloth buckles instead.
            let bin = (strain.max(0.0) / STRAIN_BIN) as usize;
            self.strains[bin.min(BINS - 1)] += 1;
        }
    }

    /// Returns the metrics of all frames; without any frame all are zero.
    pub fn finish(self) -> ClipQuality {
        ClipQuality {
            inside_percent: 100.0 * self.inside as f64 / self.measured.max(1) as f64,
            deepest_mm: 1000.0 * self.deepest,
            strain_p99_percent: 100.0 * quantile(&self.strains),
            top_speed_m_per_s: self.top_speed,
        }
    }
}

/// Returns the upper end of the histogram bin that the quantile lies in; 0 for an empty histogram.
fn quantile(bins: &[u64]) -> f64 {
    let count: u64 = bins.iter().sum();
    if count == 0 {
        return 0.0;
    }
    let wanted = STRAIN_QUANTILE * count as f64;
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
    fn histogram_quantile_is_that_of_the_sorted_list() {
        let mut bins = vec![0; BINS];
        bins[3] = 98;
        bins[7] = 2;
        assert!((quantile(&bins) - 0.008).abs() < 1e-9);
        bins[3] = 1000;
        assert!((quantile(&bins) - 0.004).abs() < 1e-9);
    }

    #[test]
    fn a_clip_without_frames_has_no_strain() {
        let rest = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let quality = QualityMeter::for_body(&rest, &rest, 30.0).finish();
        assert_eq!(quality.strain_p99_percent, 0.0, "{quality:?}");
    }

    #[test]
    fn penetration_strain_and_speed_are_measured() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|v| v - 0.2);
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let body = TriMesh::new(corners.to_vec(), faces).unwrap();
        let rest = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let mut meter = QualityMeter::for_body(&body, &rest, 10.0);
        let garment = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::X * 1.5, Vec3::Y];
        meter.push(&body.vertices, &garment(0.0));
        meter.push(&body.vertices, &garment(-0.1));
        let quality = meter.finish();
        assert!((quality.inside_percent - 100.0 / 3.0).abs() < 1e-9, "{quality:?}");
        assert!(
            quality.deepest_mm > 100.0 && quality.strain_p99_percent > 49.0,
            "{quality:?}"
        );
        assert!((quality.top_speed_m_per_s - 1.0).abs() < 1e-5, "{quality:?}");
    }
}
