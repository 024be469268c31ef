//! What needs all vertices at once, for positions on their way to the screen.

mod cloth;
mod cover;
mod layered;
mod movements;
mod neighbours;
mod packets;
mod pokes;
mod props;
mod spans;
mod spread;

use super::{Contact, Layers, RobustBody, RobustIntersection, packets::Packets, robust::LIMB_RADIUS_M};
use crate::{
    bvh::LANES,
    character::Garment,
    collider::Collider,
    parallel::{for_each, for_each_chunk},
};
use cover::{Cover, Seen};
use glam::Vec3;
use layered::Layered;
use movements::Movements;
use neighbours::Neighbours;
use packets::Summary;
use spread::{SWEEPS, Spread};

/// Vertices that one thread takes at a time.
const CHUNK: usize = 1024;

/// Lifts garment faces that the body comes through, and spreads corrections over the garment,
/// so that a push makes neither dent nor spike.
///
/// Positions farther than [`REACH_EDGES`](Self::REACH_EDGES) edges from any correction keep their
/// bits. Scratch with its connectivity; nothing is allocated after the first frame, and the bytes are
/// the same for any number of threads.
#[derive(Clone, Debug)]
pub struct DisplayPass {
    rule: RobustIntersection,
    neighbours: Neighbours,
    cover: Cover,
    layered: Option<Box<Layered>>,
    /// From here on by slot: positions as they came, metres.
    at: Vec<Vec3>,
    contacts: Vec<Contact>,
    /// Over the body once the contacts have moved, metres.
    heights: Vec<f32>,
    /// Least that a place has to move by.
    corrections: Movements,
    spread: Spread,
    /// By packet.
    summaries: Vec<Summary>,
    /// By slot, of the packets in which something moves: positions as they are shown, metres, and those of
    /// them that may be too low, NaN for others there. What other packets hold means nothing.
    shown: Vec<Vec3>,
    doubtful: Vec<Vec3>,
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
        let neighbours = Neighbours::new(&garment.rest, packets);
        Self {
            rule,
            cover: Cover::new(rule, garment, body, &neighbours),
            neighbours,
            layered: None,
            contacts: vec![Contact::NONE; packets.len()],
            heights: vec![f32::INFINITY; packets.len()],
            at: vec![Vec3::NAN; packets.len()],
            corrections: Movements::new(packets.len()),
            spread: Spread::new(packets.len()),
            summaries: vec![Summary::default(); packets.len() / LANES],
            doubtful: slots.clone(),
            shown: slots,
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
        (self.rule).look_at_all(body.body, &self.at, |_| true, &mut self.contacts);
        if !body.colliders.is_empty() {
            let (at, rule) = (&self.at, self.rule);
            for_each_chunk(&mut self.contacts, CHUNK, |first, contacts| {
                for (contact, &at) in contacts.iter_mut().zip(&at[first..]) {
                    let out = props::out_of_all(body.colliders, contact.moved.unwrap_or(at), rule.margin_m);
                    contact.moved = out.or(contact.moved);
                }
            });
        }
        self.summarise();
        self.corrections.clear();
        let corrected = (0..self.summaries.len()).filter(|&packet| self.summaries[packet].is_corrected);
        for slot in corrected.flat_map(|packet| packet * LANES..(packet + 1) * LANES) {
            if let Some(moved) = self.contacts[slot].moved {
                let place = self.neighbours.place(slot);
                self.corrections.lengthen(place, moved - self.at[slot]);
            }
        }
    }

    fn summarise(&mut self) {
        let (contacts, margin_m) = (&self.contacts, self.rule.margin_m);
        let groups = self.heights.chunks_mut(Packets::GROUP);
        let groups = groups.zip(self.summaries.chunks_mut(Packets::GROUP / LANES));
        for_each(groups.enumerate(), |(group, (heights, summaries))| {
            let contacts = contacts[group * Packets::GROUP..].chunks(LANES);
            let packets = heights.chunks_mut(LANES).zip(summaries).zip(contacts);
            for ((heights, summary), contacts) in packets {
                *summary = Summary::new(contacts, margin_m, heights);
            }
        });
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

    /// Lifts the faces that the body and props come through.
    pub fn cover(&mut self, body: PosedVertices) {
        let seen = Seen {
            neighbours: &self.neighbours,
            at: &self.at,
            contacts: &self.contacts,
            heights: &self.heights,
            summaries: &self.summaries,
        };
        self.cover.lift(body, seen, &mut self.corrections);
    }

    /// Spreads the corrections and moves the positions by them.
    pub fn smooth(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        if self.corrections.are_none() {
            return;
        }
        self.spread.sweep(&self.neighbours, &self.corrections);
        self.find_moving();
        self.move_along(body);
        self.look_again(body);
        let slots = body.body.parts().packets().slots();
        let (summaries, shown) = (&self.summaries, &self.shown);
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (position, &slot) in positions.iter_mut().zip(&slots[first..]) {
                if summaries[slot as usize / LANES].is_moving {
                    *position = shown[slot as usize];
                }
            }
        });
    }

    /// Brings layers to the outer side of those under them, the inner ones first.
    fn order(&mut self, body: PosedVertices, positions: &mut [Vec3]) {
        let layers = self.layered.as_ref().map_or(0, |layered| layered.len());
        let slots = body.body.parts().packets().slots();
        for layer in 0..layers {
            self.take(body.body, positions);
            self.corrections.clear();
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
                corrections.lengthen(neighbours.place(slots[vertex] as usize), *way);
            }
            self.smooth(body, positions);
        }
    }

    /// In which packets the spread moves something.
    fn find_moving(&mut self) {
        let (movements, neighbours) = (self.spread.movements(), &self.neighbours);
        for (packet, summary) in self.summaries.iter_mut().enumerate() {
            let around = neighbours.of_packet(packet);
            summary.is_moving = around.iter().any(|&packet| movements.moves(packet));
        }
    }

    /// Moves the positions. Those that went farther than the body asked for, or went with others,
    /// may have come to another part of it.
    fn move_along(&mut self, body: PosedVertices) {
        let (movements, neighbours, at) = (self.spread.movements(), &self.neighbours, &self.at);
        let (contacts, summaries, margin_m) = (&self.contacts, &self.summaries, self.rule.margin_m);
        let out = |p| props::out_of_all(body.colliders, p, margin_m);
        let groups = self.shown.chunks_mut(Packets::GROUP);
        let groups = groups.zip(self.doubtful.chunks_mut(Packets::GROUP)).enumerate();
        for_each(groups, |(group, (shown, doubtful))| {
            for (k, (shown, doubtful)) in shown.iter_mut().zip(doubtful).enumerate() {
                let slot = group * Packets::GROUP + k;
                if !summaries[slot / LANES].is_moving {
                    continue;
                }
                let way = movements.of(neighbours.place(slot));
                *shown = at[slot] + way;
                if way != Vec3::ZERO {
                    *shown = out(*shown).unwrap_or(*shown);
                }
                let way_m = shown.distance(at[slot]);
                // A distance changes by no more than the way, and its side where no other part is near.
                let least_m = way_m + margin_m.max(LIMB_RADIUS_M);
                let is_clear = way_m == 0.0 || contacts[slot].height_m >= least_m;
                *doubtful = if is_clear { Vec3::NAN } else { *shown };
            }
        });
    }

    /// Looks again from the positions that may be too low.
    fn look_again(&mut self, body: PosedVertices) {
        let is_moving = |packet: usize| self.summaries[packet].is_moving;
        if self.layered.is_some() {
            for (slot, contact) in self.contacts.iter_mut().enumerate() {
                if is_moving(slot / LANES) {
                    contact.height_m -= self.shown[slot].distance(self.at[slot]);
                }
            }
        }
        (self.rule).look_at_all(body.body, &self.doubtful, is_moving, &mut self.contacts);
        let (doubtful, contacts) = (&self.doubtful, &self.contacts);
        for_each_chunk(&mut self.shown, CHUNK, |first, shown| {
            let slots = (first..).zip(shown).filter(|(slot, _)| is_moving(slot / LANES));
            for (slot, shown) in slots {
                let moved = contacts[slot].moved.filter(|_| doubtful[slot].is_finite());
                *shown = moved.unwrap_or(*shown);
            }
        });
    }
}
