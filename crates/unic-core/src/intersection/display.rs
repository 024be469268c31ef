//! What needs all vertices at once, for positions on their way to the screen.

mod cloth;
mod layered;
mod neighbours;
mod pokes;
mod props;
mod spread;

use super::{Contact, Layers, RobustBody, RobustIntersection};
use crate::{character::Garment, collider::Collider, mesh::vertex_normals, parallel::for_each_chunk};
use cloth::Cloth;
use glam::Vec3;
use layered::Layered;
use neighbours::Neighbours;
use pokes::{Pokes, View};
use props::Props;
use spread::{SWEEPS, Spread};

/// Share of the height that vertices are kept at, below which cloth over a body vertex counts as poked
/// through: a flat face on flat skin is left alone.
const FACE_HEIGHT_SHARE: f32 = 0.5;

/// Rounds of lifting: a face lifted over one vertex takes its corners over others.
const ROUNDS: usize = 2;

/// What is inside a limb is at most this far from its skin, metres.
const LIMB_RADIUS_M: f32 = 0.05;

/// Vertices that one thread takes at a time.
const CHUNK: usize = 1024;

/// Lifts garment faces that body vertices poke through, and spreads corrections over the garment,
/// so that a push makes neither dent nor spike.
///
/// Positions farther than [`REACH_EDGES`](Self::REACH_EDGES) edges from any correction keep their
/// bits. Scratch with its connectivity; nothing is allocated after the first frame, and the bytes are
/// the same for any number of threads.
#[derive(Clone, Debug)]
pub struct DisplayPass {
    rule: RobustIntersection,
    neighbours: Neighbours,
    cloth: Cloth,
    pokes: Pokes,
    props: Props,
    layered: Option<Box<Layered>>,
    body_normals: Vec<Vec3>,
    /// From here on by slot: positions as they came, metres.
    at: Vec<Vec3>,
    contacts: Vec<Contact>,
    /// Least that a place has to move by, metres; zero where it need not.
    corrections: Vec<Vec3>,
    lifts: Vec<Vec3>,
    /// Moved positions that may be too low; NaN for others.
    doubtful: Vec<Vec3>,
    /// Positions with their corrections, metres.
    corrected: Vec<Vec3>,
    spread: Spread,
}

/// A posed body with its vertices, and what else a garment stays out of.
#[derive(Clone, Copy, Debug)]
pub struct PosedVertices<'a> {
    /// For the garment's vertices.
    pub body: &'a RobustBody,
    /// What it was posed with, metres.
    pub vertices: &'a [Vec3],
    /// Ground and props in the same frame.
    pub colliders: &'a [Collider],
}

impl DisplayPass {
    /// Edges from a corrected vertex to the farthest one that moves with it.
    pub const REACH_EDGES: usize = SWEEPS;

    /// For a garment by a rule, over a body made for the garment.
    pub fn new(rule: RobustIntersection, garment: &Garment, body: &RobustBody) -> Self {
        let packets = body.parts().packets();
        let slots = vec![Vec3::ZERO; packets.len()];
        Self {
            rule,
            neighbours: Neighbours::new(&garment.rest, packets),
            cloth: Cloth::new(&garment.rest, packets, rule.margin_m * FACE_HEIGHT_SHARE),
            pokes: Pokes::default(),
            props: Props::default(),
            layered: None,
            body_normals: Vec::new(),
            contacts: vec![Contact::NONE; packets.len()],
            at: vec![Vec3::NAN; packets.len()],
            corrections: slots.clone(),
            lifts: slots.clone(),
            doubtful: slots.clone(),
            corrected: slots,
            spread: Spread::new(packets.len()),
        }
    }

    /// Keeps layers of the garment in order from now on.
    pub fn set_layers(&mut self, layers: &Layers) {
        self.layered = Some(Box::new(Layered::new(layers)));
    }

    /// Moves world positions, metres, to where they are shown.
    pub fn apply(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        self.look(body, positions);
        self.cover(body);
        self.smooth(body, positions);
        self.order(body, positions);
    }

    /// The corrections that the vertices need, each for itself.
    pub fn look(&mut self, body: PosedVertices, positions: &[Vec3]) {
        self.take(body.body, positions);
        self.rule.look_at_all(body.body, &self.at, &mut self.contacts);
        if !body.colliders.is_empty() {
            let (at, rule) = (&self.at, self.rule);
            for_each_chunk(&mut self.contacts, CHUNK, |first, contacts| {
                for (contact, &at) in contacts.iter_mut().zip(&at[first..]) {
                    let out = props::out_of_all(body.colliders, contact.moved.unwrap_or(at), rule.margin_m);
                    contact.moved = out.or(contact.moved);
                }
            });
        }
        self.corrections.fill(Vec3::ZERO);
        for (slot, contact) in self.contacts.iter().enumerate() {
            if let Some(moved) = contact.moved {
                let place = self.neighbours.place(slot);
                self.corrections[place] = longer(self.corrections[place], moved - self.at[slot]);
            }
        }
    }

    /// Positions by slot.
    fn take(&mut self, body: &RobustBody, positions: &[Vec3]) {
        let packets = body.parts().packets();
        for_each_chunk(&mut self.at, CHUNK, |first, at| {
            for (at, &vertex) in at.iter_mut().zip(&packets.vertices()[first..]) {
                *at = positions.get(vertex as usize).copied().unwrap_or(Vec3::NAN);
            }
        });
    }

    /// Lifts the faces that body vertices poke through.
    pub fn cover(&mut self, body: PosedVertices) {
        vertex_normals(body.vertices, body.body.surface().faces(), &mut self.body_normals);
        for round in 0..ROUNDS {
            self.correct();
            let (contacts, margin_m) = (&self.contacts, self.rule.margin_m);
            let height = |slot: u32| match &contacts[slot as usize] {
                Contact { moved: Some(_), .. } => margin_m,
                contact => contact.height_m,
            };
            match round {
                0 => self.cloth.find_near(&self.corrected, height),
                _ => self.cloth.refit(&self.corrected),
            }
            let view = View {
                body: body.body,
                vertices: body.vertices,
                normals: &self.body_normals,
                cloth: &self.cloth,
                at: &self.corrected,
                least_height_m: FACE_HEIGHT_SHARE * margin_m,
            };
            match round {
                0 => self.pokes.find(&view),
                _ => self.pokes.find_again(&view),
            }
            self.props.find(
                body.colliders,
                self.cloth.faces(),
                &self.corrected,
                margin_m * FACE_HEIGHT_SHARE,
            );
            if self.pokes.iter().chain(self.props.iter()).next().is_none() {
                break;
            }
            self.lift();
        }
    }

    fn correct(&mut self) {
        let (at, neighbours, corrections) = (&self.at, &self.neighbours, &self.corrections);
        for_each_chunk(&mut self.corrected, CHUNK, |first, corrected| {
            for (slot, corrected) in (first..).zip(corrected) {
                *corrected = at[slot] + corrections[neighbours.place(slot)];
            }
        });
    }

    /// Adds to each corner's correction the longest lift that a poke asks of it.
    fn lift(&mut self) {
        self.lifts.fill(Vec3::ZERO);
        for poke in self.pokes.iter().chain(self.props.iter()) {
            for (slot, lift) in self.cloth.corners(poke.face).into_iter().zip(poke.lifts) {
                let place = self.neighbours.place(slot as usize);
                self.lifts[place] = longer(self.lifts[place], lift);
            }
        }
        let pairs = self.corrections.iter_mut().zip(&self.lifts);
        pairs.for_each(|(correction, lift)| *correction += *lift);
    }

    /// Spreads the corrections and moves the positions by them.
    pub fn smooth(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        if self.corrections.iter().all(|c| *c == Vec3::ZERO) {
            return;
        }
        self.spread.sweep(&self.neighbours, &self.corrections);
        self.settle(body);
        let (slots, shown) = (body.body.parts().packets().slots(), &self.corrected);
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (position, &slot) in positions.iter_mut().zip(&slots[first..]) {
                *position = shown[slot as usize];
            }
        });
    }

    /// Brings layers to the outer side of those under them, the inner ones first.
    fn order(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        let layers = self.layered.as_ref().map_or(0, |layered| layered.len());
        let slots = body.body.parts().packets().slots();
        for layer in 0..layers {
            self.take(body.body, positions);
            self.corrections.fill(Vec3::ZERO);
            let Self {
                layered,
                corrections,
                neighbours,
                rule,
                ..
            } = self;
            let ways = layered
                .iter_mut()
                .flat_map(|layered| layered.ways(layer, positions, rule.margin_m));
            for (vertex, way) in ways {
                let place = neighbours.place(slots[vertex] as usize);
                corrections[place] = longer(corrections[place], *way);
            }
            self.smooth(body, positions);
        }
    }

    /// Moves the positions. Those that went farther than the body asked for, or went with others,
    /// may have come to another part of it.
    fn settle(&mut self, body: PosedVertices) {
        let (movements, neighbours, contacts) =
            (self.spread.movements(), &self.neighbours, &mut self.contacts);
        let (at, margin_m) = (&self.at, self.rule.margin_m);
        for_each_chunk(&mut self.corrected, CHUNK, |first, corrected| {
            for (slot, corrected) in (first..).zip(corrected) {
                let way = movements[neighbours.place(slot)];
                let moved = at[slot] + way;
                *corrected = match way == Vec3::ZERO {
                    true => moved,
                    false => props::out_of_all(body.colliders, moved, margin_m).unwrap_or(moved),
                };
            }
        });
        let (corrected, heights) = (&self.corrected, &*contacts);
        for_each_chunk(&mut self.doubtful, CHUNK, |first, doubtful| {
            for (slot, doubtful) in (first..).zip(doubtful) {
                let way_m = corrected[slot].distance(at[slot]);
                // A distance changes by no more than the way, and its side where no other part is near.
                let least_m = way_m + margin_m.max(LIMB_RADIUS_M);
                let is_clear = way_m == 0.0 || heights[slot].height_m >= least_m;
                *doubtful = if is_clear { Vec3::NAN } else { corrected[slot] };
            }
        });
        if self.layered.is_some() {
            let ways = corrected
                .iter()
                .zip(at)
                .map(|(corrected, at)| corrected.distance(*at));
            let heights = contacts.iter_mut().map(|contact| &mut contact.height_m);
            heights.zip(ways).for_each(|(height_m, way_m)| *height_m -= way_m);
        }
        self.rule.look_at_all(body.body, &self.doubtful, contacts);
        let (doubtful, contacts) = (&self.doubtful, &self.contacts);
        for_each_chunk(&mut self.corrected, CHUNK, |first, corrected| {
            for (slot, corrected) in (first..).zip(corrected) {
                let moved = contacts[slot].moved.filter(|_| doubtful[slot].is_finite());
                *corrected = moved.unwrap_or(*corrected);
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
