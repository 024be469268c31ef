//! Near-uniform triangles: splits, collapses, flips and tangential smoothing.

mod collapse;
mod flip;
mod relax;
mod split;

use super::{Patch, Surfaces};
use flip::Flip;
use glam::Vec3;

/// How large triangles should be.
#[derive(Clone, Copy)]
pub(crate) struct Sizing<'a> {
    /// Wanted length of edges at a place, metres.
    pub(crate) edge: &'a (dyn Fn(Vec3) -> f32 + Sync),
    /// Rounds of all operations.
    pub(crate) rounds: usize,
}

/// Edges longer than this times the wanted length are split, shorter than [`SHORT`] collapsed: a split
/// then never makes an edge to be collapsed.
const LONG: f32 = 4.0 / 3.0;
const SHORT: f32 = 0.8;

/// Remeshes a patch after Botsch & Kobbelt 2004, "A remeshing approach to multiresolution modeling".
///
/// Borders and seams stay curves of their cuts; corners, where two cuts meet, stay where they are.
pub(crate) fn remesh(patch: &mut Patch, surfaces: &Surfaces, sizing: Sizing) {
    // The lattice's triangles are much smaller than wanted: without them the rest is quick.
    let mut mesh = Remeshing::new(patch, surfaces, sizing);
    while mesh.collapse() > mesh.vertices.len() / 50 {}
    for _ in 0..sizing.rounds {
        mesh.split();
        mesh.collapse();
        mesh.flip(Flip::Valence);
        mesh.relax();
    }
    for _ in 0..3 {
        mesh.flip(Flip::Angle);
        mesh.relax();
    }
    mesh.flip(Flip::Angle);
    *patch = mesh.finished();
}

/// A patch while its triangles change.
struct Remeshing<'a> {
    surfaces: &'a Surfaces<'a>,
    sizing: Sizing<'a>,
    vertices: Vec<Vec3>,
    /// Wanted edge length at each vertex.
    wanted: Vec<f32>,
    bits: Vec<u8>,
    /// Dead faces have three equal corners.
    faces: Vec<[u32; 3]>,
    labels: Vec<u8>,
    /// Live faces around each vertex.
    around: Vec<Vec<u32>>,
}

/// The faces on an edge: one at a border, else two.
#[derive(Clone, Copy)]
struct EdgeFaces {
    first: u32,
    second: Option<u32>,
}

impl<'a> Remeshing<'a> {
    fn new(patch: &Patch, surfaces: &'a Surfaces<'a>, sizing: Sizing<'a>) -> Self {
        let mut around = vec![Vec::new(); patch.vertices.len()];
        for (f, face) in patch.faces.iter().enumerate() {
            face.iter().for_each(|&v| around[v as usize].push(f as u32));
        }
        Self {
            surfaces,
            sizing,
            wanted: patch.vertices.iter().map(|&p| (sizing.edge)(p)).collect(),
            vertices: patch.vertices.clone(),
            bits: patch.bits.clone(),
            faces: patch.faces.clone(),
            labels: patch.labels.clone(),
            around,
        }
    }

    fn finished(self) -> Patch {
        let live = |f: &[u32; 3]| f[0] != f[1];
        let labels = self.faces.iter().zip(&self.labels).filter(|(f, _)| live(f));
        let mut patch = Patch {
            labels: labels.map(|(_, l)| *l).collect(),
            faces: self.faces.iter().copied().filter(live).collect(),
            vertices: self.vertices,
            bits: self.bits,
        };
        patch.drop_unused();
        patch
    }

    fn at(&self, v: u32) -> Vec3 {
        self.vertices[v as usize]
    }

    fn edges(&self) -> Vec<[u32; 2]> {
        unic_core::topology::edges(&self.faces)
    }

    /// Length over the wanted length.
    fn relative_length(&self, a: u32, b: u32) -> f32 {
        let wanted = 0.5 * (self.wanted[a as usize] + self.wanted[b as usize]);
        self.at(a).distance(self.at(b)) / wanted
    }

    /// None when the edge is gone or not manifold.
    fn faces_on(&self, a: u32, b: u32) -> Option<EdgeFaces> {
        let has = |f: &&u32| self.faces[**f as usize].contains(&b);
        let mut faces = self.around[a as usize].iter().filter(has).copied();
        let edge = EdgeFaces {
            first: faces.next()?,
            second: faces.next(),
        };
        faces.next().is_none().then_some(edge)
    }

    /// On a border or a seam.
    fn is_curve(&self, edge: EdgeFaces) -> bool {
        let label = |f: u32| self.labels[f as usize];
        edge.second
            .is_none_or(|second| label(second) != label(edge.first))
    }

    fn opposite(&self, face: u32, a: u32, b: u32) -> u32 {
        let corners = self.faces[face as usize];
        corners.into_iter().find(|&v| v != a && v != b).unwrap_or(a)
    }

    /// Distinct neighbours, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let faces = self.around[v as usize].iter();
        let mut found: Vec<u32> = faces
            .flat_map(|&f| self.faces[f as usize])
            .filter(|&n| n != v)
            .collect();
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Twice the area along the normal.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests;
