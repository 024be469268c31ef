//! Where a posed body folds into itself: armpits, crotch, the insides of elbows and knees.
//!
//! Skinning lets parts of a body pass into one another. What lies in such a fold is outside one part
//! and inside another: contact there tears cloth, and depths measured there say nothing about it.
//!
//! ```
//! use unic_core::{folds::Folds, mesh::TriMesh, surface::Surface};
//! # use glam::Vec3;
//! # let body = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
//! #     vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
//!
//! let surface = Surface::build(&body);
//! let mut folds = Folds::default();
//! folds.find(&surface);
//! // A tetrahedron does not touch itself.
//! assert!(folds.faces().iter().all(|folded| !folded));
//! # Ok::<(), unic_core::mesh::MeshError>(())
//! ```

use crate::{
    parallel::for_each_chunk,
    surface::{RayHit, Surface},
};

/// Parts that face each other at most this far apart are a fold, metres: two layers of cloth with
/// their clearance do not fit between them.
pub const FOLD_GAP_M: f32 = 0.006;

/// How far the inside of a body is looked through, metres: from a face within a torso to the
/// torso's far side.
const REACH_M: f32 = 0.35;

/// Cosine between a normal and that of the part it meets from which the two face each other: the
/// sides of a crease that opens by less than 60 degrees.
const FACING_COSINE: f32 = -0.5;

/// Vertices that one thread takes at a time.
const CHUNK: usize = 128;

/// The vertices and faces of one pose of a body that lie in folds.
///
/// A vertex is folded when the first thing that its normal meets is the inner side of a face,
/// so that it lies inside the body, or the outer side of a part that faces it at most
/// [`FOLD_GAP_M`] away. The faces around the vertex do not count, nor does a crease that opens by
/// more than 60 degrees: neighbours on one side of a bend never face each other. A face is folded
/// when one of its corners is.
///
/// Exact for a closed surface without thin shells: an eyeball in its socket is a fold, as it is
/// inside the head. Deterministic for any number of threads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Folds {
    vertices: Vec<bool>,
    faces: Vec<bool>,
    /// How many corners of each face.
    corners: Vec<u8>,
}

impl Folds {
    /// Finds the folds of a pose: that of the last [`Surface::refit`]. Does not allocate when the
    /// counts are the last call's.
    pub fn find(&mut self, surface: &Surface) {
        self.vertices.clear();
        self.vertices.resize(surface.vertex_count(), false);
        for_each_chunk(&mut self.vertices, CHUNK, |first, folded| {
            for (vertex, folded) in (first..).zip(folded) {
                let seen = surface.seen_from_vertex(vertex as u32, REACH_M);
                *folded = seen.is_some_and(is_fold);
            }
        });
        self.spread(surface);
    }

    /// From the vertices that were looked at to the faces and to the vertices at the same places.
    fn spread(&mut self, surface: &Surface) {
        let welded = surface.welded_faces();
        let count = |face: &[u32; 3]| {
            face.iter()
                .map(|&v| u8::from(self.vertices[v as usize]))
                .sum::<u8>()
        };
        self.corners.clear();
        self.corners.extend(welded.iter().map(count));
        self.faces.clear();
        self.faces.extend(self.corners.iter().map(|&corners| corners > 0));
        for (face, first) in surface.faces().iter().zip(welded) {
            for (&vertex, &first) in face.iter().zip(first) {
                self.vertices[vertex as usize] = self.vertices[first as usize];
            }
        }
    }

    /// Whether each face lies in a fold; empty before the first [`Folds::find`].
    pub fn faces(&self) -> &[bool] {
        &self.faces
    }

    /// Whether each vertex does.
    pub fn vertices(&self) -> &[bool] {
        &self.vertices
    }

    /// How many corners of a face lie in folds; none of what is no face.
    pub fn corners_of_face(&self, face: u32) -> usize {
        self.corners
            .get(face as usize)
            .map_or(0, |&corners| corners.into())
    }

    /// Whether any corner of a face lies in a fold; false for what is no face.
    pub fn has_face(&self, face: u32) -> bool {
        self.faces.get(face as usize).is_some_and(|&folded| folded)
    }
}

/// Whether one vertex, the first at its place, lies in a fold, without looking at the others; parts
/// that do not count make none.
pub(crate) fn vertex_is_folded(surface: &Surface, vertex: u32, counts: impl Fn(u32) -> bool) -> bool {
    surface.seen_among(vertex, REACH_M, counts).is_some_and(is_fold)
}

fn is_fold(seen: RayHit) -> bool {
    let is_inside = seen.cosine > 0.0;
    is_inside || (seen.distance <= FOLD_GAP_M && seen.cosine < FACING_COSINE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::TriMesh,
        shapes::{sheet, sphere},
    };
    use glam::{Quat, Vec3};

    const RADIUS: f32 = 0.05;

    /// Two capsules, 30 cm long and 10 cm thick, hanging side by side.
    fn capsules(vertex_of: impl Fn(usize, Vec3) -> Vec3) -> TriMesh {
        let ball = sphere(3, RADIUS);
        let count = ball.vertices.len() as u32;
        let stretched = |v: &Vec3| *v + Vec3::Y * 0.1 * v.y.signum() * f32::from(v.y.abs() > 1e-6);
        let place = |side: usize| ball.vertices.iter().map(stretched).map(move |v| (side, v));
        let vertices = place(0)
            .chain(place(1))
            .map(|(side, v)| vertex_of(side, v))
            .collect();
        let second = ball.faces.iter().map(|f| f.map(|v| v + count));
        TriMesh::new(vertices, ball.faces.iter().copied().chain(second).collect()).unwrap()
    }

    fn folds_of(mesh: &TriMesh) -> Folds {
        let mut folds = Folds::default();
        folds.find(&Surface::build(mesh));
        folds
    }

    #[test]
    fn round_things_have_no_folds() {
        for mesh in [
            sphere(0, 0.3),
            sphere(4, 0.01),
            sheet(5, 5, 0.1),
            TriMesh::default(),
        ] {
            let folds = folds_of(&mesh);
            assert_eq!(folds.faces(), vec![false; mesh.faces.len()]);
        }
    }

    #[test]
    fn what_lies_in_the_other_capsule_and_nothing_far_from_it_is_folded() {
        // The second capsule leans over, its lower end deep in the first.
        let lean = Quat::from_rotation_z(-0.5);
        let place = |side: usize, v: Vec3| match side {
            0 => v,
            _ => lean * (v + Vec3::Y * 0.15) + Vec3::new(0.02, -0.15, 0.0),
        };
        let mesh = capsules(place);
        let folds = folds_of(&mesh);
        let axis_distance = |p: Vec3| {
            let on_axis = Vec3::Y * p.y.clamp(-0.1, 0.1);
            p.distance(on_axis)
        };
        let half = mesh.vertices.len() / 2;
        let (mut inside, mut near) = (0, 0);
        for (i, &v) in mesh.vertices.iter().enumerate() {
            let own_frame = lean.inverse() * (v - Vec3::new(0.02, -0.15, 0.0)) - Vec3::Y * 0.15;
            let other = if i < half { own_frame } else { v };
            let depth = RADIUS - axis_distance(other);
            if depth > 1e-3 {
                assert!(folds.vertices()[i], "vertex {i}, {depth} m inside");
                inside += 1;
            }
            if depth < -0.02 {
                assert!(!folds.vertices()[i], "vertex {i}, {} m outside", -depth);
                near += 1;
            }
        }
        assert!(inside > 100 && near > 100, "{inside} inside, {near} far");
    }

    #[test]
    fn facing_parts_are_a_fold_when_no_cloth_fits_between() {
        for (gap, expected) in [(0.5 * FOLD_GAP_M, true), (2.0 * FOLD_GAP_M, false)] {
            let shift = |side: usize| Vec3::X * (2.0 * RADIUS + gap) * side as f32;
            let folds = folds_of(&capsules(|side, v| v + shift(side)));
            assert_eq!(folds.faces().contains(&true), expected, "gap of {gap} m");
        }
    }

    #[test]
    fn split_seams_and_threads_change_nothing() {
        let mesh = capsules(|side, v| v + Vec3::X * 0.07 * side as f32);
        let folds = folds_of(&mesh);
        let corners = mesh.faces.iter().flatten().map(|&v| mesh.vertices[v as usize]);
        let faces = (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
        let split = TriMesh::new(corners.collect(), faces.collect()).unwrap();
        assert_eq!(folds_of(&split).faces(), folds.faces());
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(one.install(|| folds_of(&mesh)), folds);
    }
}
