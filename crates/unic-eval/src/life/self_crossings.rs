//! Edges of a garment that pass through the garment's own faces.

use super::welded::WeldedMesh;
use glam::Vec3;
use unic_core::{mesh::TriMesh, surface::Surface, topology::edges};

/// Edges that pass through the garment in predictions and in the truth, over frames:
/// `self_crossing_edges_percent` of the [metrics](crate::Metrics).
#[derive(Clone, Debug)]
pub struct SelfCrossingShares {
    crossings: SelfCrossings,
    /// Sums of the shares over frames: of predictions, and of the truth.
    sums: [f64; 2],
    frames: usize,
}

impl SelfCrossingShares {
    /// Starts without frames, given the rest mesh of the garment.
    pub fn new(rest: &TriMesh) -> Self {
        Self {
            crossings: SelfCrossings::new(&WeldedMesh::new(rest)),
            sums: [0.0; 2],
            frames: 0,
        }
    }

    /// Adds a frame, given the positions of all garment vertices, metres.
    pub fn add(&mut self, predicted: &[Vec3], truth: &[Vec3]) {
        for (sum, positions) in self.sums.iter_mut().zip([predicted, truth]) {
            *sum += self.crossings.share(positions);
        }
        self.frames += 1;
    }

    /// Returns the mean shares of the edges, 0 to 1: of predictions, and of the truth. They are NaN where
    /// a position was not finite. None without frames.
    pub fn shares(&self) -> Option<[f64; 2]> {
        (self.frames > 0).then(|| self.sums.map(|sum| sum / self.frames as f64))
    }
}

/// Search for the edges of a garment that pass through its own faces. Work in parallel needs one each.
#[derive(Clone, Debug)]
pub(super) struct SelfCrossings {
    /// Garment vertex of each welded vertex.
    vertices: Vec<u32>,
    /// Edges between welded vertices.
    edges: Vec<[u32; 2]>,
    surface: Surface,
    /// Positions of the welded vertices in a frame, metres.
    at: Vec<Vec3>,
}

impl SelfCrossings {
    /// Prepares the search for the welded rest mesh of a garment.
    pub(super) fn new(welded: &WeldedMesh) -> Self {
        Self {
            vertices: welded.vertices.clone(),
            edges: edges(&welded.rest.faces),
            surface: Surface::build(&welded.rest),
            at: Vec::new(),
        }
    }

    /// Returns the share of edges that pass through a face, given the positions of all garment
    /// vertices in metres. Faces that touch an edge do not count for it, because they meet it in
    /// every shape. It is NaN where a position is not finite.
    pub(super) fn share(&mut self, positions: &[Vec3]) -> f64 {
        self.at.clear();
        self.at
            .extend(self.vertices.iter().map(|&v| positions[v as usize]));
        if !self.at.iter().all(|p| p.is_finite()) {
            return f64::NAN;
        }
        self.surface.refit(&self.at);
        let faces = self.surface.faces();
        let is_crossing = |edge: &&[u32; 2]| {
            let touches = |face: u32| faces[face as usize].iter().any(|v| edge.contains(v));
            let ends = edge.map(|v| self.at[v as usize]);
            self.surface.is_crossed(ends, |face| !touches(face))
        };
        let crossing = self.edges.iter().filter(is_crossing).count();
        crossing as f64 / self.edges.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares of one metre in the planes z = 0 and z = 1, of two faces each.
    fn squares() -> TriMesh {
        let square =
            |z: f32| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z));
        let vertices = [square(0.0), square(1.0)].concat();
        TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap()
    }

    #[test]
    fn an_edge_through_a_face_counts_once_and_faces_that_meet_do_not() {
        let rest = squares();
        let mut crossings = SelfCrossings::new(&WeldedMesh::new(&rest));
        assert_eq!(crossings.share(&rest.vertices), 0.0);
        // One corner of the upper square goes through the lower one. Its two edges cross faces; the
        // diagonal does not touch this corner.
        let mut positions = rest.vertices.clone();
        positions[5] = Vec3::new(0.7, 0.3, -0.1);
        assert_eq!(crossings.share(&positions), 0.2);
        // Beyond the lower square nothing is crossed.
        positions[5] = Vec3::new(3.0, 0.3, -0.1);
        assert_eq!(crossings.share(&positions), 0.0);
        positions[5].x = f32::NAN;
        assert!(crossings.share(&positions).is_nan());
    }

    #[test]
    fn shares_are_means_over_frames() {
        let rest = squares();
        let mut shares = SelfCrossingShares::new(&rest);
        assert_eq!(shares.shares(), None);
        let mut crossing = rest.vertices.clone();
        crossing[5] = Vec3::new(0.7, 0.3, -0.1);
        shares.add(&crossing, &rest.vertices);
        shares.add(&rest.vertices, &rest.vertices);
        assert_eq!(shares.shares(), Some([0.1, 0.0]));
    }

    #[test]
    fn a_closed_seam_is_no_crossing() {
        let mut rest = squares();
        // The upper square hangs on an edge of the lower one, with vertices of its own.
        rest.vertices[4] = rest.vertices[0];
        rest.vertices[5] = rest.vertices[1];
        let mut crossings = SelfCrossings::new(&WeldedMesh::new(&rest));
        assert_eq!(crossings.edges.len(), 9);
        assert_eq!(crossings.share(&rest.vertices), 0.0);
    }
}
