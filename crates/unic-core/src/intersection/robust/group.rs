//! Contacts of all vertices of a garment at once, group by group of [`Packets`].

mod search;
mod slots;

use super::{
    ClosestFaces, Contact, MAX_ITERATIONS, RobustBody, RobustIntersection, SunkPosition, next_position,
    sinking::Surroundings,
};
use crate::{
    aabb_tree::LANES, intersection::packets::Packets, parallel::for_each_chunk, surface::SurfacePoint,
};
use glam::Vec3;
use slots::Slots;

impl RobustIntersection {
    /// Finds the contacts of the vertices of the garment with the body, by [slot](Packets).
    ///
    /// The search covers the packets that `is_active` names, and there the vertices whose position
    /// in `at` is finite. Other packets keep their contacts, and other vertices their faces and
    /// heights. The contacts of the last frame are seeds.
    ///
    /// Contacts are those of [`Self::find_contact`], except that the height of a vertex well above
    /// the body is a lower bound. Where the body is farther from the centre of a packet than the
    /// packet's vertices are, all of them are on the same side as the centre.
    pub(crate) fn find_contacts(
        &self,
        body: &RobustBody,
        at: &[Vec3],
        is_active: impl Fn(usize) -> bool + Sync,
        contacts: &mut [Contact],
    ) {
        for_each_chunk(contacts, Packets::GROUP, |first, contacts| {
            let group = Group {
                rule: *self,
                body,
                vertex: body.contact_filter.garment_packets().vertices()[first] as usize,
            };
            let is_active = |packet| is_active(first / LANES + packet);
            group.find_contacts(&at[first..][..contacts.len()], is_active, contacts);
        });
    }
}

/// Group of packets whose vertices the same parts of the body may push.
struct Group<'a> {
    rule: RobustIntersection,
    body: &'a RobustBody,
    /// One of the vertices: the contact filter has the same answers for all of them.
    vertex: usize,
}

/// Centre of a packet's vertices and the body near it.
#[derive(Clone, Copy)]
struct PacketCentre {
    centre: Vec3,
    /// Face of the body closest to the centre.
    face: u32,
    /// Height of the centre over the body, metres; zero where it is unknown.
    height_m: f32,
}

/// A value for each slot of a group.
type BySlot<T> = [T; Packets::GROUP];

impl Group<'_> {
    /// Finds the contacts of the active packets; slices are by slot of the group.
    fn find_contacts(&self, at: &[Vec3], is_active: impl Fn(usize) -> bool, contacts: &mut [Contact]) {
        if !(0..LANES).any(&is_active) {
            return;
        }
        let centres = self.packet_centres(at, is_active, contacts);
        let mut near = Slots::EMPTY;
        let packets = at.chunks(LANES).zip(contacts.chunks_mut(LANES)).zip(&centres);
        for (packet, ((at, contacts), centre)) in packets.enumerate() {
            if centre.centre.is_finite() && !self.is_packet_clear(at, centre, contacts) {
                for (lane, contact) in contacts.iter_mut().enumerate() {
                    match at[lane].is_finite() {
                        true => near.push(packet * LANES + lane),
                        // A vertex that is not searched for keeps its face and height.
                        false => contact.corrected = None,
                    }
                }
            }
        }
        self.find_near_contacts(near, at, &centres, contacts);
    }

    /// Finds the body near the centre of each active packet. The centre of a packet without
    /// vertices is NaN.
    // The centres of the packets of a group are themselves a packet, so that one search finds all.
    fn packet_centres(
        &self,
        at: &[Vec3],
        is_active: impl Fn(usize) -> bool,
        contacts: &[Contact],
    ) -> [PacketCentre; LANES] {
        let mut centres = [Vec3::NAN; LANES];
        let mut known = Slots::EMPTY;
        let packets = centres.iter_mut().zip(at.chunks(LANES)).enumerate();
        for (packet, (centre, at)) in packets.filter(|&(packet, _)| is_active(packet)) {
            let finite = || at.iter().filter(|p| p.is_finite());
            // Without finite positions 0 / 0 leaves the centre NaN.
            *centre = finite().sum::<Vec3>() / finite().count() as f32;
            if centre.is_finite() {
                known.push(packet);
            }
        }
        // The first slot of a packet with vertices has one.
        let mut faces: [u32; LANES] = std::array::from_fn(|packet| contacts[packet * LANES].face);
        let mut pushing = faces;
        self.search(&known, &centres, &mut faces, None);
        // A centre outside a limb that has sunk into a pushing part may still be inside that part.
        self.search_pushing_from(&known, &centres, &faces, &mut pushing);
        std::array::from_fn(|k| {
            let height = |face| {
                let hit = self.body.surface.point_on(face, centres[k]);
                hit.map(|hit| hit.signed_distance)
            };
            let height_m = match pushing[k] {
                face if face == faces[k] => height(face),
                u32::MAX => height(faces[k]),
                face => height(faces[k]).zip(height(face)).map(|(a, b)| a.min(b)),
            };
            PacketCentre {
                centre: centres[k],
                face: faces[k],
                height_m: height_m.unwrap_or(0.0),
            }
        })
    }

    /// Returns whether the body reaches none of the vertices of a packet. If so, stores their
    /// contacts with lower bounds of their heights.
    fn is_packet_clear(&self, positions: &[Vec3], centre: &PacketCentre, contacts: &mut [Contact]) -> bool {
        // No point is lower than the centre by more than its distance from it.
        let height = |p: &Vec3| centre.height_m - p.distance(centre.centre);
        // Written with `<=`, which is false for NaN: positions that are NaN belong to no vertex.
        let is_clear = !positions.iter().any(|p| height(p) <= self.rule.margin_m);
        if is_clear {
            for (contact, p) in contacts.iter_mut().zip(positions) {
                // A vertex that was not searched for keeps its face and height.
                contact.corrected = None;
                if p.is_finite() {
                    (contact.face, contact.height_m) = (centre.face, height(p));
                }
            }
        }
        is_clear
    }

    /// Finds the contacts of the vertices that the body may reach.
    fn find_near_contacts(
        &self,
        near: Slots,
        at: &[Vec3],
        centres: &[PacketCentre; LANES],
        contacts: &mut [Contact],
    ) {
        let (mut faces, mut distances) = ([u32::MAX; Packets::GROUP], [0.0; Packets::GROUP]);
        for slot in near.iter() {
            faces[slot] = match contacts[slot].face {
                // In the first frame.
                u32::MAX => centres[slot / LANES].face,
                face => face,
            };
        }
        self.search(&near, at, &mut faces, Some(&mut distances));
        let unresolved = near.filtered(|slot| {
            let (face, distance) = (faces[slot], distances[slot]);
            let is_clear = self.is_vertex_clear(at[slot], face, distance, &centres[slot / LANES]);
            if is_clear {
                contacts[slot] = Contact {
                    face,
                    height_m: distance,
                    corrected: None,
                };
            }
            !is_clear
        });
        if !unresolved.is_empty() {
            self.resolve(unresolved, at, &faces, contacts);
        }
    }

    /// Sinks and pushes vertices; `nearest` are the closest faces of the body. The counterpart of
    /// [`RobustIntersection::find_contact`].
    fn resolve(&self, slots: Slots, from: &[Vec3], nearest: &BySlot<u32>, contacts: &mut [Contact]) {
        let (mut at, mut pushing) = ([Vec3::NAN; Packets::GROUP], [u32::MAX; Packets::GROUP]);
        for slot in slots.iter() {
            (at[slot], pushing[slot]) = (from[slot], contacts[slot].face);
        }
        self.sink(&slots, &mut at, *nearest);
        self.search_pushing_from(&slots, &at, nearest, &mut pushing);
        let corrected = slots.filtered(|slot| {
            let position = SunkPosition {
                from: from[slot],
                to: at[slot],
            };
            let faces = ClosestFaces {
                of_body: nearest[slot],
                of_pushing: pushing[slot],
            };
            contacts[slot] = (self.rule).push_once(self.body, self.vertex, position, faces);
            at[slot] = contacts[slot].corrected.unwrap_or(at[slot]);
            contacts[slot].corrected.is_some()
        });
        let nearest = self.push_further(corrected, &mut at, pushing);
        self.sink(&corrected, &mut at, nearest);
        for slot in corrected.iter() {
            contacts[slot].corrected = Some(at[slot]);
        }
    }

    fn may_push(&self, face: u32) -> bool {
        face != u32::MAX && self.body.contact_filter.face_may_push(face, self.vertex)
    }

    /// Returns whether a vertex on the outer side of its closest face, at a distance from the body,
    /// is high enough.
    ///
    /// The ball around the vertex up to the body and the ball around the centre of its packet must
    /// overlap, and the centre must be outside. The centre's side alone does not exclude a second
    /// part of the body with the vertex inside.
    fn is_vertex_clear(&self, p: Vec3, face: u32, distance: f32, centre: &PacketCentre) -> bool {
        let overlap_m = centre.height_m + distance - p.distance(centre.centre);
        let is_outside = centre.height_m > 0.0 && overlap_m > 0.0 && self.rule.is_high_enough(distance);
        is_outside && self.body.surface.is_above(face, p)
    }

    /// Does what [`RobustIntersection::push_further`] does. Returns the faces of the body closest
    /// to where the vertices end. `pushing` are the faces that have pushed them to where they are.
    fn push_further(&self, mut slots: Slots, at: &mut BySlot<Vec3>, mut pushing: BySlot<u32>) -> BySlot<u32> {
        let mut nearest = pushing;
        for iteration in 1..=MAX_ITERATIONS {
            self.search(&slots, at, &mut nearest, None);
            self.search_pushing_from(&slots, at, &nearest, &mut pushing);
            slots.retain(|slot| {
                let hit = self.body.surface.point_on(pushing[slot], at[slot]);
                let out = hit.and_then(|hit| self.rule.push_out(&hit, at[slot]));
                if let Some(out) = out {
                    at[slot] = next_position(iteration, at[slot], out);
                }
                out.is_some()
            });
        }
        self.search(&slots, at, &mut nearest, None);
        nearest
    }

    /// Does what [`RobustIntersection::sink`] does; `faces` are the faces of the body closest to the
    /// positions.
    fn sink(&self, slots: &Slots, at: &mut BySlot<Vec3>, mut faces: BySlot<u32>) {
        let surface = &self.body.surface;
        let mut beneath = [u32::MAX; Packets::GROUP];
        let mut sinking = *slots;
        for _ in 0..MAX_ITERATIONS {
            sinking.retain(|slot| self.intruder(faces[slot], at[slot]).is_some());
            self.search_pushing(&sinking, at, &mut beneath);
            sinking.retain(|slot| {
                let intruder = self.intruder(faces[slot], at[slot]);
                let beneath = surface.point_on(beneath[slot], at[slot]);
                let around = intruder.as_ref().zip(beneath.as_ref());
                let around = around.map(|(intruder, beneath)| Surroundings { intruder, beneath });
                let step = around
                    .and_then(|around| self.rule.sinking_step(self.body, self.vertex, at[slot], around));
                if let Some(step) = step {
                    at[slot] += step;
                }
                step.is_some()
            });
            self.search(&sinking, at, &mut faces, None);
        }
    }

    /// Returns the point of a face closest to `p` within a part that may not push.
    fn intruder(&self, face: u32, p: Vec3) -> Option<SurfacePoint> {
        if self.may_push(face) {
            return None;
        }
        let hit = self.body.surface.point_on(face, p);
        hit.filter(|hit| hit.signed_distance < 0.0)
    }
}
