//! Body vertices that poke through garment faces.

use super::cloth::Cloth;
use crate::{
    bvh::LANES,
    folds,
    intersection::{Contact, RobustBody, RobustIntersection},
    parallel::for_each_chunk,
    surface::Among,
    triangle::TrianglePoint,
};
use glam::Vec3;

/// Cosine between the way from a body vertex to the cloth and its normal, or the opposite, below which the
/// cloth is beside the vertex, as beyond a hem.
const LEAST_COSINE: f32 = 0.5;

/// What lifts a garment face: something that comes through it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Poke {
    /// Of the cloth.
    pub(super) face: u32,
    /// What each corner has to move by, metres.
    pub(super) lifts: [Vec3; 3],
}

/// What a body vertex that may lift cloth sees of it.
#[derive(Clone, Copy, Debug)]
struct Sight {
    /// The face of the cloth found last, in this frame or before: near the next one.
    seed: u32,
    poke: Option<Poke>,
}

/// What the body vertices that may lift cloth see of it, by slot.
#[derive(Clone, Debug)]
pub(super) struct Pokes(Vec<Sight>);

/// Posed body and cloth, for looking from one to the other.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) rule: RobustIntersection,
    pub(super) body: &'a RobustBody,
    /// Of the body's vertices, metres.
    pub(super) vertices: &'a [Vec3],
    pub(super) cloth: &'a Cloth,
    /// By slot, metres.
    pub(super) corrected: &'a [Vec3],
    /// By slot, from before the corrections.
    pub(super) contacts: &'a [Contact],
    /// That cloth keeps over a body vertex.
    pub(super) least_height_m: f32,
}

impl Poke {
    /// The shortest move of the corners that moves the point of these weights along a way.
    pub(super) fn new(face: u32, weights: Vec3, way: Vec3) -> Self {
        let lift = way / weights.length_squared();
        Self {
            face,
            lifts: weights.to_array().map(|weight| lift * weight),
        }
    }

    /// The same for the longest of the ways that points of these weights have to go.
    pub(super) fn longest(face: u32, ways: impl Iterator<Item = (Vec3, Vec3)>) -> Option<Self> {
        let longest = ways.max_by(|(_, a), (_, b)| a.length_squared().total_cmp(&b.length_squared()));
        longest.map(|(weights, way)| Self::new(face, weights, way))
    }
}

impl Pokes {
    /// From so many slots.
    pub(super) fn new(slots: usize) -> Self {
        let seed = u32::MAX;
        Self(vec![Sight { seed, poke: None }; slots])
    }

    /// Those that were found.
    pub(super) fn iter(&self) -> impl Iterator<Item = Poke> {
        self.0.iter().filter_map(|sight| sight.poke)
    }

    /// Looks from all body vertices.
    pub(super) fn find(&mut self, view: &View) {
        self.look(view, |_| true);
    }

    /// Looks again from those that poked through.
    pub(super) fn find_again(&mut self, view: &View) {
        self.look(view, |sight| sight.poke.is_some());
    }

    fn look(&mut self, view: &View, is_due: impl Fn(&Sight) -> bool + Sync + Send) {
        for_each_chunk(&mut self.0, LANES, |first, sights| {
            let vertices = view.body.parts().lifting().packet(first / LANES);
            let mut positions = [Vec3::NAN; LANES];
            for ((position, &vertex), sight) in positions.iter_mut().zip(vertices).zip(&mut *sights) {
                if is_due(sight) {
                    // A vertex that is nowhere pokes through nothing.
                    sight.poke = None;
                    *position = view.vertices[vertex as usize];
                }
            }
            if positions.iter().any(|p| p.is_finite()) {
                view.look(vertices, &positions, sights);
            }
        });
    }
}

impl View<'_> {
    /// From body vertices that may lift the same faces.
    fn look(&self, vertices: &[u32], positions: &[Vec3; LANES], sights: &mut [Sight]) {
        let (one, parts) = (vertices[0] as usize, self.body.parts());
        let lifted = Among {
            marks: parts.marks_of_lifting(one),
            counts: |face| parts.marks_tell_all() || parts.vertex_lifts(one, face),
        };
        let seeds: [u32; LANES] = std::array::from_fn(|lane| sights.get(lane).map_or(u32::MAX, |s| s.seed));
        let place = |slot: u32| self.corrected[slot as usize];
        let packet = self.cloth.closest(positions, &seeds, place, lifted);
        for (lane, (&vertex, sight)) in vertices.iter().zip(sights).enumerate() {
            if positions[lane].is_finite() {
                let face = Some(packet.item[lane]).filter(|&face| face != u32::MAX);
                sight.poke = face.and_then(|face| self.poke(face, vertex as usize));
                sight.seed = face.unwrap_or(sight.seed);
            }
        }
    }

    /// How the cloth nearest to a body vertex has to be lifted to lie over it.
    fn poke(&self, face: u32, vertex: usize) -> Option<Poke> {
        let normal = self.body.surface().vertex_normal(vertex as u32);
        let triangle = self.cloth.triangle(face, |slot| self.corrected[slot as usize]);
        let hit: TrianglePoint = triangle.closest(self.vertices[vertex]);
        let height = hit.offset.dot(normal);
        let is_beside = height.abs() < LEAST_COSINE * hit.squared_distance.sqrt();
        if height >= self.least_height_m || is_beside || self.is_folded(vertex, face) {
            return None;
        }
        let way = normal * (self.least_height_m - height);
        Some(Poke::new(face, hit.barycentric, way))
    }

    /// Does the body vertex lie in a fold between parts that may lift this face?
    fn is_folded(&self, vertex: usize, face: u32) -> bool {
        let parts = self.body.parts();
        let number = self.cloth.number(face);
        let surface = self.body.surface();
        let place = surface.first_at(vertex as u32);
        folds::vertex_is_folded(surface, place, |f| parts.face_lifts(f, number))
    }
}
