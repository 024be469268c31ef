//! Ray casts against a surface, from any point and from its own vertices along their normals.

use super::Surface;
use crate::bounds::Ray;
use glam::Vec3;

/// Smallest cosine between a face's normal and a segment that passes through it. Below it rounding
/// decides where a segment along a face is.
const GRAZING_COSINE: f32 = 1e-3;

/// First face that a ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Index of the face; the lowest among faces at exactly the same distance.
    pub face: u32,
    /// Distance from the ray's origin, metres.
    pub distance: f32,
    /// Cosine between the ray and the face's normal: negative where the ray hits the outer side,
    /// positive where it comes from the inner side.
    pub cosine: f32,
}

impl Surface {
    /// Casts a ray from `origin` along the unit vector `direction`, and returns the first face that
    /// it hits at most `reach` metres away. Degenerate faces are never hit.
    ///
    /// ```
    /// use glam::Vec3;
    /// use unic_core::{mesh::TriMesh, surface::Surface};
    ///
    /// let corners = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
    /// let floor = Surface::build(&TriMesh::new(corners, vec![[0, 1, 2]])?);
    /// let hit = floor.cast_ray(Vec3::new(0.2, 2.0, 0.2), Vec3::NEG_Y, 5.0).unwrap();
    /// assert_eq!((hit.distance, hit.cosine), (2.0, -1.0));
    /// assert_eq!(floor.cast_ray(Vec3::new(0.2, 2.0, 0.2), Vec3::NEG_Y, 1.0), None);
    /// # Ok::<(), unic_core::mesh::MeshError>(())
    /// ```
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<RayHit> {
        self.cast_ray_where(origin, direction, reach, |_| true)
    }

    /// Casts a ray from a welded vertex along its [normal](Self::vertex_normal), past the faces
    /// around it, and returns the first face at most `reach` metres away. None for a vertex without
    /// sound faces.
    pub(crate) fn cast_from_vertex(&self, vertex: u32, reach: f32) -> Option<RayHit> {
        self.cast_from_vertex_where(vertex, reach, |_| true)
    }

    /// Does what [`Self::cast_from_vertex`] does, with the faces that `accepts` names alone.
    pub(crate) fn cast_from_vertex_where(
        &self,
        vertex: u32,
        reach: f32,
        accepts: impl Fn(u32) -> bool,
    ) -> Option<RayHit> {
        let face = self.faces_at(vertex).next()?;
        let corners = self.welded_faces[face as usize];
        let corner = corners.iter().position(|&v| v == vertex)?;
        let origin = self.face(face).corners()[corner];
        let normal = self.vertex_normal(vertex);
        let is_elsewhere = |face: u32| !self.welded_faces[face as usize].contains(&vertex);
        self.cast_ray_where(origin, normal, reach, |face| is_elsewhere(face) && accepts(face))
    }

    /// Does what [`Self::cast_ray`] does, with the faces that `accepts` names alone.
    pub(crate) fn cast_ray_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: f32,
        accepts: impl Fn(u32) -> bool,
    ) -> Option<RayHit> {
        if !(origin.is_finite() && direction.is_normalized()) {
            return None;
        }
        let ray = Ray::new(origin, direction);
        let mut first: Option<RayHit> = None;
        // The tree needs a finite bound: boxes that the ray misses are at infinity.
        self.tree
            .visit_along_ray(&ray, reach.min(f32::MAX), |triangles, mut bound| {
                for &triangle in triangles {
                    let face = self.face_of_triangle[triangle as usize];
                    let triangle = &self.triangles[triangle as usize];
                    let Some(crossing) = triangle.crossing(&ray) else {
                        continue;
                    };
                    let distance = crossing.t;
                    let is_lower = first.is_none_or(|hit| face < hit.face);
                    if (distance < bound || (distance == bound && is_lower)) && accepts(face) {
                        // The sign is that of the crossing, which rounding of the normal cannot
                        // flip.
                        let sign = crossing.dot_area_normal.signum();
                        let cosine = sign * triangle.normal().dot(direction).abs();
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

    /// Returns whether the segment between two points, metres, passes through any face that
    /// `accepts` names, or ends on one. Degenerate faces and faces that it runs along do not count. A
    /// segment whose ends are not finite passes through none.
    pub fn is_crossed(&self, [from, to]: [Vec3; 2], accepts: impl Fn(u32) -> bool) -> bool {
        if !(from.is_finite() && to.is_finite()) {
            return false;
        }
        // Distances along this ray are shares of the segment.
        let ray = Ray::new(from, to - from);
        let least_cosine = GRAZING_COSINE * ray.direction.length();
        let mut is_crossed = false;
        self.tree.visit_along_ray(&ray, 1.0, |triangles, bound| {
            is_crossed = triangles.iter().any(|&triangle| {
                let face = &self.triangles[triangle as usize];
                face.crossing(&ray).is_some_and(|crossing| crossing.t <= 1.0)
                    && face.normal().dot(ray.direction).abs() > least_cosine
                    && accepts(self.face_of_triangle[triangle as usize])
            });
            // Nothing is nearer than this bound, so the search ends.
            if is_crossed { -1.0 } else { bound }
        });
        is_crossed
    }

    /// Faces of the mesh by [welded vertices](Surface::welded_vertex).
    pub(crate) fn welded_faces(&self) -> &[[u32; 3]] {
        &self.welded_faces
    }

    /// Number of vertices, before welding.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::TriMesh,
        test_meshes::{point, sphere},
    };
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn ray_casts_agree_with_a_test_of_every_face(
            corners in vec(point(1.0), 3..150), origin in point(1.0), towards in point(1.0),
        ) {
            prop_assume!(towards.length() > 0.1);
            let faces = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let surface = Surface::build(&TriMesh::new(corners, faces.collect()).unwrap());
            let ray = Ray::new(origin, towards.normalize());
            let expected = (0..surface.faces.len() as u32)
                .filter_map(|f| Some((surface.face(f).crossing(&ray)?.t, f)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let found = surface.cast_ray(origin, ray.direction, 10.0);
            prop_assert_eq!(found.map(|hit| (hit.distance, hit.face)), expected);
        }

        #[test]
        fn segments_cross_what_a_ray_of_their_length_hits(
            corners in vec(point(1.0), 3..150), from in point(1.0), to in point(1.0), odd in any::<bool>(),
        ) {
            prop_assume!(from.distance(to) > 0.1);
            let faces = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let surface = Surface::build(&TriMesh::new(corners, faces.collect()).unwrap());
            let accepts = |face: u32| (face % 2 == 1) == odd;
            let direction = (to - from).normalize();
            let hit = surface.cast_ray_where(from, direction, f32::MAX, accepts);
            let share = hit.map_or(f32::INFINITY, |hit| hit.distance / from.distance(to));
            // At an end of the segment and along a face rounding decides.
            prop_assume!((share - 1.0).abs() > 1e-4);
            prop_assume!(hit.is_none_or(|hit| hit.cosine.abs() > 2.0 * GRAZING_COSINE));
            prop_assert_eq!(surface.is_crossed([from, to], accepts), share < 1.0);
        }

        #[test]
        fn cosines_tell_the_way_out_of_a_sphere_from_the_way_in(origin in point(0.5), towards in point(1.0)) {
            prop_assume!(towards.length() > 0.1);
            let (surface, towards) = (Surface::build(&sphere(3, 1.0)), towards.normalize());
            let out = surface.cast_ray(origin, towards, 3.0).unwrap();
            prop_assert!(out.cosine > 0.0);
            prop_assert!(((origin + towards * out.distance).length() - 1.0).abs() < 5e-3);
            let far = origin + towards * (out.distance + 1.0);
            let back = surface.cast_ray(far, -towards, 3.0).unwrap();
            prop_assert!(back.cosine < 0.0 && (back.distance - 1.0).abs() < 1e-4);
            prop_assert_eq!(surface.cast_ray(far, towards, 3.0), None);
        }
    }

    #[test]
    fn rays_along_the_axes_hit_edges_and_vertices() {
        let surface = Surface::build(&sphere(2, 1.0));
        for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
            let hit = surface.cast_ray(Vec3::ZERO, axis, 2.0).unwrap();
            assert!((hit.distance - 1.0).abs() < 1e-6);
        }
        assert_eq!(surface.cast_ray(Vec3::ZERO, Vec3::ZERO, 2.0), None);
    }
}
