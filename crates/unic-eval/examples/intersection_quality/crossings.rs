//! Crossings: edges of the garment through triangles of the body, and the reverse.

use glam::Vec3;
use std::collections::HashMap;
use unic_core::{
    closest::ClosestVertex, intersection::ContactFilter, mesh::TriMesh, surface::Surface, topology::edges,
};
use unic_io::Capture;

/// Least distance of a convex crossing to any concave edge of the body, metres. Nearer ones lie in
/// folds of the skin.
const CONCAVE_M: f32 = 0.05;

/// Numbers of crossings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CrossingCounts {
    /// All crossings.
    pub(crate) all: usize,
    /// Crossings with parts that may push the garment there.
    pub(crate) pushing: usize,
    /// Crossings away from concave edges of the body.
    pub(crate) convex: usize,
}

/// Search for crossings of a garment with a body.
pub(crate) struct Crossings {
    mesh: TriMesh,
    cloth: Surface,
    cloth_faces: Vec<[u32; 3]>,
    parts: ContactFilter,
    body_edges: Vec<[u32; 2]>,
    /// Faces of the body at each of its edges.
    faces_at_edges: Vec<Vec<u32>>,
    garment_edges: Vec<[u32; 2]>,
}

impl Crossings {
    pub(crate) fn new(capture: &Capture) -> Self {
        let (body, garment) = (&capture.character.body, &capture.garment);
        let mut faces_at: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for (face, &[a, b, c]) in (0..).zip(&body.faces) {
            for [u, v] in [[a, b], [b, c], [c, a]] {
                faces_at.entry([u.min(v), u.max(v)]).or_default().push(face);
            }
        }
        let body_edges = edges(&body.faces);
        Self {
            mesh: body.clone(),
            cloth: Surface::build(&garment.rest),
            cloth_faces: garment.rest.faces.clone(),
            parts: ContactFilter::new(&capture.character, garment),
            faces_at_edges: body_edges.iter().map(|edge| faces_at[edge].clone()).collect(),
            body_edges,
            garment_edges: edges(&garment.rest.faces),
        }
    }

    /// Counts the crossings of a garment with a body, at places that are open.
    pub(crate) fn count(
        &mut self,
        surface: &Surface,
        body: &[Vec3],
        garment: &[Vec3],
        is_open: impl Fn(Vec3) -> bool,
    ) -> CrossingCounts {
        self.cloth.refit(garment);
        let pushes = |face, corners: &[u32]| {
            corners
                .iter()
                .all(|&v| self.parts.face_may_push(face, v as usize))
        };
        let (mut places, mut pushing) = (Vec::new(), 0);
        for edge in &self.garment_edges {
            let [a, b] = edge.map(|v| garment[v as usize]);
            if let Some((p, face)) = crossing(surface, a, b).filter(|(p, _)| is_open(*p)) {
                places.push(p);
                pushing += usize::from(pushes(face, edge));
            }
        }
        for (&[a, b], beside) in self.body_edges.iter().zip(&self.faces_at_edges) {
            let hit = crossing(&self.cloth, body[a as usize], body[b as usize]);
            if let Some((p, face)) = hit.filter(|(p, _)| is_open(*p)) {
                places.push(p);
                let corners = &self.cloth_faces[face as usize];
                pushing += usize::from(beside.iter().any(|&face| pushes(face, corners)));
            }
        }
        if places.is_empty() {
            return CrossingCounts::default();
        }
        let concave = ClosestVertex::build(&concave_edges(&self.mesh, body));
        let is_convex = |p: &&Vec3| concave.nearest(**p).is_none_or(|(_, d)| d > CONCAVE_M);
        CrossingCounts {
            all: places.len(),
            pushing,
            convex: places.iter().filter(is_convex).count(),
        }
    }
}

/// Returns the point and the face at which the segment from a to b passes through a surface.
fn crossing(surface: &Surface, a: Vec3, b: Vec3) -> Option<(Vec3, u32)> {
    let (length, direction) = ((b - a).length(), (b - a).normalize_or_zero());
    let hit = surface.cast_ray(a, direction, length)?;
    (hit.distance < length).then(|| (a + direction * hit.distance, hit.face))
}

/// Returns the midpoints of the edges at which the body bends inwards.
fn concave_edges(mesh: &TriMesh, at: &[Vec3]) -> Vec<Vec3> {
    let mut opposite = HashMap::new();
    let mut middles = Vec::new();
    for &[a, b, c] in &mesh.faces {
        for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
            opposite.insert([u, v], w);
        }
    }
    for (&[u, v], &w) in &opposite {
        let Some(&x) = opposite.get(&[v, u]).filter(|_| u < v) else {
            continue;
        };
        let [u, v, w, x] = [u, v, w, x].map(|i| at[i as usize]);
        let normal = (v - u).cross(w - u);
        if (x - u).dot(normal) > 0.0 {
            middles.push((u + v) * 0.5);
        }
    }
    middles
}
