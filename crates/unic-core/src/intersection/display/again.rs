//! Corrections after sweeps have moved the shown vertices.

use super::{Afterwards, CHUNK, CollisionScene, DisplayPass, RobustIntersection, collider_lifts, tears};
use crate::{aabb_tree::LANES, parallel::for_each_chunk, projection::ContactPlane};
use glam::Vec3;

/// Share of the margin to which vertices are pushed after the sweeps of a strain projection.
///
/// Each is pushed by itself, which compresses the edges that the sweeps have mended. Pushes to half of
/// the margin are shorter, and fewer. Torn and stretched faces still go to the whole margin: only some
/// of their points are above the body.
pub const LAST_MARGIN_SHARE: f32 = 0.5;

impl DisplayPass {
    /// Corrects shown positions, metres, that sweeps have moved since [`apply`](Self::apply).
    ///
    /// Vertices with a plane, and those that may have come down from farther up, are pushed to
    /// [`LAST_MARGIN_SHARE`] of the margin, each by itself. All are pushed out of the colliders, to the
    /// whole margin. Then tears are closed, stretched faces that cut through the body are lifted, and
    /// layers are put in order.
    pub(crate) fn correct_again(
        &mut self,
        scene: CollisionScene,
        planes: &[ContactPlane],
        positions: &mut [Vec3],
    ) {
        // No search follows the corrections below.
        self.set_afterwards(Afterwards::Shown);
        self.push_out_again(scene, planes, positions);
        for contact in &mut self.contacts {
            // Unknown where the vertices are now, so that all that move are searched for.
            contact.height_m = f32::NAN;
        }
        self.close_tears(scene, &tears::ALL_TEARS, positions);
        self.lift_stretched_faces(scene, positions);
        self.order_layers(scene, positions);
    }

    fn push_out_again(&mut self, scene: CollisionScene, planes: &[ContactPlane], positions: &mut [Vec3]) {
        let rule = RobustIntersection {
            margin_m: LAST_MARGIN_SHARE * self.rule.margin_m,
        };
        let packets = scene.body.contact_filter().garment_packets();
        for (packet, vertices) in packets.vertices().chunks(LANES).enumerate() {
            let slots = packet * LANES..packet * LANES + vertices.len();
            for (slot, &vertex) in slots.clone().zip(vertices) {
                // Empty slots have no vertex.
                let moved = positions.get(vertex as usize).zip(planes.get(vertex as usize));
                let at = moved.filter(|(now, plane)| {
                    **plane != ContactPlane::NONE || self.may_be_low(slot, **now, rule.margin_m)
                });
                self.to_recheck[slot] = at.map_or(Vec3::NAN, |(now, _)| *now);
            }
            self.summaries[packet].is_moving = self.to_recheck[slots].iter().any(|at| at.is_finite());
        }
        let is_moving = |packet: usize| self.summaries[packet].is_moving;
        rule.find_contacts(scene.body, &self.to_recheck, is_moving, &mut self.contacts);
        let slots = packets.slots();
        let (to_recheck, contacts, margin_m) = (&self.to_recheck, &self.contacts, self.rule.margin_m);
        for_each_chunk(positions, CHUNK, |first, positions| {
            for (position, &slot) in positions.iter_mut().zip(&slots[first..]) {
                let contact = &contacts[slot as usize];
                // A contact that was not searched for again belongs to the position before.
                let corrected = contact
                    .corrected
                    .filter(|_| to_recheck[slot as usize].is_finite());
                *position = corrected.unwrap_or(*position);
                let out = collider_lifts::push_out_of_all(scene.colliders, *position, margin_m);
                *position = out.unwrap_or(*position);
            }
        });
    }

    /// Lifts the stretched faces that were found at these positions, and their neighbours.
    fn lift_stretched_faces(&mut self, scene: CollisionScene, positions: &mut [Vec3]) {
        self.load_positions(scene.body, positions);
        self.corrections.clear();
        (self.face_lifting).lift_stretched_faces(&self.neighbours, &mut self.corrections);
        self.spread_corrections(scene, positions);
    }

    /// Returns whether a vertex may be below a margin at `now`, metres, after the last pass has shown it
    /// elsewhere.
    fn may_be_low(&self, slot: usize, now: Vec3, margin_m: f32) -> bool {
        let height_m = self.contacts[slot].height_m;
        // The height belongs to one of these places. `shown` is valid in packets that have moved.
        let is_moving = self.summaries[slot / LANES].is_moving;
        let places = [Some(self.at[slot]), is_moving.then(|| self.shown[slot])];
        let mut distances = places.into_iter().flatten().map(|place| now.distance(place));
        distances.any(|moved_m| moved_m > height_m - margin_m)
    }
}
