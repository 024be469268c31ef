//! Closest faces for many points at once.

use super::{Among, Surface};
use crate::bvh::Packet;
use glam::Vec3;

impl Surface {
    /// The closest face to each of a packet of points among those that count, if it is at most `radius` metres
    /// away; sooner when `seeds` are some of them near it.
    ///
    /// The same faces as [`Surface::closest_among`] finds, to the bit of their distances.
    pub(crate) fn closest_of_packet(
        &self,
        points: &[Vec3],
        radius: f32,
        seeds: &[u32],
        among: Among<impl Fn(u32) -> bool>,
    ) -> Packet {
        let mut packet = Packet::new(self.instructions, points, radius * radius);
        self.instructions.run(
            #[inline(always)]
            || {
                for (k, &seed) in seeds.iter().enumerate() {
                    if seeds[..k].contains(&seed) {
                        continue;
                    }
                    if let Some(&triangle) = self.triangle_of_face.get(seed as usize) {
                        self.meet(&mut packet, triangle as usize, &among);
                    }
                }
                self.tree.nearest_of_packet(
                    &mut packet,
                    among.marks,
                    #[inline(always)]
                    |triangles, packet| {
                        for &triangle in triangles {
                            self.meet(packet, triangle as usize, &among);
                        }
                    },
                );
            },
        );
        packet
    }

    #[inline(always)]
    fn meet(&self, packet: &mut Packet, triangle: usize, among: &Among<impl Fn(u32) -> bool>) {
        if self.bears(triangle, among.marks) {
            let face = self.face_of_triangle[triangle];
            packet.meet(face, &self.triangles[triangle], || (among.counts)(face));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bvh::{LANES, Marks},
        mesh::TriMesh,
        network::{Instructions, Precision},
        shapes::point,
    };
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn all_instruction_sets_agree_with_one_point_at_a_time(
            corners in vec(point(1.0), 3..240), points in vec(point(1.5), 1..=LANES),
            seed in 0u32..90, radius in 0.1f32..2.0,
        ) {
            let count = corners.len() as u32 / 3;
            let faces = (0..count).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let mut surface = Surface::build(&TriMesh::new(corners, faces.collect()).unwrap());
            let counts = |face: u32| !face.is_multiple_of(5);
            surface.mark(|face| Marks(1 << (face % 7)));
            for instructions in Instructions::available(Precision::F32) {
                surface.instructions = instructions;
                let packet = surface.closest_of_packet(&points, radius, &[seed], Among::new(counts));
                for (lane, &p) in points.iter().enumerate() {
                    let alone = surface.closest_among(p, radius, u32::MAX, counts);
                    let together = surface.point_on(packet.item[lane], p);
                    prop_assert_eq!(alone, together, "{:?}, lane {}", instructions, lane);
                    let distance = alone.map_or(radius, |hit| hit.distance);
                    prop_assert!((packet.squared[lane].sqrt() - distance).abs() < 1e-6);
                }
                // Those of two marks, named by their marks and by looking at every face.
                let counts = |face: u32| matches!(face % 7, 2 | 5);
                let marked = Among { marks: Marks(1 << 2 | 1 << 5), counts };
                let packet = surface.closest_of_packet(&points, radius, &[seed], marked);
                for (lane, &p) in points.iter().enumerate() {
                    let expected = surface.closest_among(p, radius, u32::MAX, counts);
                    prop_assert_eq!(surface.closest_marked(p, radius, u32::MAX, marked), expected);
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
        let packet = surface.closest_of_packet(&points, f32::INFINITY, &[u32::MAX, 0], Among::new(|_| true));
        assert_eq!(packet.item[..4], [u32::MAX, 0, u32::MAX, u32::MAX]);
    }
}
