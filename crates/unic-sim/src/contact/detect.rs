//! What a particle can touch in an interval.

use super::{
    SIDE_DEPTH_M,
    visitors::Visitors,
    walk::{FaceGraph, NO_FACE},
};
use crate::body::BodyInterval;
use glam::Vec3;
use unic_core::surface::{Surface, SurfacePoint};

/// How far beyond straight motion a particle may get within an interval, metres: what
/// constraints and gravity add.
const SLACK_M: f32 = 0.005;

/// The whole body is searched at least this often for a particle that already touches some part of
/// it, seconds; in between, its foot walks over that part.
const SEARCH_PERIOD_S: f32 = 1.0 / 60.0;

/// Cloth inside a limb that passes through it is drawn to dressed parts this close, metres: a forearm
/// and the width that a garment hangs off.
const SINK_REACH_M: f32 = 0.12;

/// What a particle remembers of the body near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearby {
    /// The face under it, or the one that was; [`NO_FACE`] when none is known.
    pub(super) face: u32,
    /// It may touch the body in this interval: `face` is a face.
    pub(super) is_within_reach: bool,
    /// No part of the body is closer than this, metres.
    clearance_m: f32,
    /// Where it was when that was so.
    position: Vec3,
    /// What the last look at `face` within the interval saw.
    seen: Sight,
    /// From a particle inside a limb that passes through the cloth to the dressed part beneath it,
    /// metres; zero elsewhere.
    pub(super) sink: Vec3,
}

/// A particle over the part of the body that it is near.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// Over the surface, metres; negative inside.
    pub(super) height_m: f32,
    pub(super) position: Vec3,
    /// Of the interval.
    pub(super) fraction: f32,
}

impl Nearby {
    pub(super) const UNKNOWN: Self = Self {
        face: NO_FACE,
        is_within_reach: false,
        clearance_m: 0.0,
        position: Vec3::ZERO,
        seen: Sight {
            height_m: 0.0,
            position: Vec3::ZERO,
            fraction: 0.0,
        },
        sink: Vec3::ZERO,
    };

    /// Records a look at the surface.
    pub(super) fn see(&mut self, sight: Sight) {
        self.seen = sight;
    }

    /// Whether the particle is still farther than `thickness_m` from what it saw, however the
    /// surface has moved since.
    pub(super) fn is_clear(
        &self,
        position: Vec3,
        fraction: f32,
        motion: &BodyMotion,
        thickness_m: f32,
    ) -> bool {
        let way = position - self.seen.position;
        let approach_m = motion.approach_in_part_m(way, fraction - self.seen.fraction);
        self.seen.height_m - approach_m > thickness_m
    }
}

/// How the body moves in an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BodyMotion {
    /// Of the body as a whole, metres.
    drift: Vec3,
    /// Farthest way of a vertex beside that, metres.
    travel_m: f32,
}

impl BodyMotion {
    pub(super) fn of(interval: &BodyInterval) -> Self {
        let drift = interval.drift();
        let travel_m = interval.travel_m(drift);
        Self { drift, travel_m }
    }

    /// Most that a particle on this way and a part of the body come nearer to each other, metres:
    /// cloth that walks along with the body does not approach it.
    fn approach_m(&self, way: Vec3) -> f32 {
        self.approach_in_part_m(way, 1.0)
    }

    /// The same in a fraction of the interval.
    fn approach_in_part_m(&self, way: Vec3, fraction: f32) -> f32 {
        way.distance(self.drift * fraction) + self.travel_m * fraction
    }
}

/// The search at the start of an interval.
pub(super) struct Detection<'a> {
    pub(super) surface: &'a Surface,
    pub(super) graph: &'a FaceGraph,
    pub(super) visitors: &'a Visitors,
    /// The body's vertices at the start.
    pub(super) start: &'a [Vec3],
    /// In the interval before.
    pub(super) before: BodyMotion,
    /// In this one.
    pub(super) motion: BodyMotion,
    pub(super) thickness_m: f32,
    pub(super) seconds: f32,
    /// Number of the interval.
    pub(super) interval: usize,
}

impl Detection<'_> {
    /// Takes the particle's number, so that not all search the whole body in the same interval.
    pub(super) fn update(&self, nearby: &mut Nearby, index: usize, position: Vec3, velocity: Vec3) {
        nearby.clearance_m -= self.before.approach_m(position - nearby.position);
        nearby.position = position;
        let reach = self.thickness_m + self.motion.approach_m(velocity * self.seconds) + SLACK_M;
        if self.visitors.pass(index, nearby.face) {
            *nearby = Nearby {
                position,
                ..Nearby::UNKNOWN
            };
        }
        let period = (SEARCH_PERIOD_S / self.seconds).round().max(1.0) as usize;
        let may_wait = nearby.is_within_reach && !(self.interval + index).is_multiple_of(period);
        if may_wait && self.stays_near(nearby, position, reach) {
            return;
        }
        nearby.is_within_reach = false;
        nearby.sink = self.sink(index, position);
        if nearby.clearance_m > reach {
            return;
        }
        let radius = reach.max(SIDE_DEPTH_M);
        let Some(hit) = self.closest(nearby.face, index, position, radius) else {
            (nearby.face, nearby.clearance_m) = (NO_FACE, radius);
            return;
        };
        nearby.clearance_m = hit.signed_distance.max(0.0);
        nearby.is_within_reach = hit.signed_distance <= reach;
        nearby.face = self.face_on_the_same_side(nearby.face, position, &hit);
        nearby.see(Sight {
            height_m: hit.signed_distance,
            position,
            fraction: 0.0,
        });
    }

    /// Whether a particle is outside and within reach of the part that it was near.
    fn stays_near(&self, nearby: &mut Nearby, position: Vec3, reach: f32) -> bool {
        let foot = self.graph.walk(self.start, nearby.face, position);
        let offset = position - self.graph.point(self.start, &foot);
        let is_outside = offset.dot(self.graph.normal(self.start, foot.face)) > 0.0;
        let stays = is_outside && offset.length() < reach;
        if stays {
            nearby.face = foot.face;
            nearby.see(Sight {
                height_m: offset.length(),
                position,
                fraction: 0.0,
            });
        }
        stays
    }

    /// The way to the dressed part beneath a limb that passes through the cloth here.
    fn sink(&self, index: usize, position: Vec3) -> Vec3 {
        if !self.visitors.may_hold(position) {
            return Vec3::ZERO;
        }
        let inside = self.surface.closest_within(position, SIDE_DEPTH_M);
        let inside = inside.filter(|hit| hit.signed_distance < 0.0 && self.visitors.pass(index, hit.face));
        let is_dressed = |face| self.visitors.is_dressed(face);
        let beneath = inside.and_then(|_| self.surface.closest_where(position, SINK_REACH_M, is_dressed));
        let Some(hit) = beneath.filter(|hit| hit.signed_distance > self.thickness_m) else {
            return Vec3::ZERO;
        };
        (hit.point - position) * (1.0 - self.thickness_m / hit.distance)
    }

    fn closest(&self, seed: u32, index: usize, position: Vec3, radius: f32) -> Option<SurfacePoint> {
        let hit = match seed {
            NO_FACE => self.surface.closest_within(position, radius),
            seed => self.surface.closest_from(position, seed),
        };
        let hit = hit.filter(|hit| hit.distance <= radius)?;
        if !self.visitors.pass(index, hit.face) {
            return Some(hit);
        }
        let stops = |face| !self.visitors.pass(index, face);
        self.surface.closest_where(position, radius, stops)
    }

    /// The face of `hit`, unless the particle is inside the body and that face looks away from the
    /// side by which it came: then the nearest one on that side.
    fn face_on_the_same_side(&self, last: u32, position: Vec3, hit: &SurfacePoint) -> u32 {
        if last == NO_FACE || hit.signed_distance >= 0.0 {
            return hit.face;
        }
        let turned = self.graph.normal(self.start, last).dot(hit.normal) < 0.0;
        let foot = self.graph.walk(self.start, last, position);
        let depth = position.distance(self.graph.point(self.start, &foot));
        if turned && depth < SIDE_DEPTH_M {
            foot.face
        } else {
            hit.face
        }
    }
}
