//! Body vertices that poke through garment faces.

use super::cloth::Cloth;
use crate::{
    aabb_tree::LANES,
    folds,
    intersection::{Contact, RobustBody, RobustIntersection},
    parallel::for_each_chunk,
    surface::FaceFilter,
    triangle::TrianglePoint,
};
use glam::Vec3;

/// Smallest magnitude of the cosine between a body vertex's normal and the direction to the cloth.
///
/// Below it the cloth is beside the vertex, such as beyond a hem.
const MIN_COSINE: f32 = 0.5;

/// Lift of a garment face over something that comes through it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceLift {
    /// Face, in the order of [`Cloth`].
    pub(super) face: u32,
    /// Displacement of each corner, metres.
    pub(super) corners: [Vec3; 3],
}

/// Displacement that a point of a face needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointPush {
    /// Barycentric coordinates of the point.
    pub(super) barycentric: Vec3,
    /// Displacement of the point, metres.
    pub(super) push: Vec3,
}

/// Result of the search of one body vertex for cloth that it pokes through.
#[derive(Clone, Copy, Debug)]
struct PokeThrough {
    /// Face of the cloth found last, in this frame or before: the seed of the next search.
    seed: u32,
    lift: Option<FaceLift>,
}

/// Poke-throughs of the body vertices that may lift cloth, by slot.
#[derive(Clone, Debug)]
pub(super) struct PokeThroughs(Vec<PokeThrough>);

/// Posed body and corrected cloth, for searches from one for the other.
#[derive(Clone, Copy)]
pub(super) struct LiftContext<'a> {
    pub(super) rule: RobustIntersection,
    pub(super) body: &'a RobustBody,
    /// Positions of the body's vertices, metres.
    pub(super) vertices: &'a [Vec3],
    pub(super) cloth: &'a Cloth,
    /// Corrected positions of the cloth by slot, metres.
    pub(super) corrected: &'a [Vec3],
    /// Contacts of the cloth by slot, from before the corrections.
    pub(super) contacts: &'a [Contact],
    /// Smallest height of cloth over a body vertex, metres.
    pub(super) min_height_m: f32,
}

impl FaceLift {
    /// Smallest displacements of the corners, in the sum of squares, that give a point its push.
    pub(super) fn new(face: u32, PointPush { barycentric, push }: PointPush) -> Self {
        let lift = push / barycentric.length_squared();
        Self {
            face,
            corners: barycentric.to_array().map(|weight| lift * weight),
        }
    }

    /// Returns the lift with displacements times a factor.
    pub(super) fn scaled(self, factor: f32) -> Self {
        Self {
            corners: self.corners.map(|corner| corner * factor),
            ..self
        }
    }

    /// Lift for the longest of the pushes of a face's points.
    pub(super) fn longest(face: u32, pushes: impl Iterator<Item = PointPush>) -> Option<Self> {
        let longest = pushes.max_by(|a, b| a.push.length_squared().total_cmp(&b.push.length_squared()));
        longest.map(|push| Self::new(face, push))
    }
}

impl PokeThroughs {
    /// Makes room for a number of slots.
    pub(super) fn new(slots: usize) -> Self {
        let seed = u32::MAX;
        Self(vec![PokeThrough { seed, lift: None }; slots])
    }

    /// Lifts that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = FaceLift> {
        self.0.iter().filter_map(|vertex| vertex.lift)
    }

    /// Searches from all body vertices.
    pub(super) fn find(&mut self, context: &LiftContext) {
        self.search(context, |_| true);
    }

    /// Searches again from the body vertices that poked through.
    pub(super) fn find_again(&mut self, context: &LiftContext) {
        self.search(context, |vertex| vertex.lift.is_some());
    }

    fn search(&mut self, context: &LiftContext, is_active: impl Fn(&PokeThrough) -> bool + Sync + Send) {
        for_each_chunk(&mut self.0, LANES, |first, found| {
            let lifting = context.body.contact_filter().lifting_vertices();
            let vertices = lifting.packet(first / LANES);
            let mut positions = [Vec3::NAN; LANES];
            for ((position, &vertex), found) in positions.iter_mut().zip(vertices).zip(&mut *found) {
                if is_active(found) {
                    // Cleared here, because a vertex whose position is NaN is not searched for.
                    found.lift = None;
                    *position = context.vertices[vertex as usize];
                }
            }
            if positions.iter().any(|p| p.is_finite()) {
                context.search_packet(vertices, &positions, found);
            }
        });
    }
}

impl LiftContext<'_> {
    /// Searches from body vertices that may lift the same faces.
    fn search_packet(&self, vertices: &[u32], positions: &[Vec3; LANES], found: &mut [PokeThrough]) {
        let (first, filter) = (vertices[0] as usize, self.body.contact_filter());
        let lifted = FaceFilter {
            groups: filter.groups_of_body_vertex(first),
            accepts: |face| filter.groups_are_exact() || filter.vertex_may_lift(first, face),
        };
        let seeds: [u32; LANES] = std::array::from_fn(|lane| found.get(lane).map_or(u32::MAX, |f| f.seed));
        let place = |slot: u32| self.corrected[slot as usize];
        let packet = self.cloth.closest(positions, &seeds, place, lifted);
        for (lane, (&vertex, found)) in vertices.iter().zip(found).enumerate() {
            if positions[lane].is_finite() {
                let face = Some(packet.item[lane]).filter(|&face| face != u32::MAX);
                found.lift = face.and_then(|face| self.lift_over_vertex(face, vertex as usize));
                found.seed = face.unwrap_or(found.seed);
            }
        }
    }

    /// Returns the lift of the face nearest to a body vertex over that vertex; none when it is high
    /// enough.
    fn lift_over_vertex(&self, face: u32, vertex: usize) -> Option<FaceLift> {
        let normal = self.body.surface().vertex_normal(vertex as u32);
        let triangle = self.cloth.triangle(face, |slot| self.corrected[slot as usize]);
        let hit: TrianglePoint = triangle.closest(self.vertices[vertex]);
        // Measured along the body's normal: the cloth's own winding may be either way.
        let height = hit.offset.dot(normal);
        let is_beside = height.abs() < MIN_COSINE * hit.squared_distance.sqrt();
        if height >= self.min_height_m || is_beside || self.is_folded(vertex, face) {
            return None;
        }
        let push = PointPush {
            barycentric: hit.barycentric,
            push: normal * (self.min_height_m - height),
        };
        Some(FaceLift::new(face, push))
    }

    /// Returns whether the body vertex lies in a fold between parts that may lift this face.
    fn is_folded(&self, vertex: usize, face: u32) -> bool {
        let filter = self.body.contact_filter();
        let garment_face = self.cloth.garment_face(face);
        let surface = self.body.surface();
        let welded = surface.welded_vertex(vertex as u32);
        folds::vertex_is_folded(surface, welded, |f| filter.face_may_lift(f, garment_face))
    }
}
