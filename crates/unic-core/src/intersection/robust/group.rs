//! All vertices of a garment at once, group by group of [`Packets`].

use super::{Contact, MOST_LOOKS, RobustBody, RobustIntersection};
use crate::{
    bvh::{LANES, Packet},
    intersection::packets::Packets,
    parallel::for_each_chunk,
};
use glam::Vec3;

impl RobustIntersection {
    /// [Looks](Self::look) at the body from the vertices of the garment, by [slot](Packets), those whose
    /// place in `at` is finite; the contacts of the last frame make it faster.
    ///
    /// The same contacts as one by one, but that what is well above the body has a bound for its
    /// height: where the body keeps farther from the middle of a packet than its vertices are, all of
    /// them are on the side of the middle.
    pub(crate) fn look_at_all(&self, body: &RobustBody, at: &[Vec3], contacts: &mut [Contact]) {
        for_each_chunk(contacts, Packets::GROUP, |first, contacts| {
            let group = Group {
                rule: *self,
                body,
                vertex: body.parts.packets().vertices()[first] as usize,
            };
            group.look(&at[first..][..contacts.len()], contacts);
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
    fn look(&self, at: &[Vec3], contacts: &mut [Contact]) {
        let balls = self.balls(at, contacts[0].face);
        for ((at, contacts), ball) in at.chunks(LANES).zip(contacts.chunks_mut(LANES)).zip(balls) {
            if ball.centre.is_finite() && !self.are_clear(at, &ball, contacts) {
                self.look_together(at, &ball, contacts);
            }
        }
    }

    /// Around each packet; one without vertices has no centre.
    fn balls(&self, at: &[Vec3], seed: u32) -> impl Iterator<Item = Ball> {
        let mut centres = [Vec3::NAN; LANES];
        for (centre, at) in centres.iter_mut().zip(at.chunks(LANES)) {
            let finite = || at.iter().filter(|p| p.is_finite());
            *centre = finite().sum::<Vec3>() / finite().count() as f32;
        }
        let faces = match centres.iter().any(|centre| centre.is_finite()) {
            true => self.nearest(&centres, &[seed]).item,
            false => [u32::MAX; LANES],
        };
        centres.into_iter().zip(faces).map(|(centre, face)| Ball {
            centre,
            face,
            // Nothing is known of what has no face near it.
            height_m: (self.body.surface.point_on(face, centre)).map_or(0.0, |hit| hit.signed_distance),
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
        let found = self.nearest(positions, &[ball.face]);
        let mut at = [Vec3::NAN; LANES];
        for (lane, (contact, &p)) in contacts.iter_mut().zip(positions).enumerate() {
            if !p.is_finite() {
                // Not looked for: what is known of it stays.
                contact.moved = None;
                continue;
            }
            let (distance, face) = (found.squared[lane].sqrt(), found.item[lane]);
            *contact = match face {
                u32::MAX => Contact::NONE,
                _ if self.is_clear(p, face, distance, ball) => Contact {
                    face,
                    height_m: distance,
                    moved: None,
                },
                _ => self.rule.touch(self.body, self.vertex, p, face),
            };
            at[lane] = contact.moved.unwrap_or(Vec3::NAN);
        }
        if at.iter().any(|p| p.is_finite()) {
            self.follow(&mut at, found.item);
            self.sink(&mut at, found.item);
        }
        let moved = contacts.iter_mut().filter_map(|contact| contact.moved.as_mut());
        let ways = at.into_iter().filter(|at| at.is_finite());
        moved.zip(ways).for_each(|(moved, at)| *moved = at);
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
        for _ in 1..MOST_LOOKS {
            if next.iter().all(|p| !p.is_finite()) {
                break;
            }
            faces = self.closest(&next, &faces).item;
            for (lane, next) in next.iter_mut().enumerate() {
                let hit = self.body.surface.point_on(faces[lane], *next);
                match hit.and_then(|hit| self.rule.way_out(&hit, *next)) {
                    Some(out) => (at[lane], *next) = (out, out),
                    None => *next = Vec3::NAN,
                }
            }
        }
    }

    /// Out of the parts of the body that the ways out led into but that may not push.
    fn sink(&self, at: &mut [Vec3; LANES], faces: [u32; LANES]) {
        let nearest = self.nearest(at, &faces).item;
        for (at, face) in at.iter_mut().zip(nearest).filter(|(at, _)| at.is_finite()) {
            *at = self.rule.sink(self.body, self.vertex, *at, face);
        }
    }

    /// The closest faces of the parts that may push.
    fn closest(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let parts = &self.body.parts;
        let mut packet = Packet::new(points, f32::INFINITY);
        let counts = |face| parts.face_pushes(face, self.vertex);
        self.body.surface.closest_of_packet(&mut packet, seeds, counts);
        packet
    }

    /// The closest faces of the body.
    fn nearest(&self, points: &[Vec3], seeds: &[u32]) -> Packet {
        let mut packet = Packet::new(points, f32::INFINITY);
        self.body.surface.closest_of_packet(&mut packet, seeds, |_| true);
        packet
    }
}
