//! Lifting of garment faces over the body vertices and colliders that come through them.

use super::{
    CollisionScene, Contact, RobustBody, RobustIntersection,
    cloth::Cloth,
    collider_lifts::ColliderLifts,
    corrections::Corrections,
    neighbours::Neighbours,
    packet_summary::PacketSummary,
    poke_through::{FaceLift, LiftContext, PokeThroughs},
    stretched_faces::{MIN_STRETCH, StretchedFaces},
};
use crate::{aabb_tree::LANES, character::Garment, parallel::for_each_chunk};
use glam::Vec3;

/// Smallest height of cloth over a body vertex as a fraction of the margin.
///
/// It is less than one so that a flat face over slightly curved skin is left alone.
const FACE_HEIGHT_FRACTION: f32 = 0.5;

/// Stretch from which faces are lifted again after sweeps.
///
/// Lifts compress the edges beside them. Most of what comes through cloth that is less stretched is
/// hidden under the arms.
pub(super) const MIN_STRETCH_AGAIN: f32 = 1.5;

/// Length at which the lift of a corner after sweeps has faded to zero, metres. Lifts fade over the
/// last quarter of it. Longer ones would pull hems into spikes.
const MAX_LIFT_AGAIN_M: f32 = 0.02;

/// Number of rounds: a face lifted over one vertex moves its corners over others.
const ROUNDS: usize = 2;

/// Search for everything that comes through faces, and the lifts over it.
#[derive(Clone, Debug)]
pub(super) struct FaceLifting {
    rule: RobustIntersection,
    cloth: Cloth,
    poke_throughs: PokeThroughs,
    collider_lifts: ColliderLifts,
    stretched_faces: StretchedFaces,
    /// Lifts of the current round.
    lifts: Corrections,
    /// Corrected positions by slot, metres.
    corrected: Vec<Vec3>,
}

/// Contacts of the garment's vertices, by slot: the input of the search.
#[derive(Clone, Copy)]
pub(super) struct VertexContacts<'a> {
    pub(super) neighbours: &'a Neighbours,
    /// Positions without corrections, metres.
    pub(super) at: &'a [Vec3],
    pub(super) contacts: &'a [Contact],
    /// Heights over the body after the correction of each vertex, metres.
    pub(super) heights: &'a [f32],
    /// Summary of each packet.
    pub(super) summaries: &'a [PacketSummary],
}

impl FaceLifting {
    pub(super) fn new(
        rule: RobustIntersection,
        garment: &Garment,
        body: &RobustBody,
        neighbours: &Neighbours,
    ) -> Self {
        let filter = body.contact_filter();
        let slots = filter.garment_packets().len();
        let cloth = Cloth::new(&garment.rest, filter, neighbours, Self::min_height_m(rule));
        Self {
            rule,
            stretched_faces: StretchedFaces::new(&cloth),
            cloth,
            poke_throughs: PokeThroughs::new(filter.lifting_vertices().len()),
            collider_lifts: ColliderLifts::default(),
            lifts: Corrections::new(slots),
            corrected: vec![Vec3::ZERO; slots],
        }
    }

    /// Smallest height of cloth over a body vertex, metres.
    fn min_height_m(rule: RobustIntersection) -> f32 {
        FACE_HEIGHT_FRACTION * rule.margin_m
    }

    /// Extends the corrections until faces lie over what comes through them.
    pub(super) fn lift(
        &mut self,
        scene: CollisionScene,
        vertices: VertexContacts,
        corrections: &mut Corrections,
    ) {
        for round in 0..ROUNDS {
            self.update_positions(round, vertices, corrections);
            self.find(round, scene, vertices);
            if !self.collect_lifts(vertices.neighbours) {
                break;
            }
            corrections.add(&self.lifts);
        }
    }

    /// Finds the stretched faces that cut through the body at other positions.
    ///
    /// `at` has the positions by slot, metres, and contacts their faces of the body. The faces are
    /// those that were near the body in the last [`lift`](Self::lift).
    pub(super) fn find_stretched_faces(&mut self, scene: CollisionScene, at: &[Vec3], contacts: &[Contact]) {
        self.corrected.copy_from_slice(at);
        let context = lift_context(self.rule, scene, &self.cloth, &self.corrected, contacts);
        self.stretched_faces.find(MIN_STRETCH_AGAIN, &context);
    }

    /// Slots of the corners, and stretch, of each face that was
    /// [found](Self::find_stretched_faces).
    pub(super) fn stretched_faces(&self) -> impl Iterator<Item = ([u32; 3], f32)> {
        self.stretched_faces.iter().map(|lift| {
            let slots = self.cloth.corners(lift.face);
            let corners = slots.map(|slot| self.corrected[slot as usize]);
            (slots, self.cloth.stretch(lift.face, corners))
        })
    }

    /// Extends the corrections by lifts of the faces that were
    /// [found](Self::find_stretched_faces).
    pub(super) fn lift_stretched_faces(&self, neighbours: &Neighbours, corrections: &mut Corrections) {
        for lift in self.stretched_faces.iter() {
            let longest_m = lift.corners.iter().map(|c| c.length()).fold(0.0, f32::max);
            let share = (MAX_LIFT_AGAIN_M - longest_m) / (0.25 * MAX_LIFT_AGAIN_M);
            let lift = lift.scaled(share.clamp(0.0, 1.0));
            keep_lift(lift, &self.cloth, neighbours, corrections);
        }
    }

    /// Updates the corrected positions: all of them in the first round, then those near a lift.
    fn update_positions(&mut self, round: usize, vertices: VertexContacts, corrections: &Corrections) {
        let changed = match round {
            0 => corrections,
            _ => &self.lifts,
        };
        let neighbours = vertices.neighbours;
        for_each_chunk(&mut self.corrected, LANES, |first, corrected| {
            let around = neighbours.of_packet(first / LANES);
            let at = &vertices.at[first..][..LANES];
            if around.iter().any(|&packet| changed.is_active(packet)) {
                for ((corrected, at), slot) in corrected.iter_mut().zip(at).zip(first..) {
                    *corrected = *at + corrections.at(neighbours.welded_slot(slot));
                }
            } else if round == 0 {
                corrected.copy_from_slice(at);
            }
        });
    }

    /// Finds everything that comes through faces.
    fn find(&mut self, round: usize, scene: CollisionScene, vertices: VertexContacts) {
        let at = |slot: u32| self.corrected[slot as usize];
        match round {
            0 => self
                .cloth
                .select_near_faces(at, vertices.heights, vertices.summaries),
            _ => self.cloth.refit(at, |packet| self.lifts.is_active(packet)),
        }
        let context = lift_context(self.rule, scene, &self.cloth, &self.corrected, vertices.contacts);
        // Lifts move cloth outwards, so only vertices that poked through may still do so.
        match round {
            0 => self.poke_throughs.find(&context),
            _ => self.poke_throughs.find_again(&context),
        }
        self.stretched_faces.find(MIN_STRETCH, &context);
        (self.collider_lifts).find(scene.colliders, self.cloth.faces(), at, context.min_height_m);
    }

    /// Stores for each corner the longest lift that any of its faces needs. Returns whether there
    /// is one.
    fn collect_lifts(&mut self, neighbours: &Neighbours) -> bool {
        self.lifts.clear();
        // One thread, in the order of the searches: of equally long lifts the first one stays.
        let mut is_any = false;
        let lifts = self.poke_throughs.iter().chain(self.collider_lifts.iter());
        for lift in lifts.chain(self.stretched_faces.iter()) {
            is_any = true;
            keep_lift(lift, &self.cloth, neighbours, &mut self.lifts);
        }
        is_any
    }
}

/// Makes the context of searches between the body and cloth at its corrected positions.
// Takes single fields, so that the searches can write to the others.
fn lift_context<'a>(
    rule: RobustIntersection,
    scene: CollisionScene<'a>,
    cloth: &'a Cloth,
    corrected: &'a [Vec3],
    contacts: &'a [Contact],
) -> LiftContext<'a> {
    LiftContext {
        rule,
        body: scene.body,
        vertices: scene.vertices,
        cloth,
        corrected,
        contacts,
        min_height_m: FaceLifting::min_height_m(rule),
    }
}

/// Stores the lift of a face for each of its corners that no other face lifts farther.
fn keep_lift(lift: FaceLift, cloth: &Cloth, neighbours: &Neighbours, lifts: &mut Corrections) {
    for (slot, corner) in cloth.corners(lift.face).into_iter().zip(lift.corners) {
        lifts.keep_longer(neighbours.welded_slot(slot as usize), corner);
    }
}
