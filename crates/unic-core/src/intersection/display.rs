//! Corrections of shown positions that need all vertices of a garment at once.

mod again;
mod cloth;
mod collider_lifts;
mod contact_planes;
mod corrections;
mod depths;
mod face_lifting;
mod layer_order;
mod neighbours;
mod packet_summary;
mod poke_through;
mod retraction;
mod smoothing;
mod stretched_faces;
mod tears;

pub use again::LAST_MARGIN_SHARE;
pub use depths::keeps_layers_in_order;

use super::{Contact, Layers, RobustBody, RobustIntersection, packets::Packets, robust::LIMB_RADIUS_M};
use crate::{
    aabb_tree::LANES,
    character::Garment,
    collider::Collider,
    parallel::{for_each, for_each_chunk},
    transform::Rigid,
};
use corrections::Corrections;
use depths::Depths;
use face_lifting::{FaceLifting, VertexContacts};
use glam::Vec3;
use layer_order::LayerOrder;
use neighbours::Neighbours;
use packet_summary::PacketSummary;
use smoothing::{SWEEPS, Smoothing};
use tears::Tears;

/// Number of vertices that one thread takes at a time.
const CHUNK: usize = 1024;

/// Pass over all shown positions of a garment: it corrects vertices, lifts faces that the body
/// comes through, and spreads the corrections over the garment, so that a push leaves neither dent
/// nor spike. Vertices deep inside the body are drawn towards their skinned positions before, each
/// by itself. Layers of a pleat that are inside the body [keep their order](keeps_layers_in_order).
/// Where neighbours are on opposite sides of a limb afterwards, the tear between them is closed.
///
/// Positions farther than [`REACH_EDGES`](Self::REACH_EDGES) edges from any correction keep their
/// bits, but those deep inside and those around tears.
///
/// Scratch with its connectivity. Nothing is allocated after the first frame, and the bytes are the
/// same for any number of threads.
#[derive(Clone, Debug)]
pub struct DisplayPass {
    rule: RobustIntersection,
    afterwards: Afterwards,
    neighbours: Neighbours,
    face_lifting: FaceLifting,
    layer_order: Option<Box<LayerOrder>>,
    /// Positions without corrections, by slot, metres; shown positions where tears were closed.
    at: Vec<Vec3>,
    /// Contacts by slot.
    contacts: Vec<Contact>,
    /// Heights over the body after the correction of each vertex, by slot, metres.
    heights: Vec<f32>,
    /// Depths of cloth inside the body; none for a coarse garment.
    depths: Option<Depths>,
    /// Whether the last pass has drawn any vertex towards its skinned position.
    has_retracted: bool,
    /// Smallest displacement that each vertex needs, by slot.
    corrections: Corrections,
    smoothing: Smoothing,
    /// Cloth around tears.
    tears: Tears,
    /// Summary of each packet.
    summaries: Vec<PacketSummary>,
    /// Shown positions by slot, metres. Valid in packets in which something moves.
    shown: Vec<Vec3>,
    /// Shown positions that may be too low, by slot, metres; NaN for others. Valid in packets in
    /// which something moves. While tears are closed, all shown positions.
    to_recheck: Vec<Vec3>,
}

/// Use of the positions that a pass leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Afterwards {
    /// They are shown.
    Shown,
    /// Sweeps of a strain projection move them. Then vertices within 2 cm of the body, and others that
    /// may have come down, are [searched for again](DisplayPass::correct_again).
    SearchedAgain,
}

/// Posed body with its vertices, and the colliders around it.
#[derive(Clone, Copy, Debug)]
pub struct CollisionScene<'a> {
    /// Posed body for the robust rule.
    pub body: &'a RobustBody,
    /// Positions with which the body was posed, metres.
    pub vertices: &'a [Vec3],
    /// Ground and props in the same frame.
    pub colliders: &'a [Collider],
    /// Garment by skinning alone, in the same frame. Cloth deep inside the body is drawn towards
    /// it, and tears are closed relative to it. Without it cloth takes the shortest way out.
    pub skinned: Option<SkinnedGarment<'a>>,
}

/// Garment that moves by linear blend skinning alone, with its carriers.
#[derive(Clone, Copy, Debug)]
pub struct SkinnedGarment<'a> {
    /// Garment with its rest shape and carriers.
    pub garment: &'a Garment,
    /// Transforms of the joints, in the frame of the scene.
    pub world_from_rest: &'a [Rigid],
    /// How far tears are closed, 0 to 1.
    pub closing_share: f32,
}

impl SkinnedGarment<'_> {
    /// Returns the skinned position of a vertex, metres.
    fn position(&self, vertex: usize) -> Vec3 {
        let rest = self.garment.rest.vertices[vertex];
        self.garment
            .carriers()
            .position(vertex, rest, self.world_from_rest)
    }
}

impl DisplayPass {
    /// Number of edges from a corrected vertex to the farthest one that moves with it.
    pub const REACH_EDGES: usize = SWEEPS;

    /// Makes the pass of a rule for a garment, over a body made for the garment.
    pub fn new(rule: RobustIntersection, garment: &Garment, body: &RobustBody) -> Self {
        let packets = body.contact_filter().garment_packets();
        let slots = vec![Vec3::ZERO; packets.len()];
        let neighbours = Neighbours::new(&garment.rest, packets);
        Self {
            rule,
            afterwards: Afterwards::Shown,
            face_lifting: FaceLifting::new(rule, garment, body, &neighbours),
            neighbours,
            layer_order: None,
            contacts: vec![Contact::NONE; packets.len()],
            heights: vec![f32::INFINITY; packets.len()],
            at: vec![Vec3::NAN; packets.len()],
            depths: (body.keeps_layers_in_order())
                .then(|| Depths::new(body.surface().vertex_count(), packets.len())),
            has_retracted: false,
            corrections: Corrections::new(packets.len()),
            smoothing: Smoothing::new(packets.len()),
            tears: Tears::new(packets.len()),
            summaries: vec![PacketSummary::default(); packets.len() / LANES],
            to_recheck: slots.clone(),
            shown: slots,
        }
    }

    /// Keeps layers of the garment in order from now on.
    pub fn set_layers(&mut self, layers: &Layers) {
        self.layer_order = Some(Box::new(LayerOrder::new(layers)));
    }

    /// Sets the use of the positions that later passes leave.
    pub(crate) fn set_afterwards(&mut self, afterwards: Afterwards) {
        self.afterwards = afterwards;
    }

    /// Moves world positions, metres, to where they are shown.
    pub fn apply(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        self.find_contacts(scene, positions);
        self.find_corrections(scene);
        self.lift_faces(scene);
        self.spread_corrections(scene, positions);
        self.close_tears(scene, &tears::LARGE_TEARS, positions);
        self.order_layers(scene, positions);
    }

    /// Finds the contact of each vertex with the body. Draws deep vertices towards their skinned
    /// positions first. Positions are in the frame of the scene, metres.
    pub fn find_contacts(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        self.load_positions(scene.body, positions);
        (self.rule).find_contacts(scene.body, &self.at, |_| true, &mut self.contacts);
        self.has_retracted = false;
        if let Some(depths) = &mut self.depths {
            depths.clear_retractions();
        }
        if let Some(skinned) = scene.skinned {
            self.retract_deep(scene.body, skinned, positions);
        }
    }

    /// Finds the correction of each vertex, after [`find_contacts`](Self::find_contacts). Layers
    /// of the cloth over one place of the body keep their order.
    pub fn find_corrections(&mut self, scene: CollisionScene) {
        // Before the colliders, whose pushes say nothing about depths inside the body.
        if let Some(depths) = &mut self.depths {
            depths.keep_order(self.rule, scene.body, &self.at, &mut self.contacts);
        }
        if !scene.colliders.is_empty() {
            let (at, rule) = (&self.at, self.rule);
            for_each_chunk(&mut self.contacts, CHUNK, |first, contacts| {
                for (contact, &at) in contacts.iter_mut().zip(&at[first..]) {
                    let at = contact.corrected.unwrap_or(at);
                    let out = collider_lifts::push_out_of_all(scene.colliders, at, rule.margin_m);
                    contact.corrected = out.or(contact.corrected);
                }
            });
        }
        self.summarise_packets();
        self.corrections.clear();
        let corrected = (0..self.summaries.len()).filter(|&packet| self.summaries[packet].is_corrected);
        for slot in corrected.flat_map(|packet| packet * LANES..(packet + 1) * LANES) {
            if let Some(corrected) = self.contacts[slot].corrected {
                // The vertices of a seam share one correction, so that the seam stays closed.
                let welded = self.neighbours.welded_slot(slot);
                self.corrections.keep_longer(welded, corrected - self.at[slot]);
            }
        }
    }

    /// Moves each vertex by its own correction, after
    /// [`find_corrections`](Self::find_corrections): without lifted faces and without a share for its
    /// neighbours, as on devices.
    pub fn move_each(&self, body: &RobustBody, positions: &mut [Vec3]) {
        let slots = body.contact_filter().garment_packets().slots();
        for (position, &slot) in positions.iter_mut().zip(slots) {
            *position = self.contacts[slot as usize].corrected.unwrap_or(*position);
        }
    }

    fn summarise_packets(&mut self) {
        let (contacts, margin_m) = (&self.contacts, self.rule.margin_m);
        let groups = self.heights.chunks_mut(Packets::GROUP);
        let groups = groups.zip(self.summaries.chunks_mut(Packets::GROUP / LANES));
        for_each(groups.enumerate(), |(group, (heights, summaries))| {
            let contacts = contacts[group * Packets::GROUP..].chunks(LANES);
            let packets = heights.chunks_mut(LANES).zip(summaries).zip(contacts);
            for ((heights, summary), contacts) in packets {
                *summary = PacketSummary::new(contacts, margin_m, heights);
            }
        });
    }

    /// Stores positions by slot; NaN in empty slots.
    fn load_positions(&mut self, body: &RobustBody, positions: &[Vec3]) {
        sort_by_slot(body, positions, &mut self.at);
    }

    /// Extends the corrections to lift the faces that the body and colliders come through.
    pub fn lift_faces(&mut self, scene: CollisionScene) {
        let vertices = VertexContacts {
            neighbours: &self.neighbours,
            at: &self.at,
            contacts: &self.contacts,
            heights: &self.heights,
            summaries: &self.summaries,
        };
        self.face_lifting.lift(scene, vertices, &mut self.corrections);
    }

    /// Spreads the corrections over the garment and moves the positions by them.
    pub fn spread_corrections(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        if self.corrections.is_empty() {
            return;
        }
        self.smoothing.spread(&self.neighbours, &self.corrections);
        self.find_moving_packets();
        self.move_vertices(scene);
        self.recheck(scene);
        let slots = scene.body.contact_filter().garment_packets().slots();
        let (summaries, shown) = (&self.summaries, &self.shown);
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (position, &slot) in positions.iter_mut().zip(&slots[first..]) {
                if summaries[slot as usize / LANES].is_moving {
                    *position = shown[slot as usize];
                }
            }
        });
    }

    /// Moves each layer to the outer side of those beneath it, the inner layers first.
    fn order_layers(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        let layers = self.layer_order.as_ref().map_or(0, |order| order.len());
        let slots = scene.body.contact_filter().garment_packets().slots();
        for layer in 0..layers {
            // Each layer is pushed off the final positions of the layers beneath it.
            self.load_positions(scene.body, positions);
            self.corrections.clear();
            let Self {
                layer_order,
                corrections,
                neighbours,
                rule,
                ..
            } = self;
            let pushes = layer_order
                .iter_mut()
                .flat_map(|order| order.pushes(layer, positions, rule.margin_m));
            for (vertex, push) in pushes {
                corrections.keep_longer(neighbours.welded_slot(slots[vertex] as usize), *push);
            }
            self.spread_corrections(scene, positions);
        }
    }

    /// Finds the packets in which the smoothed corrections move anything.
    fn find_moving_packets(&mut self) {
        let (displacements, neighbours) = (self.smoothing.displacements(), &self.neighbours);
        for (packet, summary) in self.summaries.iter_mut().enumerate() {
            let around = neighbours.of_packet(packet);
            summary.is_moving = around.iter().any(|&packet| displacements.is_active(packet));
        }
    }

    /// Moves the positions by the smoothed corrections, and marks those that must be rechecked: a
    /// vertex that moved farther than its own correction may have come to another part of the body.
    fn move_vertices(&mut self, scene: CollisionScene) {
        let (displacements, neighbours) = (self.smoothing.displacements(), &self.neighbours);
        let (at, contacts, summaries) = (&self.at, &self.contacts, &self.summaries);
        let margin_m = self.rule.margin_m;
        let clearance_m = match self.afterwards {
            Afterwards::SearchedAgain => margin_m,
            // Where limbs touch, they overlap: a vertex over one may be inside the other, unless its
            // height exceeds the radius of a limb.
            Afterwards::Shown => margin_m.max(LIMB_RADIUS_M),
        };
        let push_out = |p| collider_lifts::push_out_of_all(scene.colliders, p, margin_m);
        let groups = self.shown.chunks_mut(Packets::GROUP);
        let groups = groups.zip(self.to_recheck.chunks_mut(Packets::GROUP)).enumerate();
        for_each(groups, |(group, (shown, to_recheck))| {
            for (k, (shown, to_recheck)) in shown.iter_mut().zip(to_recheck).enumerate() {
                let slot = group * Packets::GROUP + k;
                if !summaries[slot / LANES].is_moving {
                    continue;
                }
                let displacement = displacements.at(neighbours.welded_slot(slot));
                *shown = at[slot] + displacement;
                if displacement != Vec3::ZERO {
                    *shown = push_out(*shown).unwrap_or(*shown);
                }
                let moved_m = shown.distance(at[slot]);
                // A height changes by no more than the displacement.
                let min_height_m = moved_m + clearance_m;
                let is_clear = moved_m == 0.0 || contacts[slot].height_m >= min_height_m;
                *to_recheck = if is_clear { Vec3::NAN } else { *shown };
            }
        });
    }

    /// Corrects the shown positions that may be too low.
    fn recheck(&mut self, scene: CollisionScene) {
        let is_moving = |packet: usize| self.summaries[packet].is_moving;
        if self.layer_order.is_some() {
            // Further rounds for layers read these heights: they stay lower bounds at the new
            // positions.
            for (slot, contact) in self.contacts.iter_mut().enumerate() {
                if is_moving(slot / LANES) {
                    contact.height_m -= self.shown[slot].distance(self.at[slot]);
                }
            }
        }
        (self.rule).find_contacts(scene.body, &self.to_recheck, is_moving, &mut self.contacts);
        let (to_recheck, contacts) = (&self.to_recheck, &self.contacts);
        for_each_chunk(&mut self.shown, CHUNK, |first, shown| {
            let slots = (first..).zip(shown).filter(|(slot, _)| is_moving(slot / LANES));
            for (slot, shown) in slots {
                // A contact that was not searched for again belongs to the position before.
                let corrected = contacts[slot].corrected.filter(|_| to_recheck[slot].is_finite());
                *shown = corrected.unwrap_or(*shown);
            }
        });
    }
}

/// Stores positions by slot; NaN in empty slots.
fn sort_by_slot(body: &RobustBody, positions: &[Vec3], by_slot: &mut [Vec3]) {
    let packets = body.contact_filter().garment_packets();
    for_each_chunk(by_slot, CHUNK, |first, by_slot| {
        for (place, &vertex) in by_slot.iter_mut().zip(&packets.vertices()[first..]) {
            *place = positions.get(vertex as usize).copied().unwrap_or(Vec3::NAN);
        }
    });
}
