//! The faces of a garment that the body may poke through.

use crate::{
    bvh::{Aabb, Bvh, Packet},
    intersection::packets::Packets,
    mesh::TriMesh,
    network::{Instructions, Precision},
    parallel::for_each_chunk,
    surface::Triangle,
};
use glam::Vec3;

/// How deep under a body vertex the cloth that it pokes through is looked for, metres: the sagitta
/// L² / 8R of an edge of 10 cm over a shoulder of 5 cm radius.
const REACH_M: f32 = 0.025;

/// Faces that one thread takes at a time.
const CHUNK: usize = 4096;

/// Faces are at most so much longer than at rest: those that are stretched farther may be missed.
const MOST_STRETCH: f32 = 2.0;

/// A garment by slot, of which only the faces near the body can be found.
///
/// A corner's height is the radius of a ball without body. Where the balls at its corners cover a
/// face, nothing pokes through it.
#[derive(Clone, Debug)]
pub(super) struct Cloth {
    /// Over the faces in their order here.
    tree: Bvh,
    /// Three slots each, neighbours after one another.
    faces: Vec<[u32; 3]>,
    /// The face of the garment.
    numbers: Vec<u32>,
    /// Most that a point of a face at rest is from its nearest corner, metres.
    radii: Vec<f32>,
    clearance_m: f32,
    reach_m: f32,
    is_near: Vec<bool>,
    instructions: Instructions,
}

impl Cloth {
    /// Of a garment's rest shape; nothing pokes through where `clearance_m` is left.
    pub(super) fn new(rest: &TriMesh, packets: &Packets, clearance_m: f32) -> Self {
        let corners = |f: &[u32; 3]| f.map(|v| rest.vertices[v as usize]);
        let centres: Vec<Vec3> = (rest.faces.iter())
            .map(|f| corners(f).iter().sum::<Vec3>() / 3.0)
            .collect();
        let mut tree = Bvh::build(&centres);
        let numbers = tree.take_order();
        let rest_faces = || numbers.iter().map(|&face| &rest.faces[face as usize]);
        let radii: Vec<f32> = rest_faces().map(|f| covering_radius(corners(f))).collect();
        let largest = radii.iter().copied().fold(0.0, f32::max);
        Self {
            clearance_m,
            // Corners are outside, so that a face leads no deeper than its radius; the vertex is
            // beside that place by as much at most.
            reach_m: f32::min(2.0 * (clearance_m + largest), REACH_M),
            tree,
            faces: rest_faces()
                .map(|f| f.map(|v| packets.slots()[v as usize]))
                .collect(),
            radii,
            is_near: vec![false; numbers.len()],
            numbers,
            instructions: Instructions::best(Precision::F32),
        }
    }

    /// Slots of the corners of each face.
    pub(super) fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Slots of the corners.
    pub(super) fn corners(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// The face in the garment's own order.
    pub(super) fn number(&self, face: u32) -> u32 {
        self.numbers[face as usize]
    }

    pub(super) fn triangle(&self, face: u32, at: &[Vec3]) -> Triangle {
        Triangle::new(self.corners(face).map(|slot| at[slot as usize]))
    }

    /// How far from a body vertex the cloth that it pokes through can be, metres.
    pub(super) fn reach_m(&self) -> f32 {
        self.reach_m
    }

    /// Takes positions and heights over the body by slot, metres.
    pub(super) fn find_near(&mut self, at: &[Vec3], heights: impl Fn(u32) -> f32 + Sync + Send) {
        let (faces, radii, clearance_m) = (&self.faces, &self.radii, self.clearance_m);
        for_each_chunk(&mut self.is_near, CHUNK, |first, is_near| {
            for (k, is_near) in (first..).zip(is_near) {
                let [a, b, c] = faces[k].map(&heights);
                let least = if b < a { b } else { a };
                let least = if c < least { c } else { least };
                // The bound for a stretched face first: it asks for no positions.
                *is_near = least < clearance_m + MOST_STRETCH * radii[k]
                    && least < clearance_m + covering_radius(faces[k].map(|slot| at[slot as usize]));
            }
        });
        self.refit(at);
    }

    /// Moves the faces that were found near.
    pub(super) fn refit(&mut self, at: &[Vec3]) {
        let (faces, is_near) = (&self.faces, &self.is_near);
        self.tree.refit(|face| match is_near[face as usize] {
            true => Aabb::around(&faces[face as usize].map(|slot| at[slot as usize])),
            false => Aabb::EMPTY,
        });
    }

    /// The near face closest to each point of the packet, among those that count.
    pub(super) fn closest(&self, packet: &mut Packet, at: &[Vec3], counts: impl Fn(u32) -> bool) {
        self.instructions.run(
            #[inline(always)]
            || {
                self.tree.nearest_of_packet(
                    packet,
                    #[inline(always)]
                    |faces, packet| {
                        for &face in faces {
                            if self.is_near[face as usize] && counts(self.numbers[face as usize]) {
                                packet.meet(face, &self.triangle(face, at));
                            }
                        }
                    },
                );
            },
        );
    }
}

/// No point of a triangle is farther from its nearest corner, metres.
fn covering_radius([a, b, c]: [Vec3; 3]) -> f32 {
    /// Of the longest edge: that of an equilateral triangle.
    const SHARE: f32 = 0.577_350_3;
    let (ab, bc, ca) = (
        a.distance_squared(b),
        b.distance_squared(c),
        c.distance_squared(a),
    );
    SHARE * ab.max(bc).max(ca).sqrt()
}
