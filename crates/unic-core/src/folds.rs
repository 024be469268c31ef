//! Folds of a posed body, where it intersects itself: armpits, crotch, the insides of elbows and
//! knees.
//!
//! For simulation and metrics.
//!
//! Skinning lets parts of a body pass into one another. A point in such a fold is outside one part
//! and inside another. Contact there tears cloth, and depths measured there mean nothing.
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

/// Largest gap of a fold between parts that face each other, metres: two layers of cloth with their
/// clearance do not fit into it.
pub const FOLD_GAP_M: f32 = 0.006;

/// Length of the rays through the inside of a body, metres: from a face within a torso to the
/// torso's far side.
const REACH_M: f32 = 0.35;

/// Largest cosine between the normals of two parts that face each other: the sides of a crease that
/// opens by less than 60 degrees.
const FACING_COSINE: f32 = -0.5;

/// Number of vertices that one thread takes at a time.
const CHUNK: usize = 128;

/// Vertices and faces of one pose of a body that lie in folds.
///
/// A ray along a vertex's normal decides. The vertex is folded when the ray first hits the inner
/// side of a face: then it lies inside the body. It is also folded when the ray first hits the
/// outer side of a part that faces it, at most [`FOLD_GAP_M`] away.
///
/// The faces around the vertex do not count, nor does a crease that opens by more than 60 degrees:
/// neighbours on one side of a bend never face each other. A face is folded when one of its corners
/// is.
///
/// The test is exact for a closed surface without thin shells. An eyeball in its socket is a fold,
/// since it is inside the head. Deterministic for any number of threads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Folds {
    vertices: Vec<bool>,
    faces: Vec<bool>,
    /// Number of folded corners of each face.
    corners: Vec<u8>,
}

impl Folds {
    /// Finds the folds of the pose of the last [`Surface::refit`]. Does not allocate when the
    /// number of vertices and faces is that of the last call.
    pub fn find(&mut self, surface: &Surface) {
        self.vertices.clear();
        self.vertices.resize(surface.vertex_count(), false);
        for_each_chunk(&mut self.vertices, CHUNK, |first, folded| {
            for (vertex, folded) in (first..).zip(folded) {
                let hit = surface.cast_from_vertex(vertex as u32, REACH_M);
                *folded = hit.is_some_and(is_fold);
            }
        });
        self.mark_faces_and_copies(surface);
    }

    /// Extends the result from welded vertices to the faces and to the other vertices at their
    /// places.
    fn mark_faces_and_copies(&mut self, surface: &Surface) {
        let welded = surface.welded_faces();
        let count = |face: &[u32; 3]| {
            face.iter()
                .map(|&v| u8::from(self.vertices[v as usize]))
                .sum::<u8>()
        };
        // Rays start from the first vertex at each place: copies have no welded faces and stay
        // false.
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

    /// Returns whether each face lies in a fold; empty before the first [`Folds::find`].
    pub fn faces(&self) -> &[bool] {
        &self.faces
    }

    /// Returns whether each vertex lies in a fold; empty before the first [`Folds::find`].
    pub fn vertices(&self) -> &[bool] {
        &self.vertices
    }

    /// Number of corners of a face that lie in folds; zero for an index beyond the faces.
    pub fn folded_corners(&self, face: u32) -> usize {
        self.corners
            .get(face as usize)
            .map_or(0, |&corners| corners.into())
    }

    /// Returns whether any corner of a face lies in a fold; false for an index beyond the faces.
    pub fn is_face_folded(&self, face: u32) -> bool {
        self.faces.get(face as usize).is_some_and(|&folded| folded)
    }
}

/// Returns whether a single welded vertex lies in a fold between faces that `accepts` names.
pub(crate) fn vertex_is_folded(surface: &Surface, vertex: u32, accepts: impl Fn(u32) -> bool) -> bool {
    surface
        .cast_from_vertex_where(vertex, REACH_M, accepts)
        .is_some_and(is_fold)
}

fn is_fold(hit: RayHit) -> bool {
    // The first face that a ray from inside hits is seen from its inner side.
    let is_inside = hit.cosine > 0.0;
    is_inside || (hit.distance <= FOLD_GAP_M && hit.cosine < FACING_COSINE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::TriMesh,
        test_meshes::{sheet, sphere},
    };
    use glam::{Quat, Vec3};

    const RADIUS: f32 = 0.05;

    /// Two upright capsules, 30 cm long and 10 cm thick, side by side.
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
    fn convex_and_flat_meshes_have_no_folds() {
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
    fn vertices_inside_the_other_capsule_are_folded_and_those_far_from_it_are_not() {
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
    fn folds_do_not_depend_on_split_seams_or_threads() {
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
