//! Intersection handling of the paper: the nearest body vertex and its tangent plane.

use crate::{closest::ClosestVertex, config::IntersectionMode, mesh::vertex_normals};
use glam::Vec3;

/// Posed body for the paper's intersection handling: vertices with normals, and a nearest-vertex
/// search.
///
/// Scratch: [prepared](Self::prepare) anew for every frame, without allocating after the first.
#[derive(Clone, Debug, Default)]
pub struct BodySnapshot {
    vertices: Vec<Vec3>,
    normals: Vec<Vec3>,
    tree: Option<ClosestVertex>,
}

/// Tangent plane of the body at the vertex nearest to a point p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentPlane {
    /// Index of the nearest body vertex.
    pub vertex: usize,
    /// Position b of the vertex, metres.
    pub position: Vec3,
    /// Unit normal n at the vertex, outwards; zero for a vertex without sound faces.
    pub normal: Vec3,
    /// Signed distance (p − b) · n, metres: negative on the inner side.
    pub height: f32,
}

impl BodySnapshot {
    /// Stores a posed body, world space, metres. Reuses the tree when the number of vertices is
    /// that of the last call.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist.
    pub fn prepare(&mut self, vertices: &[Vec3], faces: &[[u32; 3]]) {
        self.vertices.clear();
        self.vertices.extend_from_slice(vertices);
        vertex_normals(vertices, faces, &mut self.normals);
        match &mut self.tree {
            Some(tree) if tree.len() == vertices.len() => tree.refit(vertices),
            tree => *tree = Some(ClosestVertex::build(vertices)),
        }
    }

    /// Positions of the body's vertices, world space, metres.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Unit normals of the body's vertices, see [`vertex_normals`].
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Returns the tangent plane at the body vertex nearest to `p` (paper, eq. nn). None for a body
    /// without vertices or a `p` that is not finite.
    pub fn tangent_plane(&self, p: Vec3) -> Option<TangentPlane> {
        let (vertex, _) = self.tree.as_ref()?.nearest(p)?;
        let (position, normal) = (self.vertices[vertex], self.normals[vertex]);
        Some(TangentPlane {
            vertex,
            position,
            normal,
            height: (p - position).dot(normal),
        })
    }

    /// Returns whether `p` is on the inner side of the tangent plane at its nearest body vertex:
    /// the paper's test.
    ///
    /// The paper's indicator (eq. inner_product) is ReLU(s / |s|) with s = (p − b) · n, which is
    /// one on the *outer* side. This is a misprint: its text drags the points that it finds inside.
    pub fn is_inside(&self, p: Vec3) -> bool {
        self.tangent_plane(p).is_some_and(|plane| plane.height < 0.0)
    }
}

/// Rule of the paper: a point inside the body is dragged to the nearest body vertex and a little
/// out along its normal (eq. drag).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperIntersection {
    /// Distance from the vertex to the corrected position, metres: the paper's relaxation
    /// coefficient r.
    pub relaxation_m: f32,
}

impl Default for PaperIntersection {
    /// Returns the rule with the paper's 5 mm.
    fn default() -> Self {
        Self {
            relaxation_m: IntersectionMode::RELAXATION_M,
        }
    }
}

impl PaperIntersection {
    /// Returns the corrected position b + r n of a point inside the body; none for a point outside.
    ///
    /// All points with the same nearest vertex get the same position.
    pub fn correct(&self, body: &BodySnapshot, p: Vec3) -> Option<Vec3> {
        let plane = body.tangent_plane(p)?;
        // Strictly below: a normal of zero, of a vertex without sound faces, moves nothing.
        (plane.height < 0.0).then(|| plane.position + plane.normal * self.relaxation_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        intersection::{InsideTest, InsideTestBody},
        surface::Surface,
        test_meshes::{cube, point, sphere},
    };
    use proptest::prelude::*;

    fn snapshot(radius: f32) -> BodySnapshot {
        let sphere = sphere(3, radius);
        let mut body = BodySnapshot::default();
        body.prepare(&sphere.vertices, &sphere.faces);
        body
    }

    proptest! {
        #[test]
        fn points_inside_a_sphere_leave_it_and_others_stay(p in point(0.2)) {
            // Beside its vertex the tangent plane is slightly outside the sphere: facets are 2 cm
            // wide.
            let (radius, relaxation_m) = (0.15, 0.005);
            let body = snapshot(radius);
            match (PaperIntersection { relaxation_m }).correct(&body, p) {
                Some(moved) => {
                    prop_assert!(body.is_inside(p) && p.length() < radius + 1e-3);
                    prop_assert!((moved.length() - radius - relaxation_m).abs() < 1e-4);
                    prop_assert!(!body.is_inside(moved));
                }
                None => prop_assert!(!body.is_inside(p) && p.length() > radius - 1e-6),
            }
        }

        #[test]
        fn the_two_tests_agree_on_a_fine_sphere(p in point(0.2)) {
            let sphere = sphere(4, 0.15);
            let mut snapshot = BodySnapshot::default();
            snapshot.prepare(&sphere.vertices, &sphere.faces);
            let surface = Surface::build(&sphere);
            let body = InsideTestBody { snapshot: &snapshot, surface: &surface };
            let plane = body.depth(InsideTest::TangentPlane, p);
            let triangle = body.depth(InsideTest::ClosestTriangle, p);
            prop_assert!((triangle - (0.15 - p.length()).max(0.0)).abs() < 1e-3);
            // Far inside, the normal of the nearest vertex deviates from the direction to the
            // centre.
            prop_assert!((plane - triangle).abs() < 1e-3);
        }
    }

    #[test]
    fn a_snapshot_can_be_reused_for_other_bodies() {
        let mut body = snapshot(0.15);
        let p = Vec3::X * 0.2;
        assert!(!body.is_inside(p));
        for radius in [0.3, 0.1, 0.25] {
            let sphere = sphere(3, radius);
            body.prepare(&sphere.vertices, &sphere.faces);
            assert_eq!(body.is_inside(p), radius > 0.2);
        }
        let cube = cube();
        body.prepare(&cube.vertices, &cube.faces);
        assert_eq!(body.tangent_plane(Vec3::splat(0.9)).map(|t| t.vertex), Some(7));
        assert!(body.is_inside(Vec3::splat(0.9)));
    }

    #[test]
    fn nothing_is_inside_an_empty_body() {
        let mut body = BodySnapshot::default();
        assert!(!body.is_inside(Vec3::ZERO));
        body.prepare(&[], &[]);
        assert!(!body.is_inside(Vec3::ZERO));
        // A vertex without faces has no inner side.
        body.prepare(&[Vec3::ZERO], &[]);
        assert!(!body.is_inside(Vec3::NEG_ONE));
        assert_eq!(PaperIntersection::default().correct(&body, Vec3::NAN), None);
    }
}
