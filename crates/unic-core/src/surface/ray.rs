//! What a vertex of the surface sees along its normal.

use super::Surface;
use crate::bvh::Ray;
use glam::Vec3;

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The face; the lowest index among faces at exactly the same distance.
    pub face: u32,
    /// Distance from the ray's origin, metres.
    pub distance: f32,
    /// Cosine between the ray and the face's normal: negative where the ray meets the outer side,
    /// positive where it comes from within.
    pub cosine: f32,
}

impl Surface {
    /// The first face that a ray from `origin` along the unit vector `direction` meets, at most
    /// `reach` metres away. Degenerate faces are not met.
    ///
    /// ```
    /// use glam::Vec3;
    /// use unic_core::{mesh::TriMesh, surface::Surface};
    ///
    /// let floor = Surface::build(&TriMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]])?);
    /// let hit = floor.first_along(Vec3::new(0.2, 2.0, 0.2), Vec3::NEG_Y, 5.0).unwrap();
    /// assert_eq!((hit.distance, hit.cosine), (2.0, -1.0));
    /// assert_eq!(floor.first_along(Vec3::new(0.2, 2.0, 0.2), Vec3::NEG_Y, 1.0), None);
    /// # Ok::<(), unic_core::mesh::MeshError>(())
    /// ```
    pub fn first_along(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<RayHit> {
        self.first_among(origin, direction, reach, |_| true)
    }

    /// What vertex `vertex` of the bind pose sees along its normal, the sum of the normals of
    /// the faces around it by area, past those faces; none for a vertex without sound faces.
    pub(crate) fn seen_from_vertex(&self, vertex: u32, reach: f32) -> Option<RayHit> {
        self.seen_among(vertex, reach, |_| true)
    }

    /// The same, looking through the faces that do not count.
    pub(crate) fn seen_among(&self, vertex: u32, reach: f32, counts: impl Fn(u32) -> bool) -> Option<RayHit> {
        let face = self.faces_at(vertex).next()?;
        let corners = self.welded[face as usize];
        let corner = corners.iter().position(|&v| v == vertex)?;
        let origin = self.face(face).corners()[corner];
        let normal = self.vertex_normal(vertex);
        let is_elsewhere = |face: u32| !self.welded[face as usize].contains(&vertex);
        self.first_among(origin, normal, reach, |face| is_elsewhere(face) && counts(face))
    }

    /// [`Surface::first_along`] among the faces that count.
    pub(crate) fn first_among(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: f32,
        counts: impl Fn(u32) -> bool,
    ) -> Option<RayHit> {
        if !(origin.is_finite() && direction.is_normalized()) {
            return None;
        }
        let ray = Ray::new(origin, direction);
        let mut first: Option<RayHit> = None;
        self.tree
            .along(&ray, reach.min(f32::MAX), |triangles, mut bound| {
                for &triangle in triangles {
                    let face = self.face_of_triangle[triangle as usize];
                    let triangle = &self.triangles[triangle as usize];
                    let Some((distance, along)) = triangle.crossing(&ray) else {
                        continue;
                    };
                    let lower = first.is_none_or(|hit| face < hit.face);
                    if (distance < bound || (distance == bound && lower)) && counts(face) {
                        let cosine = along.signum() * triangle.normal().dot(direction).abs();
                        first = Some(RayHit {
                            face,
                            distance,
                            cosine,
                        });
                        bound = distance;
                    }
                }
                bound
            });
        first
    }

    /// The vertices of the bind pose that stand for all at their place, by vertex.
    pub(crate) fn welded_faces(&self) -> &[[u32; 3]] {
        &self.welded
    }

    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::TriMesh,
        shapes::{point, sphere},
    };
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn agrees_with_looking_at_every_face(
            corners in vec(point(1.0), 3..150), origin in point(1.0), towards in point(1.0),
        ) {
            prop_assume!(towards.length() > 0.1);
            let faces = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let surface = Surface::build(&TriMesh::new(corners, faces.collect()).unwrap());
            let ray = Ray::new(origin, towards.normalize());
            let expected = (0..surface.faces.len() as u32)
                .filter_map(|f| Some((surface.face(f).crossing(&ray)?.0, f)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let found = surface.first_along(origin, ray.direction, 10.0);
            prop_assert_eq!(found.map(|hit| (hit.distance, hit.face)), expected);
        }

        #[test]
        fn the_way_out_of_a_sphere_and_the_way_in(origin in point(0.5), towards in point(1.0)) {
            prop_assume!(towards.length() > 0.1);
            let (surface, towards) = (Surface::build(&sphere(3, 1.0)), towards.normalize());
            let out = surface.first_along(origin, towards, 3.0).unwrap();
            prop_assert!(out.cosine > 0.0);
            prop_assert!(((origin + towards * out.distance).length() - 1.0).abs() < 5e-3);
            let far = origin + towards * (out.distance + 1.0);
            let back = surface.first_along(far, -towards, 3.0).unwrap();
            prop_assert!(back.cosine < 0.0 && (back.distance - 1.0).abs() < 1e-4);
            prop_assert_eq!(surface.first_along(far, towards, 3.0), None);
        }
    }

    #[test]
    fn rays_along_the_axes_hit_edges_and_vertices() {
        let surface = Surface::build(&sphere(2, 1.0));
        for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
            let hit = surface.first_along(Vec3::ZERO, axis, 2.0).unwrap();
            assert!((hit.distance - 1.0).abs() < 1e-6);
        }
        assert_eq!(surface.first_along(Vec3::ZERO, Vec3::ZERO, 2.0), None);
    }
}
