//! Tree over the garment faces near the body, which the body may poke through.

use super::{
    neighbours::{CompressedRows, Neighbours},
    packet_summary::PacketSummary,
};
use crate::{
    aabb_tree::{AabbTree, BranchUpdate, GroupMask, LANES, Packet},
    bounds::Aabb,
    intersection::ContactFilter,
    mesh::TriMesh,
    simd::Instructions,
    surface::{FaceFilter, Triangle},
};
use glam::Vec3;

/// Largest distance from a body vertex to cloth that it pokes through, metres: the sagitta L² / 8R
/// of an edge of 10 cm over a shoulder of 5 cm radius.
const MAX_REACH_M: f32 = 0.025;

/// Largest stretch of a face, as a factor on its size at rest. Faces that are stretched farther may
/// be missed.
const MAX_STRETCH: f32 = 2.0;

/// Faces of a garment by slot, of which searches find those near the body.
///
/// The height of a corner is the radius of a ball without body. Where the balls at its corners
/// cover a face, nothing pokes through it.
#[derive(Clone, Debug)]
pub(super) struct Cloth {
    /// Tree over `faces`.
    tree: AabbTree,
    /// Slots of the corners of each face, in the order of the tree.
    faces: Vec<[u32; 3]>,
    /// Index in the garment of each face.
    garment_faces: Vec<u32>,
    /// Covering radius of each face at rest, metres: no point is farther from its nearest corner.
    radii: Vec<f32>,
    /// Packets of the corners in each branch of the tree, and of their welded slots.
    packets: CompressedRows,
    /// Largest covering radius of each branch, metres.
    max_radii: Vec<f32>,
    /// Collision groups of the parts that may lift each face.
    lifted_by: Vec<GroupMask>,
    /// Height at which nothing pokes through a face, metres.
    clearance_m: f32,
    /// Search radius from a body vertex for cloth that it pokes through, metres.
    reach_m: f32,
    is_near: Vec<bool>,
    instructions: Instructions,
}

impl Cloth {
    /// Builds the tree over a garment's rest shape. Nothing pokes through a face at a height of
    /// `clearance_m`.
    pub(super) fn new(
        rest: &TriMesh,
        filter: &ContactFilter,
        neighbours: &Neighbours,
        clearance_m: f32,
    ) -> Self {
        let rest_corners = |f: &[u32; 3]| f.map(|v| rest.vertices[v as usize]);
        let centres: Vec<Vec3> = (rest.faces.iter())
            .map(|f| rest_corners(f).iter().sum::<Vec3>() / 3.0)
            .collect();
        let mut tree = AabbTree::build(&centres);
        let garment_faces = tree.renumber_in_tree_order();
        let rest_faces = || garment_faces.iter().map(|&face| &rest.faces[face as usize]);
        let radii: Vec<f32> = rest_faces().map(|f| covering_radius(rest_corners(f))).collect();
        let largest = radii.iter().copied().fold(0.0, f32::max);
        let faces: Vec<_> = rest_faces()
            .map(|f| f.map(|v| filter.garment_packets().slots()[v as usize]))
            .collect();
        let max_radius =
            |items: std::ops::Range<usize>| (radii[items].iter()).fold(0.0, |a, &b| f32::max(a, b));
        let lifted_by = garment_faces.iter().map(|&face| filter.groups_lifting_face(face));
        Self {
            packets: packets_of_branches(&tree, &faces, neighbours),
            lifted_by: lifted_by.collect(),
            max_radii: tree.branches().map(max_radius).collect(),
            clearance_m,
            // Corners are outside the body, so a face is inside it by its radius at most. The body
            // vertex is beside the deepest point of the face by as much at most.
            reach_m: f32::min(2.0 * (clearance_m + largest), MAX_REACH_M),
            tree,
            faces,
            radii,
            is_near: vec![false; garment_faces.len()],
            garment_faces,
            instructions: Instructions::best(),
        }
    }

    /// Slots of the corners of each face.
    pub(super) fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Faces with points farther than `radius_m` from their corners when fully stretched, metres.
    pub(super) fn wide_faces(&self, radius_m: f32) -> Vec<u32> {
        let is_wide = |&face: &u32| MAX_STRETCH * self.radii[face as usize] > radius_m;
        (0..self.faces.len() as u32).filter(is_wide).collect()
    }

    /// Returns whether a face with these corners is near the body and stretched by more than a
    /// factor.
    pub(super) fn is_stretched(&self, face: u32, factor: f32, corners: [Vec3; 3]) -> bool {
        self.is_near[face as usize] && covering_radius(corners) > factor * self.radii[face as usize]
    }

    /// Stretch of a face with these corners, as a factor on its size at rest.
    pub(super) fn stretch(&self, face: u32, corners: [Vec3; 3]) -> f32 {
        covering_radius(corners) / self.radii[face as usize]
    }

    /// Slots of the corners of a face.
    #[inline(always)]
    pub(super) fn corners(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// Index of a face in the garment.
    pub(super) fn garment_face(&self, face: u32) -> u32 {
        self.garment_faces[face as usize]
    }

    /// Triangle of a face with its corners at the positions of their slots.
    #[inline(always)]
    pub(super) fn triangle(&self, face: u32, at: impl Fn(u32) -> Vec3) -> Triangle {
        Triangle::new(corners(self.corners(face), at))
    }

    /// Selects the faces near the body and refits the tree to them.
    ///
    /// Positions and heights over the body are by slot, metres; summaries are by packet.
    pub(super) fn select_near_faces(
        &mut self,
        at: impl Fn(u32) -> Vec3 + Sync,
        heights: &[f32],
        summaries: &[PacketSummary],
    ) {
        let (faces, radii, clearance_m) = (&self.faces, &self.radii, self.clearance_m);
        let is_face_near = |k: usize| {
            let [a, b, c] = faces[k];
            let height = |slot: u32| heights[slot as usize];
            let (a, b, c) = (height(a), height(b), height(c));
            let lowest = if b < a { b } else { a };
            let lowest = if c < lowest { c } else { lowest };
            // The bound for a fully stretched face comes first: it needs no positions.
            lowest < clearance_m + MAX_STRETCH * radii[k]
                && lowest < clearance_m + covering_radius(corners(faces[k], &at))
        };
        let (packets, max_radii) = (&self.packets, &self.max_radii);
        let may_be_near = |branch: usize| {
            let farthest_m = clearance_m + MAX_STRETCH * max_radii[branch];
            let heights = packets.row(branch).iter();
            heights
                .map(|&packet| summaries[packet as usize].min_height_m)
                .any(|min_height_m| min_height_m < farthest_m)
        };
        let select = |branch: usize, first: usize, is_near: &mut [bool]| {
            let may_be = may_be_near(branch);
            for (k, is_near) in (first..).zip(is_near.iter_mut()) {
                *is_near = may_be && is_face_near(k);
            }
            match is_near.contains(&true) {
                true => BranchUpdate::Moved,
                false => BranchUpdate::Excluded,
            }
        };
        let box_of = |k: usize, is_near: &bool| box_of_face(*is_near, || corners(faces[k], &at));
        self.tree.refit_branches(&mut self.is_near, select, box_of);
    }

    /// Refits the tree to the near faces where packets of their corners move.
    pub(super) fn refit(&mut self, at: impl Fn(u32) -> Vec3 + Sync, moves: impl Fn(u32) -> bool + Sync) {
        let (faces, packets) = (&self.faces, &self.packets);
        let update = |branch, _, is_near: &mut [bool]| {
            let may_move = packets.row(branch).iter().any(|&packet| moves(packet));
            match (is_near.contains(&true), may_move) {
                (true, true) => BranchUpdate::Moved,
                (true, false) => BranchUpdate::Unchanged,
                (false, _) => BranchUpdate::Excluded,
            }
        };
        let box_of = |k: usize, is_near: &bool| box_of_face(*is_near, || corners(faces[k], &at));
        self.tree.refit_branches(&mut self.is_near, update, box_of);
    }

    /// Finds the near face closest to each of a packet of points, among those that the filter
    /// accepts.
    ///
    /// The filter's groups are those of the lifting parts. `seeds`, a face near the answer of each
    /// point, shorten the search; [`u32::MAX`] is none.
    pub(super) fn closest(
        &self,
        points: &[Vec3],
        seeds: &[u32],
        at: impl Fn(u32) -> Vec3,
        filter: FaceFilter<impl Fn(u32) -> bool>,
    ) -> Packet {
        let mut packet = Packet::new(self.instructions, points, self.reach_m * self.reach_m);
        self.instructions.run(
            #[inline(always)]
            || {
                for (lane, &seed) in seeds.iter().enumerate() {
                    if (seed as usize) < self.faces.len() && self.may_be_found(seed, &filter) {
                        packet.test_triangle_in(lane, seed, &self.triangle(seed, &at));
                    }
                }
                self.tree.visit_nearest_of_packet(
                    &mut packet,
                    GroupMask::ALL,
                    #[inline(always)]
                    |faces, packet| {
                        for &face in faces {
                            self.test_face(packet, face, &at, &filter);
                        }
                    },
                );
            },
        );
        packet
    }

    /// Returns whether a face is near and the filter accepts it.
    #[inline(always)]
    fn may_be_found(&self, face: u32, filter: &FaceFilter<impl Fn(u32) -> bool>) -> bool {
        let k = face as usize;
        self.is_near[k]
            && self.lifted_by[k].intersects(filter.groups)
            && (filter.accepts)(self.garment_faces[k])
    }

    #[inline(always)]
    fn test_face(
        &self,
        packet: &mut Packet,
        face: u32,
        at: impl Fn(u32) -> Vec3,
        filter: &FaceFilter<impl Fn(u32) -> bool>,
    ) {
        let k = face as usize;
        if self.is_near[k] && self.lifted_by[k].intersects(filter.groups) {
            let accepts = || (filter.accepts)(self.garment_faces[k]);
            packet.test_triangle(face, &self.triangle(face, at), accepts);
        }
    }
}

/// Positions of three slots.
// Written out: the compiler does not inline `map` over an array of positions.
#[inline(always)]
fn corners([a, b, c]: [u32; 3], at: impl Fn(u32) -> Vec3) -> [Vec3; 3] {
    [at(a), at(b), at(c)]
}

/// Box of a face; the empty box keeps searches from a face that is not near.
#[inline(always)]
fn box_of_face(is_near: bool, corners: impl FnOnce() -> [Vec3; 3]) -> Aabb {
    match is_near {
        true => Aabb::around(&corners()),
        false => Aabb::EMPTY,
    }
}

/// Finds the packets of the corners in each branch of a tree over faces, and of their welded slots.
fn packets_of_branches(tree: &AabbTree, faces: &[[u32; 3]], neighbours: &Neighbours) -> CompressedRows {
    let of_branch = |(branch, items): (usize, std::ops::Range<usize>)| {
        let slots = faces[items].iter().flatten();
        let slots = slots.flat_map(|&slot| [slot, neighbours.welded_slot(slot as usize) as u32]);
        slots.map(move |slot| [branch as u32, slot / LANES as u32])
    };
    let pairs = tree.branches().enumerate().flat_map(of_branch).collect();
    CompressedRows::new(tree.branches().count(), pairs)
}

/// Upper bound for the distance of a triangle's points from their nearest corner, metres.
#[inline(always)]
fn covering_radius([a, b, c]: [Vec3; 3]) -> f32 {
    // The circumradius of an equilateral triangle, 1/√3 of its edges, which is the largest for a
    // given longest edge.
    const FRACTION_OF_LONGEST_EDGE: f32 = 0.577_350_3;
    let (ab, bc, ca) = (
        a.distance_squared(b),
        b.distance_squared(c),
        c.distance_squared(a),
    );
    FRACTION_OF_LONGEST_EDGE * ab.max(bc).max(ca).sqrt()
}
