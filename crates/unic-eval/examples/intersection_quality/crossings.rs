//! Edges of the garment through triangles of the body, and the reverse.

use glam::Vec3;
use std::collections::HashMap;
use unic_core::{
    closest::ClosestVertex, intersection::ContactParts, mesh::TriMesh, surface::Surface, topology::edges,
};
use unic_io::Capture;

/// A crossing nearer than this to a concave edge lies in a fold of the skin, metres.
const CONCAVE_M: f32 = 0.05;

pub(crate) struct Crossings {
    mesh: TriMesh,
    cloth: Surface,
    cloth_faces: Vec<[u32; 3]>,
    parts: ContactParts,
    body_edges: Vec<[u32; 2]>,
    /// The body's faces at each.
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
            parts: ContactParts::new(&capture.character, garment),
            faces_at_edges: body_edges.iter().map(|edge| faces_at[edge].clone()).collect(),
            body_edges,
            garment_edges: edges(&garment.rest.faces),
        }
    }

    /// All in places that are open, those by parts that may push the garment, those away from concave edges.
    pub(crate) fn count(
        &mut self,
        surface: &Surface,
        body: &[Vec3],
        garment: &[Vec3],
        is_open: impl Fn(Vec3) -> bool,
    ) -> [usize; 3] {
        self.cloth.refit(garment);
        let pushes =
            |face, corners: &[u32]| corners.iter().all(|&v| self.parts.face_pushes(face, v as usize));
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
            return [0; 3];
        }
        let concave = ClosestVertex::build(&concave_edges(&self.mesh, body));
        let is_convex = |p: &&Vec3| concave.nearest(**p).is_none_or(|(_, d)| d > CONCAVE_M);
        [places.len(), pushing, places.iter().filter(is_convex).count()]
    }
}

/// Where the way from a to b goes through a surface.
fn crossing(surface: &Surface, a: Vec3, b: Vec3) -> Option<(Vec3, u32)> {
    let (length, direction) = ((b - a).length(), (b - a).normalize_or_zero());
    let hit = surface.first_along(a, direction, length)?;
    (hit.distance < length).then(|| (a + direction * hit.distance, hit.face))
}

/// Middles of the edges over which the body bends inwards.
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
