//! Isotropic remeshing: splits, collapses, flips and tangential smoothing.

mod collapse;
mod flip;
mod relax;
mod split;

use super::{Patch, Surfaces};
use flip::FlipCriterion;
use glam::Vec3;

/// Target size of triangles.
#[derive(Clone, Copy)]
pub(crate) struct Sizing<'a> {
    /// Wanted length of edges at a point, metres.
    pub(crate) edge: &'a (dyn Fn(Vec3) -> f32 + Sync),
    /// Number of rounds of split, collapse, flip and smoothing.
    pub(crate) rounds: usize,
}

/// Length over the wanted length above which an edge is split.
///
/// The halves of such an edge are at least 2/3 of the wanted length.
const LONG: f32 = 4.0 / 3.0;

/// Length over the wanted length below which an edge is collapsed.
const SHORT: f32 = 0.8;

/// Rounds of Delaunay flips and smoothing after the other rounds.
const FINAL_ROUNDS: usize = 3;

/// Remeshes a patch after Botsch & Kobbelt 2004, "A remeshing approach to multiresolution
/// modeling".
///
/// Borders and seams stay on the curves of their cuts. Corners, where two cuts meet, do not move.
pub(crate) fn remesh(patch: &mut Patch, surfaces: &Surfaces, sizing: Sizing) {
    // The triangles of the lattice are much smaller than wanted. They are collapsed first, until a
    // pass removes at most 2 % of the vertices, so that the rounds work on few triangles.
    let mut mesh = Remeshing::new(patch, surfaces, sizing);
    while mesh.collapse() > mesh.vertices.len() / 50 {}
    for _ in 0..sizing.rounds {
        mesh.split();
        mesh.collapse();
        mesh.flip(FlipCriterion::Valence);
        mesh.relax();
    }
    // Valences first, angles last: equal valences spread the vertices evenly, Delaunay flips then
    // remove small angles without changing the number of vertices.
    for _ in 0..FINAL_ROUNDS {
        mesh.flip(FlipCriterion::Angle);
        mesh.relax();
    }
    mesh.flip(FlipCriterion::Angle);
    *patch = mesh.finished();
}

/// A patch while its triangles change.
struct Remeshing<'a> {
    surfaces: &'a Surfaces<'a>,
    sizing: Sizing<'a>,
    vertices: Vec<Vec3>,
    /// Wanted edge length at each vertex, metres. It is not updated when a vertex moves a little.
    wanted: Vec<f32>,
    /// Cuts that each vertex lies on, as a bit set.
    bits: Vec<u8>,
    /// Triangles. Removed ones have three equal corners, so that the indices of the others stay
    /// valid.
    faces: Vec<[u32; 3]>,
    /// Panel of each face.
    labels: Vec<u8>,
    /// Existing faces around each vertex.
    around: Vec<Vec<u32>>,
}

/// Faces on an edge: one at a border, otherwise two.
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

    /// Returns the patch without removed faces and unused vertices.
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

    /// Length of an edge over its wanted length.
    fn relative_length(&self, a: u32, b: u32) -> f32 {
        let wanted = 0.5 * (self.wanted[a as usize] + self.wanted[b as usize]);
        self.at(a).distance(self.at(b)) / wanted
    }

    /// Faces on an edge; none if the edge does not exist or has more than two faces.
    fn faces_on(&self, a: u32, b: u32) -> Option<EdgeFaces> {
        let has = |f: &&u32| self.faces[**f as usize].contains(&b);
        let mut faces = self.around[a as usize].iter().filter(has).copied();
        let edge = EdgeFaces {
            first: faces.next()?,
            second: faces.next(),
        };
        faces.next().is_none().then_some(edge)
    }

    /// Returns true for an edge on a border or a seam.
    fn is_curve(&self, edge: EdgeFaces) -> bool {
        let label = |f: u32| self.labels[f as usize];
        edge.second
            .is_none_or(|second| label(second) != label(edge.first))
    }

    /// Corner of a face that is neither `a` nor `b`.
    fn opposite(&self, face: u32, a: u32, b: u32) -> u32 {
        let corners = self.faces[face as usize];
        corners.into_iter().find(|&v| v != a && v != b).unwrap_or(a)
    }

    /// Vertices that share an edge with `v`, ascending.
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

/// Normal of a triangle, twice its area long.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests;
