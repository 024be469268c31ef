//! The faces of a garment that the body may poke through.

use super::{
    neighbours::{Neighbours, Rows},
    packets::Summary,
};
use crate::{
    bvh::{Aabb, Bvh, LANES, Marks, Packet, Posed},
    intersection::ContactParts,
    mesh::TriMesh,
    network::{Instructions, Precision},
    surface::{Among, Triangle},
};
use glam::Vec3;

/// How deep under a body vertex the cloth that it pokes through is looked for, metres: the sagitta
/// L² / 8R of an edge of 10 cm over a shoulder of 5 cm radius.
const REACH_M: f32 = 0.025;

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
    /// By branch of the tree: the packets of its corners and of their places, and the largest of its radii.
    packets: Rows,
    largest_radii: Vec<f32>,
    /// By face: the marks of what may lift it.
    lifted_by: Vec<Marks>,
    clearance_m: f32,
    /// How far from a body vertex the cloth that it pokes through can be.
    reach_m: f32,
    is_near: Vec<bool>,
    instructions: Instructions,
}

impl Cloth {
    /// Of a garment's rest shape; nothing pokes through where `clearance_m` is left.
    pub(super) fn new(
        rest: &TriMesh,
        parts: &ContactParts,
        neighbours: &Neighbours,
        clearance_m: f32,
    ) -> Self {
        let rest_corners = |f: &[u32; 3]| f.map(|v| rest.vertices[v as usize]);
        let centres: Vec<Vec3> = (rest.faces.iter())
            .map(|f| rest_corners(f).iter().sum::<Vec3>() / 3.0)
            .collect();
        let mut tree = Bvh::build(&centres);
        let numbers = tree.take_order();
        let rest_faces = || numbers.iter().map(|&face| &rest.faces[face as usize]);
        let radii: Vec<f32> = rest_faces().map(|f| covering_radius(rest_corners(f))).collect();
        let largest = radii.iter().copied().fold(0.0, f32::max);
        let faces: Vec<_> = rest_faces()
            .map(|f| f.map(|v| parts.packets().slots()[v as usize]))
            .collect();
        let largest_of =
            |items: std::ops::Range<usize>| (radii[items].iter()).fold(0.0, |a, &b| f32::max(a, b));
        Self {
            packets: packets_of_branches(&tree, &faces, neighbours),
            lifted_by: numbers.iter().map(|&face| parts.marks_of_lifted(face)).collect(),
            largest_radii: tree.branches().map(largest_of).collect(),
            clearance_m,
            // Corners are outside, so that a face leads no deeper than its radius; the vertex is
            // beside that place by as much at most.
            reach_m: f32::min(2.0 * (clearance_m + largest), REACH_M),
            tree,
            faces,
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

    /// Faces with points farther than this from their corners, once they are stretched, metres.
    pub(super) fn wide(&self, radius_m: f32) -> Vec<u32> {
        let is_wide = |&face: &u32| MOST_STRETCH * self.radii[face as usize] > radius_m;
        (0..self.faces.len() as u32).filter(is_wide).collect()
    }

    /// Is a face near the body, and stretched by more than a factor between these corners?
    pub(super) fn is_stretched(&self, face: u32, factor: f32, corners: [Vec3; 3]) -> bool {
        self.is_near[face as usize] && covering_radius(corners) > factor * self.radii[face as usize]
    }

    /// Slots of the corners.
    #[inline(always)]
    pub(super) fn corners(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// The face in the garment's own order.
    pub(super) fn number(&self, face: u32) -> u32 {
        self.numbers[face as usize]
    }

    #[inline(always)]
    pub(super) fn triangle(&self, face: u32, at: impl Fn(u32) -> Vec3) -> Triangle {
        Triangle::new(corners(self.corners(face), at))
    }

    /// Takes positions and heights over the body by slot, metres, and the summaries of the packets.
    pub(super) fn find_near(
        &mut self,
        at: impl Fn(u32) -> Vec3 + Sync,
        heights: &[f32],
        summaries: &[Summary],
    ) {
        let (faces, radii, clearance_m) = (&self.faces, &self.radii, self.clearance_m);
        let is_face_near = |k: usize| {
            let [a, b, c] = faces[k];
            let height = |slot: u32| heights[slot as usize];
            let (a, b, c) = (height(a), height(b), height(c));
            let least = if b < a { b } else { a };
            let least = if c < least { c } else { least };
            // The bound for a stretched face first: it asks for no positions.
            least < clearance_m + MOST_STRETCH * radii[k]
                && least < clearance_m + covering_radius(corners(faces[k], &at))
        };
        let (packets, largest_radii) = (&self.packets, &self.largest_radii);
        let may_be_near = |branch: usize| {
            let farthest_m = clearance_m + MOST_STRETCH * largest_radii[branch];
            let heights = packets.row(branch).iter();
            heights
                .map(|&packet| summaries[packet as usize].least_m)
                .any(|least_m| least_m < farthest_m)
        };
        let find = |branch: usize, first: usize, is_near: &mut [bool]| {
            let may_be = may_be_near(branch);
            for (k, is_near) in (first..).zip(is_near.iter_mut()) {
                *is_near = may_be && is_face_near(k);
            }
            match is_near.contains(&true) {
                true => Posed::Moved,
                false => Posed::Nowhere,
            }
        };
        let box_of = |k: usize, is_near: &bool| box_of_face(*is_near, || corners(faces[k], &at));
        self.tree.refit_with(&mut self.is_near, find, box_of);
    }

    /// Moves the faces that were found near, by corners in packets that move.
    pub(super) fn refit(&mut self, at: impl Fn(u32) -> Vec3 + Sync, moves: impl Fn(u32) -> bool + Sync) {
        let (faces, packets) = (&self.faces, &self.packets);
        let find = |branch, _, is_near: &mut [bool]| {
            let may_move = packets.row(branch).iter().any(|&packet| moves(packet));
            match (is_near.contains(&true), may_move) {
                (true, true) => Posed::Moved,
                (true, false) => Posed::Same,
                (false, _) => Posed::Nowhere,
            }
        };
        let box_of = |k: usize, is_near: &bool| box_of_face(*is_near, || corners(faces[k], &at));
        self.tree.refit_with(&mut self.is_near, find, box_of);
    }

    /// The near face closest to each of a packet of points, among those that may be lifted and count; sooner
    /// when `seeds` are near it.
    pub(super) fn closest(
        &self,
        points: &[Vec3],
        seeds: &[u32],
        at: impl Fn(u32) -> Vec3,
        among: Among<impl Fn(u32) -> bool>,
    ) -> Packet {
        let mut packet = Packet::new(self.instructions, points, self.reach_m * self.reach_m);
        self.instructions.run(
            #[inline(always)]
            || {
                for (k, &seed) in seeds.iter().enumerate() {
                    if (seed as usize) < self.faces.len() && !seeds[..k].contains(&seed) {
                        self.meet(&mut packet, seed, &at, &among);
                    }
                }
                self.tree.nearest_of_packet(
                    &mut packet,
                    Marks::ANY,
                    #[inline(always)]
                    |faces, packet| {
                        for &face in faces {
                            self.meet(packet, face, &at, &among);
                        }
                    },
                );
            },
        );
        packet
    }

    #[inline(always)]
    fn meet(
        &self,
        packet: &mut Packet,
        face: u32,
        at: impl Fn(u32) -> Vec3,
        among: &Among<impl Fn(u32) -> bool>,
    ) {
        let k = face as usize;
        if self.is_near[k] && self.lifted_by[k].meet(among.marks) {
            packet.meet(face, &self.triangle(face, at), || (among.counts)(self.numbers[k]));
        }
    }
}

/// Spelled out: the compiler maps arrays of places out of line.
#[inline(always)]
fn corners([a, b, c]: [u32; 3], at: impl Fn(u32) -> Vec3) -> [Vec3; 3] {
    [at(a), at(b), at(c)]
}

/// A face that is not near is nowhere.
#[inline(always)]
fn box_of_face(is_near: bool, corners: impl FnOnce() -> [Vec3; 3]) -> Aabb {
    match is_near {
        true => Aabb::around(&corners()),
        false => Aabb::EMPTY,
    }
}

/// The packets of the corners of each branch of a tree over faces, and of their places.
fn packets_of_branches(tree: &Bvh, faces: &[[u32; 3]], neighbours: &Neighbours) -> Rows {
    let of_branch = |(branch, items): (usize, std::ops::Range<usize>)| {
        let slots = faces[items].iter().flatten();
        let slots = slots.flat_map(|&slot| [slot, neighbours.place(slot as usize) as u32]);
        slots.map(move |slot| [branch as u32, slot / LANES as u32])
    };
    let pairs = tree.branches().enumerate().flat_map(of_branch).collect();
    Rows::new(tree.branches().count(), pairs)
}

/// No point of a triangle is farther from its nearest corner, metres.
#[inline(always)]
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
