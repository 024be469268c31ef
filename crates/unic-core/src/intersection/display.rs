//! What needs all vertices at once, for positions on their way to the screen.

mod neighbours;

use super::{Contact, Handling, RobustBody, RobustIntersection};
use crate::{
    character::Garment,
    folds,
    mesh::vertex_normals,
    parallel::for_each_chunk,
    surface::{Surface, SurfacePoint},
};
use glam::Vec3;
use neighbours::Neighbours;

/// Share of the height that vertices are kept at, below which cloth over a body vertex counts as poked
/// through: a flat face on flat skin is left alone.
const FACE_HEIGHT_SHARE: f32 = 0.5;

/// How deep under a body vertex the cloth that it pokes through is looked for, metres: the sagitta
/// L² / 8R of an edge of 10 cm over a shoulder of 5 cm radius.
const REACH_M: f32 = 0.025;

/// Cosine between the way from a body vertex to the cloth and its normal, or the opposite, below which the
/// cloth is beside the vertex, as beyond a hem.
const LEAST_COSINE: f32 = 0.5;

/// Rounds of lifting: a face lifted over one vertex takes its corners over others.
const ROUNDS: usize = 2;

/// Sweeps of the smoothing: a correction is seen this many edges away.
const SWEEPS: usize = 4;

/// Share of its neighbours' mean that a vertex takes in a sweep.
const SPREAD: f32 = 0.7;

/// Items that one thread takes at a time.
const CHUNK: usize = 128;

/// Lifts garment faces that body vertices poke through, and spreads corrections over the garment,
/// so that a push makes neither dent nor spike.
///
/// Positions farther than [`REACH_EDGES`](Self::REACH_EDGES) edges from any correction keep their
/// bits. Scratch with its connectivity; nothing is allocated after the first frame, and the bytes are
/// the same for any number of threads.
#[derive(Clone, Debug)]
pub struct DisplayPass {
    neighbours: Neighbours,
    /// The garment, refitted to what has been lifted so far.
    cloth: Surface,
    /// By garment vertex.
    contacts: Vec<Contact>,
    body_normals: Vec<Vec3>,
    /// By body vertex.
    looks: Vec<Look>,
    /// Least that a place has to move by, metres; zero where it need not.
    corrections: Vec<Vec3>,
    /// The same, spread.
    spread: Vec<Vec3>,
    swept: Vec<Vec3>,
    lifted: Vec<Vec3>,
}

/// A posed body and its vertices.
#[derive(Clone, Copy, Debug)]
pub struct PosedVertices<'a> {
    /// For the garment's vertices.
    pub body: &'a RobustBody,
    /// What it was posed with, metres.
    pub vertices: &'a [Vec3],
}

/// What the last look at the cloth said about a body vertex.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// For the next look.
    seed: u32,
    poke: Option<Poke>,
}

impl Look {
    const FIRST: Self = Self {
        seed: Handling::no_seed(),
        poke: None,
    };
}

/// What lifts a garment face: a body vertex through it.
#[derive(Clone, Copy, Debug)]
struct Poke {
    face: u32,
    /// What each corner has to move by, metres.
    lifts: [Vec3; 3],
}

impl DisplayPass {
    /// Edges from a corrected vertex to the farthest one that moves with it.
    pub const REACH_EDGES: usize = SWEEPS;

    /// For a garment.
    pub fn new(garment: &Garment) -> Self {
        let count = garment.rest.vertices.len();
        Self {
            neighbours: Neighbours::new(&garment.rest.vertices, &garment.rest.faces),
            cloth: Surface::build(&garment.rest),
            body_normals: Vec::new(),
            looks: Vec::new(),
            contacts: vec![Contact::NONE; count],
            corrections: vec![Vec3::ZERO; count],
            spread: vec![Vec3::ZERO; count],
            swept: vec![Vec3::ZERO; count],
            lifted: vec![Vec3::ZERO; count],
        }
    }

    /// Moves world positions, metres, to where they are shown.
    pub fn apply(&mut self, rule: RobustIntersection, body: PosedVertices, positions: &mut [Vec3]) {
        self.correct(rule, body.body, positions);
        vertex_normals(body.vertices, body.body.surface().faces(), &mut self.body_normals);
        self.looks.resize(body.vertices.len(), Look::FIRST);
        for round in 0..ROUNDS {
            self.find_pokes(rule, body, positions, round);
            if self.looks.iter().all(|look| look.poke.is_none()) {
                break;
            }
            self.lift();
        }
        if self.corrections.iter().any(|c| *c != Vec3::ZERO) {
            self.spread();
            self.settle(rule, body.body, positions);
        }
    }

    /// The corrections of places from those of the vertices at them: the longest.
    fn correct(&mut self, rule: RobustIntersection, body: &RobustBody, positions: &[Vec3]) {
        for_each_chunk(&mut self.contacts, CHUNK, |first, contacts| {
            for (vertex, contact) in (first..).zip(contacts) {
                *contact = rule.look(body, vertex, positions[vertex], contact.face);
            }
        });
        self.corrections.fill(Vec3::ZERO);
        for (vertex, contact) in self.contacts.iter().enumerate() {
            let correction = contact
                .moved
                .map_or(Vec3::ZERO, |moved| moved - positions[vertex]);
            let place = self.neighbours.place(vertex);
            self.corrections[place] = longer(self.corrections[place], correction);
        }
    }

    /// Looks from every body vertex at the cloth, and again from those that poked through it.
    fn find_pokes(
        &mut self,
        rule: RobustIntersection,
        body: PosedVertices,
        positions: &[Vec3],
        round: usize,
    ) {
        for (vertex, lifted) in self.lifted.iter_mut().enumerate() {
            *lifted = positions[vertex] + self.corrections[self.neighbours.place(vertex)];
        }
        self.cloth.refit(&self.lifted);
        let view = BodyView {
            body: body.body,
            cloth: &self.cloth,
            least_height_m: FACE_HEIGHT_SHARE * rule.margin_m,
        };
        let normals = &self.body_normals;
        for_each_chunk(&mut self.looks, CHUNK, |first, looks| {
            for (vertex, look) in (first..).zip(looks) {
                let is_due = round == 0 || look.poke.is_some();
                if is_due && body.body.parts().vertex_lifts_any(vertex) {
                    view.look(look, vertex, body.vertices[vertex], normals[vertex]);
                }
            }
        });
    }

    /// Adds to each corner's correction the longest lift that a poke asks of it.
    fn lift(&mut self) {
        let lifts = &mut self.swept;
        lifts.fill(Vec3::ZERO);
        for poke in self.looks.iter().filter_map(|look| look.poke) {
            let corners = self.cloth.faces()[poke.face as usize];
            for (corner, lift) in corners.into_iter().zip(poke.lifts) {
                let place = self.neighbours.place(corner as usize);
                lifts[place] = longer(lifts[place], lift);
            }
        }
        let pairs = self.corrections.iter_mut().zip(lifts);
        pairs.for_each(|(correction, lift)| *correction += *lift);
    }

    /// Jacobi sweeps: what has a correction keeps it or moves on along it, what has none goes with
    /// its neighbours.
    fn spread(&mut self) {
        self.spread.copy_from_slice(&self.corrections);
        for _ in 0..SWEEPS {
            let (neighbours, corrections, before) = (&self.neighbours, &self.corrections, &self.spread);
            for_each_chunk(&mut self.swept, CHUNK, |first, swept| {
                for (place, swept) in (first..).zip(swept) {
                    let mean = neighbours.mean(place, before) * SPREAD;
                    *swept = carried_along(corrections[place], mean);
                }
            });
            std::mem::swap(&mut self.spread, &mut self.swept);
        }
    }

    /// Moves the positions. Those that went farther than the body asked for, or went with others,
    /// may have come to another part of it.
    fn settle(&self, rule: RobustIntersection, body: &RobustBody, positions: &mut [Vec3]) {
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (vertex, position) in (first..).zip(positions) {
                let change = self.spread[self.neighbours.place(vertex)];
                if change == Vec3::ZERO {
                    continue;
                }
                let contact = self.contacts[vertex];
                *position += change;
                // A height changes by no more than the way.
                if contact.height_m - change.length() < rule.margin_m {
                    let mut seed = contact.face;
                    *position = rule
                        .correct(body, vertex, *position, &mut seed)
                        .unwrap_or(*position);
                }
            }
        });
    }
}

/// The longer of two; the first where they are as long.
fn longer(a: Vec3, b: Vec3) -> Vec3 {
    if b.length_squared() > a.length_squared() {
        b
    } else {
        a
    }
}

/// A correction beside neighbours that move by `mean`: at least itself, along itself.
fn carried_along(correction: Vec3, mean: Vec3) -> Vec3 {
    let Some(direction) = correction.try_normalize() else {
        return mean;
    };
    let farther = mean.dot(direction) - correction.length();
    correction + direction * farther.max(0.0)
}

/// Posed body and cloth, for looking from one to the other.
struct BodyView<'a> {
    body: &'a RobustBody,
    cloth: &'a Surface,
    least_height_m: f32,
}

impl BodyView<'_> {
    fn look(&self, look: &mut Look, vertex: usize, position: Vec3, normal: Vec3) {
        let counts = |face| self.body.parts().vertex_lifts(vertex, face);
        let hit = self.cloth.closest_among(position, REACH_M, look.seed, counts);
        look.seed = hit.map_or(look.seed, |hit| hit.face);
        look.poke = hit.and_then(|hit| self.poke(&hit, vertex, position, normal));
    }

    /// How the cloth nearest to a body vertex has to be lifted to lie over it.
    fn poke(&self, hit: &SurfacePoint, vertex: usize, position: Vec3, normal: Vec3) -> Option<Poke> {
        let height = (hit.point - position).dot(normal);
        let is_beside = height.abs() < LEAST_COSINE * hit.distance;
        if height >= self.least_height_m || is_beside || self.is_folded(vertex, hit.face) {
            return None;
        }
        let weights = hit.barycentric;
        // The shortest move of the corners that brings the point on the face up.
        let lift = normal * ((self.least_height_m - height) / weights.length_squared());
        Some(Poke {
            face: hit.face,
            lifts: weights.to_array().map(|weight| lift * weight),
        })
    }

    /// Does the body vertex lie in a fold between parts that may push this face?
    fn is_folded(&self, vertex: usize, cloth_face: u32) -> bool {
        let [corner, ..] = self.cloth.faces()[cloth_face as usize];
        let counts = |face| self.body.parts().face_pushes(face, corner as usize);
        folds::vertex_is_folded(self.body.surface(), vertex as u32, counts)
    }
}
