//! All vertices of a garment at once, group by group of [`Packets`].

use super::{Contact, MOST_LOOKS, RobustBody, RobustIntersection, next_place};
use crate::{
    bvh::{LANES, Packet},
    intersection::packets::Packets,
    parallel::for_each_chunk,
    surface::Among,
};
use glam::Vec3;

impl RobustIntersection {
    /// [Looks](Self::look) at the body from the vertices of the garment, by [slot](Packets), those of packets
    /// that are due whose place in `at` is finite; the contacts of the last frame make it faster.
    ///
    /// The same contacts as one by one, but that what is well above the body has a bound for its
    /// height: where the body keeps farther from the middle of a packet than its vertices are, all of
    /// them are on the side of the middle.
    pub(crate) fn look_at_all(
        &self,
        body: &RobustBody,
        at: &[Vec3],
        is_due: impl Fn(usize) -> bool + Sync,
        contacts: &mut [Contact],
    ) {
        for_each_chunk(contacts, Packets::GROUP, |first, contacts| {
            let group = Group {
                rule: *self,
                body,
                vertex: body.parts.packets().vertices()[first] as usize,
            };
            let is_due = |packet| is_due(first / LANES + packet);
            group.look(&at[first..][..contacts.len()], is_due, contacts);
        });
    }
}

/// Vertices that the same parts of the body may push.
struct Group<'a> {
    rule: RobustIntersection,
    body: &'a RobustBody,
    /// One of them.
    vertex: usize,
}

/// A ball around the vertices of a packet, and the body near it.
#[derive(Clone, Copy)]
struct Ball {
    centre: Vec3,
    /// The closest face to the centre, and its height over it.
    face: u32,
    height_m: f32,
}

impl Group<'_> {
    fn look(&self, at: &[Vec3], is_due: impl Fn(usize) -> bool, contacts: &mut [Contact]) {
        if !(0..LANES).any(&is_due) {
            return;
        }
        let balls = self.balls(at, is_due, contacts);
        for ((at, contacts), ball) in at.chunks(LANES).zip(contacts.chunks_mut(LANES)).zip(balls) {
            if ball.centre.is_finite() && !self.are_clear(at, &ball, contacts) {
                self.look_together(at, &ball, contacts);
            }
        }
    }

    /// Around each packet that is due; one without vertices has no centre.
    fn balls(&self, at: &[Vec3], is_due: impl Fn(usize) -> bool, contacts: &[Contact]) -> [Ball; LANES] {
        let mut centres = [Vec3::NAN; LANES];
        let packets = centres.iter_mut().zip(at.chunks(LANES)).enumerate();
        for (_, (centre, at)) in packets.filter(|&(packet, _)| is_due(packet)) {
            let finite = || at.iter().filter(|p| p.is_finite());
            *centre = finite().sum::<Vec3>() / finite().count() as f32;
        }
        let faces = match centres.iter().any(|centre| centre.is_finite()) {
            true => {
                self.nearest(&centres, &seeds::<{ LANES * LANES / 4 }>(contacts))
                    .item
            }
            false => [u32::MAX; LANES],
        };
        // Outside a limb that has sunk into a part that pushes is inside that part.
        let pushing = self.nearest_that_push(&centres, faces);
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
            Ball {
                centre: centres[k],
                face: faces[k],
                // Nothing is known of what has no face near it.
                height_m: height_m.unwrap_or(0.0),
            }
        })
    }

    /// Whether the body reaches none of the vertices, with what is known of them then.
    fn are_clear(&self, positions: &[Vec3], ball: &Ball, contacts: &mut [Contact]) -> bool {
        let height = |p: &Vec3| ball.height_m - p.distance(ball.centre);
        // A place that is NaN has no height, and is nobody's.
        let are_clear = !positions.iter().any(|p| height(p) <= self.rule.margin_m);
        if are_clear {
            for (contact, p) in contacts.iter_mut().zip(positions) {
                *contact = Contact {
                    face: ball.face,
                    height_m: height(p),
                    moved: None,
                };
            }
        }
        are_clear
    }

    fn look_together(&self, positions: &[Vec3], ball: &Ball, contacts: &mut [Contact]) {
        let [a, b, c, d] = seeds::<{ LANES / 4 }>(contacts);
        let found = self.nearest(positions, &[ball.face, a, b, c, d]);
        let mut doubtful = [Vec3::NAN; LANES];
        for (lane, (contact, &p)) in contacts.iter_mut().zip(positions).enumerate() {
            let (distance, face) = (found.squared[lane].sqrt(), found.item[lane]);
            if !p.is_finite() {
                // Not looked for: what is known of it stays.
                contact.moved = None;
            } else if self.is_clear(p, face, distance, ball) {
                *contact = Contact {
                    face,
                    height_m: distance,
                    moved: None,
                };
            } else {
                doubtful[lane] = p;
            }
        }
        if doubtful.iter().any(|p| p.is_finite()) {
            self.touch(&doubtful, found.item, contacts);
        }
    }

    /// The contacts of the lanes with a place; their closest faces of the body.
    fn touch(&self, places: &[Vec3; LANES], nearest: [u32; LANES], contacts: &mut [Contact]) {
        let mut at = *places;
        self.sink(&mut at, nearest);
        let pushing = self.nearest_that_push(&at, nearest);
        let mut moved = [Vec3::NAN; LANES];
        for (lane, contact) in contacts.iter_mut().enumerate() {
            if places[lane].is_finite() {
                let faces = [nearest[lane], pushing[lane]];
                *contact = (self.rule).contact(self.body, self.vertex, [places[lane], at[lane]], faces);
                moved[lane] = contact.moved.unwrap_or(Vec3::NAN);
            }
        }
        if moved.iter().any(|p| p.is_finite()) {
            self.follow(&mut moved, pushing);
            let nearest = self.nearest(&moved, &pushing).item;
            self.sink(&mut moved, nearest);
        }
        for (contact, at) in contacts.iter_mut().zip(moved) {
            if at.is_finite() {
                contact.moved = Some(at);
            }
        }
    }

    /// The closest face that may push each place; `nearest` where that does.
    fn nearest_that_push(&self, at: &[Vec3; LANES], nearest: [u32; LANES]) -> [u32; LANES] {
        let mut asked = *at;
        for (asked, face) in asked.iter_mut().zip(nearest) {
            if self.pushes(face) {
                *asked = Vec3::NAN;
            }
        }
        if asked.iter().all(|p| p.is_nan()) {
            return nearest;
        }
        let found = self.closest(&asked, &nearest).item;
        std::array::from_fn(|lane| match asked[lane].is_finite() {
            true => found[lane],
            false => nearest[lane],
        })
    }

    fn pushes(&self, face: u32) -> bool {
        face != u32::MAX && self.body.parts.face_pushes(face, self.vertex)
    }

    /// Whether a vertex at a distance from the body, on the outer side of its closest face there, is
    /// high enough: the balls around it and around the centre, which the body does not reach, overlap,
    /// and the centre is outside. The centre alone says nothing about a second part of the body that
    /// the vertex is inside of.
    fn is_clear(&self, p: Vec3, face: u32, distance: f32, ball: &Ball) -> bool {
        let overlap_m = ball.height_m + distance - p.distance(ball.centre);
        let is_above = ball.height_m > 0.0 && overlap_m > 0.0 && self.rule.is_high_enough(distance);
        is_above && self.body.surface.is_above(face, p)
    }

    /// Goes on from the first ways out, of the lanes that have one.
    fn follow(&self, at: &mut [Vec3; LANES], mut faces: [u32; LANES]) {
        let mut next = *at;
        for look in 1..=MOST_LOOKS {
            if next.iter().all(|p| !p.is_finite()) {
                break;
            }
            faces = self.closest(&next, &faces).item;
            for (lane, next) in next.iter_mut().enumerate() {
                let hit = self.body.surface.point_on(faces[lane], *next);
                match hit.and_then(|hit| self.rule.way_out(&hit, *next)) {
                    Some(out) => {
                        *next = next_place(look, [*next, out]);
                        at[lane] = *next;
                    }
                    None => *next = Vec3::NAN,
                }
            }
        }
    }

    /// [`RobustIntersection::sink`] for all lanes; `faces` are the closest of the body to the places.
    fn sink(&self, at: &mut [Vec3; LANES], mut faces: [u32; LANES]) {
        let surface = &self.body.surface;
        for _ in 0..MOST_LOOKS {
            let visitors: [_; LANES] = std::array::from_fn(|lane| {
                let is_visitor = at[lane].is_finite() && !self.pushes(faces[lane]);
                let hit = is_visitor
                    .then(|| surface.point_on(faces[lane], at[lane]))
                    .flatten();
                hit.filter(|hit| hit.signed_distance < 0.0)
            });
            if visitors.iter().all(Option::is_none) {
                break;
            }
            let mut sinking = [Vec3::NAN; LANES];
            for (lane, _) in visitors.iter().enumerate().filter(|(_, v)| v.is_some()) {
                sinking[lane] = at[lane];
            }
            let beneath = self.closest(&sinking, &[]).item;
            for (lane, visitor) in visitors.iter().enumerate() {
                let beneath = surface.point_on(beneath[lane], sinking[lane]);
                let pair = visitor.as_ref().zip(beneath.as_ref());
                let way = pair.and_then(|pair| self.rule.way_down(self.body, self.vertex, at[lane], pair));
                sinking[lane] += way.unwrap_or(Vec3::NAN);
                if way.is_some() {
                    at[lane] = sinking[lane];
                }
            }
            faces = self.nearest(&sinking, &[]).item;
        }
    }

    /// The closest faces of the parts that may push.
    fn closest(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let pushing = self.body.pushing(self.vertex);
        let surface = &self.body.surface;
        surface.closest_of_packet(points, f32::INFINITY, seeds, pushing)
    }

    /// The closest faces of the body.
    fn nearest(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let surface = &self.body.surface;
        surface.closest_of_packet(points, f32::INFINITY, seeds, Among::new(|_| true))
    }
}

/// Four of the faces that were found last, one of every so many contacts, without repeating the one before.
fn seeds<const EVERY: usize>(contacts: &[Contact]) -> [u32; 4] {
    let face = |k: usize| contacts.get(k * EVERY).map_or(u32::MAX, |contact| contact.face);
    std::array::from_fn(|k| match k {
        1.. if face(k) == face(k - 1) => u32::MAX,
        _ => face(k),
    })
}
