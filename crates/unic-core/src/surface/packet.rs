//! Closest-face queries for a packet of neighbouring points.

use super::{FaceFilter, Surface};
use crate::aabb_tree::Packet;
use glam::Vec3;

impl Surface {
    /// Finds the face closest to each of a packet of points among those that the filter accepts, if
    /// it is at most `radius` metres away.
    ///
    /// `seeds`, a face near the answer of each point, shorten the search; [`u32::MAX`] is none. The
    /// faces are those that [`Surface::closest_among`] finds, and their distances have the same bits.
    pub(crate) fn closest_of_packet(
        &self,
        points: &[Vec3],
        radius: f32,
        seeds: &[u32],
        filter: FaceFilter<impl Fn(u32) -> bool>,
    ) -> Packet {
        let mut packet = Packet::new(self.instructions, points, radius * radius);
        // Everything below is inlined into a function that is compiled for the instruction set; a
        // call that is not inlined would run on the baseline's instructions.
        self.instructions.run(
            #[inline(always)]
            || {
                // Seeds first: near ones shrink the search radius before the tree is entered.
                for (lane, &seed) in seeds.iter().enumerate() {
                    if let Some(&triangle) = self.triangle_of_face.get(seed as usize) {
                        let triangle = triangle as usize;
                        if self.is_in_groups(triangle, filter.groups) && (filter.accepts)(seed) {
                            packet.test_triangle_in(lane, seed, &self.triangles[triangle]);
                        }
                    }
                }
                self.tree.visit_nearest_of_packet(
                    &mut packet,
                    filter.groups,
                    #[inline(always)]
                    |triangles, packet| {
                        for &triangle in triangles {
                            self.test_triangle(packet, triangle as usize, &filter);
                        }
                    },
                );
            },
        );
        packet
    }

    /// Tests one triangle, if the filter accepts it, against all points of a packet.
    #[inline(always)]
    fn test_triangle(&self, packet: &mut Packet, triangle: usize, filter: &FaceFilter<impl Fn(u32) -> bool>) {
        if self.is_in_groups(triangle, filter.groups) {
            let face = self.face_of_triangle[triangle];
            packet.test_triangle(face, &self.triangles[triangle], || (filter.accepts)(face));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        aabb_tree::{GroupMask, LANES},
        mesh::TriMesh,
        simd::Instructions,
        test_meshes::point,
    };
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn all_instruction_sets_agree_with_one_point_at_a_time(
            corners in vec(point(1.0), 3..240), points in vec(point(1.5), 1..=LANES),
            seeds in vec(0u32..90, LANES), radius in 0.1f32..2.0,
        ) {
            let count = corners.len() as u32 / 3;
            let faces = (0..count).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let mut surface = Surface::build(&TriMesh::new(corners, faces.collect()).unwrap());
            let accepts = |face: u32| !face.is_multiple_of(5);
            surface.set_groups(|face| GroupMask(1 << (face % 7)));
            for instructions in Instructions::available() {
                surface.instructions = instructions;
                let packet = surface.closest_of_packet(&points, radius, &seeds, FaceFilter::new(accepts));
                for (lane, &p) in points.iter().enumerate() {
                    let alone = surface.closest_among(p, radius, u32::MAX, accepts);
                    let together = surface.point_on(packet.item[lane], p);
                    prop_assert_eq!(alone, together, "{:?}, lane {}", instructions, lane);
                    let distance = alone.map_or(radius, |hit| hit.distance);
                    prop_assert!((packet.squared[lane].sqrt() - distance).abs() < 1e-6);
                }
                // The faces of two groups, by a mask and by a predicate.
                let accepts = |face: u32| matches!(face % 7, 2 | 5);
                let filter = FaceFilter { groups: GroupMask(1 << 2 | 1 << 5), accepts };
                let packet = surface.closest_of_packet(&points, radius, &seeds, filter);
                for (lane, &p) in points.iter().enumerate() {
                    let expected = surface.closest_among(p, radius, u32::MAX, accepts);
                    prop_assert_eq!(surface.closest_filtered(p, radius, u32::MAX, filter), expected);
                    prop_assert_eq!(surface.point_on(packet.item[lane], p), expected);
                }
            }
        }
    }

    #[test]
    fn points_that_are_not_finite_find_nothing() {
        let triangle = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let surface = Surface::build(&triangle);
        let points = [Vec3::NAN, Vec3::Z, Vec3::INFINITY];
        let packet = surface.closest_of_packet(&points, f32::INFINITY, &[0; 3], FaceFilter::new(|_| true));
        assert_eq!(packet.item[..4], [u32::MAX, 0, u32::MAX, u32::MAX]);
    }
}
