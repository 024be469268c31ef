//! Contacts of all vertices of a garment at once, group by group of [`Packets`].

use super::{
    ClosestFaces, Contact, MAX_ITERATIONS, RobustBody, RobustIntersection, SunkPosition, next_position,
    sinking::Surroundings,
};
use crate::{
    aabb_tree::{LANES, Packet},
    intersection::packets::Packets,
    parallel::for_each_chunk,
    surface::FaceFilter,
};
use glam::Vec3;

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

impl Group<'_> {
    /// Finds the contacts of the active packets; slices are by slot of the group.
    fn find_contacts(&self, at: &[Vec3], is_active: impl Fn(usize) -> bool, contacts: &mut [Contact]) {
        if !(0..LANES).any(&is_active) {
            return;
        }
        let centres = self.packet_centres(at, is_active, contacts);
        for ((at, contacts), centre) in at.chunks(LANES).zip(contacts.chunks_mut(LANES)).zip(centres) {
            if centre.centre.is_finite() && !self.is_packet_clear(at, &centre, contacts) {
                self.find_packet_contacts(at, &centre, contacts);
            }
        }
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
        let packets = centres.iter_mut().zip(at.chunks(LANES)).enumerate();
        for (_, (centre, at)) in packets.filter(|&(packet, _)| is_active(packet)) {
            let finite = || at.iter().filter(|p| p.is_finite());
            // Without finite positions 0 / 0 leaves the centre NaN.
            *centre = finite().sum::<Vec3>() / finite().count() as f32;
        }
        // The first slot of a packet with vertices has one.
        let near = seeds(contacts.iter().step_by(LANES));
        let faces = match centres.iter().any(|centre| centre.is_finite()) {
            true => self.closest(&centres, &near).item,
            false => [u32::MAX; LANES],
        };
        // A centre outside a limb that has sunk into a pushing part may still be inside that part.
        let pushing = self.closest_pushing_from(&centres, faces, &near);
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

    /// Finds the contacts of the vertices of a packet.
    fn find_packet_contacts(&self, positions: &[Vec3], centre: &PacketCentre, contacts: &mut [Contact]) {
        let near = seeds(contacts.iter()).map(|face| match face {
            // In the first frame.
            u32::MAX => centre.face,
            face => face,
        });
        let found = self.closest(positions, &near);
        let mut unresolved = [Vec3::NAN; LANES];
        for (lane, (contact, &p)) in contacts.iter_mut().zip(positions).enumerate() {
            let (distance, face) = (found.squared[lane].sqrt(), found.item[lane]);
            if !p.is_finite() {
                // A vertex that was not searched for keeps its face and height.
                contact.corrected = None;
            } else if self.is_vertex_clear(p, face, distance, centre) {
                *contact = Contact {
                    face,
                    height_m: distance,
                    corrected: None,
                };
            } else {
                unresolved[lane] = p;
            }
        }
        if unresolved.iter().any(|p| p.is_finite()) {
            self.resolve(&unresolved, found.item, contacts);
        }
    }

    /// Sinks and pushes the vertices of the lanes with a finite position; `nearest` are the closest
    /// faces of the body. The counterpart of [`RobustIntersection::find_contact`].
    fn resolve(&self, positions: &[Vec3; LANES], nearest: [u32; LANES], contacts: &mut [Contact]) {
        let mut sunk = *positions;
        self.sink(&mut sunk, nearest);
        let pushing = self.closest_pushing_from(&sunk, nearest, &seeds(contacts.iter()));
        let mut corrected = [Vec3::NAN; LANES];
        for (lane, contact) in contacts.iter_mut().enumerate() {
            if positions[lane].is_finite() {
                let position = SunkPosition {
                    from: positions[lane],
                    to: sunk[lane],
                };
                let faces = ClosestFaces {
                    of_body: nearest[lane],
                    of_pushing: pushing[lane],
                };
                *contact = (self.rule).push_once(self.body, self.vertex, position, faces);
                corrected[lane] = contact.corrected.unwrap_or(Vec3::NAN);
            }
        }
        if corrected.iter().any(|p| p.is_finite()) {
            let nearest = self.push_further(&mut corrected, pushing);
            self.sink(&mut corrected, nearest);
        }
        for (contact, at) in contacts.iter_mut().zip(corrected) {
            if at.is_finite() {
                contact.corrected = Some(at);
            }
        }
    }

    /// Finds the closest face that may push each point, where `nearest`, the closest of all, may
    /// not. `seeds` are pushing faces near the points.
    fn closest_pushing_from(
        &self,
        at: &[Vec3; LANES],
        nearest: [u32; LANES],
        seeds: &[u32; LANES],
    ) -> [u32; LANES] {
        let mut searched = *at;
        for (searched, face) in searched.iter_mut().zip(nearest) {
            if self.may_push(face) {
                *searched = Vec3::NAN;
            }
        }
        if searched.iter().all(|p| p.is_nan()) {
            return nearest;
        }
        let found = self.closest_pushing(&searched, seeds).item;
        std::array::from_fn(|lane| match searched[lane].is_finite() {
            true => found[lane],
            false => nearest[lane],
        })
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

    /// Does what [`RobustIntersection::push_further`] does for the lanes with a finite position.
    /// Returns the faces of the body closest to where they end. `pushing` are the faces that have
    /// pushed them to where they are.
    fn push_further(&self, at: &mut [Vec3; LANES], mut pushing: [u32; LANES]) -> [u32; LANES] {
        let (mut next, mut nearest) = (*at, pushing);
        let search = |next: &[Vec3; LANES], nearest: &mut [u32; LANES]| {
            let found = self.closest(next, nearest).item;
            for (lane, nearest) in nearest.iter_mut().enumerate() {
                if next[lane].is_finite() {
                    *nearest = found[lane];
                }
            }
        };
        for iteration in 1..=MAX_ITERATIONS {
            if next.iter().all(|p| !p.is_finite()) {
                return nearest;
            }
            search(&next, &mut nearest);
            pushing = self.closest_pushing_from(&next, nearest, &pushing);
            for (lane, next) in next.iter_mut().enumerate() {
                let hit = self.body.surface.point_on(pushing[lane], *next);
                match hit.and_then(|hit| self.rule.push_out(&hit, *next)) {
                    Some(out) => {
                        *next = next_position(iteration, *next, out);
                        at[lane] = *next;
                    }
                    // NaN takes a lane that is done out of the next searches.
                    None => *next = Vec3::NAN,
                }
            }
        }
        if next.iter().any(|p| p.is_finite()) {
            search(&next, &mut nearest);
        }
        nearest
    }

    /// Does what [`RobustIntersection::sink`] does for all lanes; `faces` are the faces of the body
    /// closest to the positions.
    fn sink(&self, at: &mut [Vec3; LANES], mut faces: [u32; LANES]) {
        let surface = &self.body.surface;
        for _ in 0..MAX_ITERATIONS {
            let intruders: [_; LANES] = std::array::from_fn(|lane| {
                let may_intrude = at[lane].is_finite() && !self.may_push(faces[lane]);
                let hit = may_intrude
                    .then(|| surface.point_on(faces[lane], at[lane]))
                    .flatten();
                hit.filter(|hit| hit.signed_distance < 0.0)
            });
            if intruders.iter().all(Option::is_none) {
                break;
            }
            let mut sinking = [Vec3::NAN; LANES];
            for (lane, _) in intruders.iter().enumerate().filter(|(_, v)| v.is_some()) {
                sinking[lane] = at[lane];
            }
            let beneath = self.closest_pushing(&sinking, &[]).item;
            for (lane, intruder) in intruders.iter().enumerate() {
                let beneath = surface.point_on(beneath[lane], sinking[lane]);
                let around = intruder.as_ref().zip(beneath.as_ref());
                let around = around.map(|(intruder, beneath)| Surroundings { intruder, beneath });
                let step = around
                    .and_then(|around| self.rule.sinking_step(self.body, self.vertex, at[lane], around));
                // NaN takes a lane that has arrived out of the next searches.
                sinking[lane] += step.unwrap_or(Vec3::NAN);
                if step.is_some() {
                    at[lane] = sinking[lane];
                }
            }
            faces = self.closest(&sinking, &[]).item;
        }
    }

    /// Closest faces of the parts that may push.
    fn closest_pushing(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let pushing = self.body.faces_pushing(self.vertex);
        let surface = &self.body.surface;
        surface.closest_of_packet(points, f32::INFINITY, seeds, pushing)
    }

    /// Closest faces of the body.
    fn closest(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let surface = &self.body.surface;
        surface.closest_of_packet(points, f32::INFINITY, seeds, FaceFilter::new(|_| true))
    }
}

/// Faces of the last contacts, one for each lane.
fn seeds<'a>(mut contacts: impl Iterator<Item = &'a Contact>) -> [u32; LANES] {
    std::array::from_fn(|_| contacts.next().map_or(u32::MAX, |contact| contact.face))
}
