//! Faces that the body or props come through are lifted over them.

use super::{
    Contact, PosedVertices, RobustBody, RobustIntersection,
    cloth::Cloth,
    movements::Movements,
    neighbours::Neighbours,
    packets::Summary,
    pokes::{Pokes, View},
    props::Props,
    spans::Spans,
};
use crate::{bvh::LANES, character::Garment, parallel::for_each_chunk};
use glam::Vec3;

/// Share of the height that vertices are kept at, below which cloth over a body vertex counts as poked
/// through: a flat face on flat skin is left alone.
const FACE_HEIGHT_SHARE: f32 = 0.5;

/// Rounds of lifting: a face lifted over one vertex takes its corners over others.
const ROUNDS: usize = 2;

/// What comes through faces, and what it lifts them by.
#[derive(Clone, Debug)]
pub(super) struct Cover {
    rule: RobustIntersection,
    cloth: Cloth,
    pokes: Pokes,
    props: Props,
    spans: Spans,
    lifts: Movements,
    /// By slot: positions with their corrections, metres.
    corrected: Vec<Vec3>,
}

/// What is known of the garment's vertices before its faces are looked at, by slot.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) neighbours: &'a Neighbours,
    /// Positions as they came, metres.
    pub(super) at: &'a [Vec3],
    pub(super) contacts: &'a [Contact],
    /// Over the body once the contacts have moved, metres.
    pub(super) heights: &'a [f32],
    /// By packet.
    pub(super) summaries: &'a [Summary],
}

impl Cover {
    pub(super) fn new(
        rule: RobustIntersection,
        garment: &Garment,
        body: &RobustBody,
        neighbours: &Neighbours,
    ) -> Self {
        let parts = body.parts();
        let slots = parts.packets().len();
        let cloth = Cloth::new(&garment.rest, parts, neighbours, Self::least_height_m(rule));
        Self {
            rule,
            spans: Spans::new(&cloth),
            cloth,
            pokes: Pokes::new(parts.lifting().len()),
            props: Props::default(),
            lifts: Movements::new(slots),
            corrected: vec![Vec3::ZERO; slots],
        }
    }

    /// That cloth keeps over a body vertex.
    fn least_height_m(rule: RobustIntersection) -> f32 {
        FACE_HEIGHT_SHARE * rule.margin_m
    }

    /// Lengthens the corrections until faces lie over what comes through them.
    pub(super) fn lift(&mut self, body: PosedVertices, seen: Seen, corrections: &mut Movements) {
        for round in 0..ROUNDS {
            self.correct(round, seen, corrections);
            self.find(round, body, seen);
            if !self.lift_corners(seen.neighbours) {
                break;
            }
            corrections.add(&self.lifts);
        }
    }

    /// Brings the corrected positions up to date: all in the first round, then where something was lifted.
    fn correct(&mut self, round: usize, seen: Seen, corrections: &Movements) {
        let changed = match round {
            0 => corrections,
            _ => &self.lifts,
        };
        for_each_chunk(&mut self.corrected, LANES, |first, corrected| {
            let around = seen.neighbours.of_packet(first / LANES);
            let at = &seen.at[first..][..LANES];
            if around.iter().any(|&packet| changed.moves(packet)) {
                for ((corrected, at), slot) in corrected.iter_mut().zip(at).zip(first..) {
                    *corrected = *at + corrections.of(seen.neighbours.place(slot));
                }
            } else if round == 0 {
                corrected.copy_from_slice(at);
            }
        });
    }

    /// Looks for all that comes through.
    fn find(&mut self, round: usize, body: PosedVertices, seen: Seen) {
        let place = |slot: u32| self.corrected[slot as usize];
        match round {
            0 => self.cloth.find_near(place, seen.heights, seen.summaries),
            _ => self.cloth.refit(place, |packet| self.lifts.moves(packet)),
        }
        let least_height_m = Self::least_height_m(self.rule);
        let view = View {
            rule: self.rule,
            body: body.body,
            vertices: body.vertices,
            cloth: &self.cloth,
            corrected: &self.corrected,
            contacts: seen.contacts,
            least_height_m,
        };
        match round {
            0 => self.pokes.find(&view),
            _ => self.pokes.find_again(&view),
        }
        self.spans.find(&view);
        (self.props).find(body.colliders, self.cloth.faces(), place, least_height_m);
    }

    /// Takes for each corner the longest lift that a poke asks of it; is there any?
    fn lift_corners(&mut self, neighbours: &Neighbours) -> bool {
        self.lifts.clear();
        let mut is_any = false;
        let pokes = self.pokes.iter().chain(self.props.iter());
        for poke in pokes.chain(self.spans.iter()) {
            is_any = true;
            for (slot, lift) in self.cloth.corners(poke.face).into_iter().zip(poke.lifts) {
                self.lifts.lengthen(neighbours.place(slot as usize), lift);
            }
        }
        is_any
    }
}
