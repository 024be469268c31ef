//! What needs all vertices at once, for positions on their way to the screen.

mod cloth;
mod neighbours;
mod pokes;
mod spread;

use super::{Contact, RobustBody, RobustIntersection};
use crate::{character::Garment, mesh::vertex_normals, parallel::for_each_chunk};
use cloth::Cloth;
use glam::Vec3;
use neighbours::Neighbours;
use pokes::{Pokes, View};
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

/// A posed body and its vertices.
#[derive(Clone, Copy, Debug)]
pub struct PosedVertices<'a> {
    /// For the garment's vertices.
    pub body: &'a RobustBody,
    /// What it was posed with, metres.
    pub vertices: &'a [Vec3],
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

    /// Moves world positions, metres, to where they are shown.
    pub fn apply(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        self.look(body.body, positions);
        self.cover(body);
        self.smooth(body.body, positions);
    }

    /// The corrections that the vertices need, each for itself.
    pub fn look(&mut self, body: &RobustBody, positions: &[Vec3]) {
        let packets = body.parts().packets();
        for_each_chunk(&mut self.at, CHUNK, |first, at| {
            for (at, &vertex) in at.iter_mut().zip(&packets.vertices()[first..]) {
                *at = positions.get(vertex as usize).copied().unwrap_or(Vec3::NAN);
            }
        });
        self.rule.look_at_all(body, &self.at, &mut self.contacts);
        self.corrections.fill(Vec3::ZERO);
        for (slot, contact) in self.contacts.iter().enumerate() {
            if let Some(moved) = contact.moved {
                let place = self.neighbours.place(slot);
                self.corrections[place] = longer(self.corrections[place], moved - self.at[slot]);
            }
        }
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
            if self.pokes.iter().next().is_none() {
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
        for poke in self.pokes.iter() {
            for (slot, lift) in self.cloth.corners(poke.face).into_iter().zip(poke.lifts) {
                let place = self.neighbours.place(slot as usize);
                self.lifts[place] = longer(self.lifts[place], lift);
            }
        }
        let pairs = self.corrections.iter_mut().zip(&self.lifts);
        pairs.for_each(|(correction, lift)| *correction += *lift);
    }

    /// Spreads the corrections and moves the positions by them.
    pub fn smooth(&mut self, body: &RobustBody, positions: &mut [Vec3]) {
        if self.corrections.iter().all(|c| *c == Vec3::ZERO) {
            return;
        }
        self.spread.sweep(&self.neighbours, &self.corrections);
        self.settle(body);
        let (slots, shown) = (body.parts().packets().slots(), &self.corrected);
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (position, &slot) in positions.iter_mut().zip(&slots[first..]) {
                *position = shown[slot as usize];
            }
        });
    }

    /// Moves the positions. Those that went farther than the body asked for, or went with others,
    /// may have come to another part of it.
    fn settle(&mut self, body: &RobustBody) {
        let (movements, neighbours, contacts) = (self.spread.movements(), &self.neighbours, &self.contacts);
        let (at, margin_m) = (&self.at, self.rule.margin_m);
        for_each_chunk(&mut self.doubtful, CHUNK, |first, doubtful| {
            for (slot, doubtful) in (first..).zip(doubtful) {
                let way = movements[neighbours.place(slot)];
                // A distance changes by no more than the way, and its side where no other part is near.
                let least_m = margin_m.max(LIMB_RADIUS_M);
                let is_clear = way == Vec3::ZERO || contacts[slot].height_m - way.length() >= least_m;
                *doubtful = if is_clear { Vec3::NAN } else { at[slot] + way };
            }
        });
        self.rule.look_at_all(body, &self.doubtful, &mut self.contacts);
        let (doubtful, contacts) = (&self.doubtful, &self.contacts);
        for_each_chunk(&mut self.corrected, CHUNK, |first, corrected| {
            for (slot, corrected) in (first..).zip(corrected) {
                let moved = contacts[slot].moved.filter(|_| doubtful[slot].is_finite());
                *corrected = moved.unwrap_or(at[slot] + movements[neighbours.place(slot)]);
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
