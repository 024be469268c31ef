//! Collision detection between particles and the body, at the start of an interval.

use super::{
    fold_filter::FoldFilter,
    limb_filter::LimbFilter,
    settings::MAX_TRACKED_DEPTH_M,
    walk::{FaceAdjacency, NO_FACE},
};
use crate::body::BodyInterval;
use glam::Vec3;
use unic_core::{
    folds::Folds,
    surface::{Surface, SurfacePoint},
};

/// Margin of a particle's reach beyond its straight motion in an interval, metres. It covers the
/// displacement by constraints and gravity.
const SLACK_M: f32 = 0.005;

/// Longest time between two searches of the whole body for a particle in contact, seconds. In
/// between, the particle's projection moves over adjacent faces only, which is much cheaper but
/// does not notice other parts of the body.
const SEARCH_PERIOD_S: f32 = 1.0 / 60.0;

/// Largest depth of a particle inside another part than its own, metres: half a torso.
const PASS_REACH_M: f32 = 0.12;

/// Excess of the distance from its home face over that from the whole body at which a particle has
/// lost its home, metres: it has swung free and come back elsewhere. Arms pass less deep into the
/// torso.
const LOST_M: f32 = 0.08;

/// Largest distance from cloth inside an ignored limb to the covered part that it moves to, metres:
/// the thickness of a forearm and the gap of a loose garment.
const SINK_REACH_M: f32 = 0.12;

/// Cached result of collision detection for one particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactCache {
    /// Face closest to the particle, or the last known one; [`NO_FACE`] when none is known.
    pub(super) face: u32,
    /// True when the particle may touch the body in this interval. `face` is then a face.
    pub(super) is_within_reach: bool,
    /// Lower bound of the distance to any part of the body, metres.
    clearance_m: f32,
    /// Position for which `clearance_m` was computed, metres.
    position: Vec3,
    /// Last measured height over `face` in this interval.
    sample: HeightSample,
    /// Remaining displacement of a particle inside an ignored limb to the covered part beneath it,
    /// metres; zero elsewhere.
    pub(super) sink_offset: Vec3,
    /// Home face of the particle, see [`FoldFilter`]; [`NO_FACE`] when it has none.
    home_face: u32,
    /// True while the particle passes through another part of the body than its own, which it has
    /// entered in a fold.
    pub(super) passes_foreign: bool,
}

/// A measured height of a particle over the part of the body next to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeightSample {
    /// Height over the surface, metres; negative inside.
    pub(super) height_m: f32,
    /// Position of the particle, metres.
    pub(super) position: Vec3,
    /// Fraction of the interval at which the height was measured.
    pub(super) fraction: f32,
}

impl ContactCache {
    pub(super) const UNKNOWN: Self = Self {
        face: NO_FACE,
        is_within_reach: false,
        clearance_m: 0.0,
        position: Vec3::ZERO,
        sample: HeightSample {
            height_m: 0.0,
            position: Vec3::ZERO,
            fraction: 0.0,
        },
        sink_offset: Vec3::ZERO,
        home_face: NO_FACE,
        passes_foreign: false,
    };

    /// Returns the cache of a particle of which only the home face is known.
    pub(super) fn at_home(home_face: u32) -> Self {
        Self {
            home_face,
            ..Self::UNKNOWN
        }
    }

    /// Stores a measured height.
    pub(super) fn record(&mut self, sample: HeightSample) {
        self.sample = sample;
    }

    /// Returns whether the particle is certainly farther than `thickness_m` from the part of the
    /// body next to it, given the motion since the last measurement.
    pub(super) fn is_clear(
        &self,
        position: Vec3,
        fraction: f32,
        motion: &BodyMotion,
        thickness_m: f32,
    ) -> bool {
        let moved = position - self.sample.position;
        let approach_m = motion.max_approach_in_part_m(moved, fraction - self.sample.fraction);
        // False for NaN: the particle is then projected, and its contact ignores NaN.
        self.sample.height_m - approach_m > thickness_m
    }
}

/// Motion of the body in an interval, as a mean displacement and a bound on the rest.
///
/// Bounds relative to the mean are tight for a character that walks: cloth that moves along does
/// not approach it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BodyMotion {
    /// Mean displacement of the body's vertices, metres.
    mean: Vec3,
    /// Largest displacement of a vertex relative to the mean, metres.
    max_relative_m: f32,
}

impl BodyMotion {
    pub(super) fn of(interval: &BodyInterval) -> Self {
        let mean = interval.mean_displacement();
        let max_relative_m = interval.max_relative_displacement_m(mean);
        Self { mean, max_relative_m }
    }

    /// Returns an upper bound of how much the distance between the body and a particle with this
    /// displacement can shrink in the interval, metres.
    fn max_approach_m(&self, displacement: Vec3) -> f32 {
        self.max_approach_in_part_m(displacement, 1.0)
    }

    /// Returns the bound of [`Self::max_approach_m`] for a fraction of the interval.
    fn max_approach_in_part_m(&self, displacement: Vec3, fraction: f32) -> f32 {
        displacement.distance(self.mean * fraction) + self.max_relative_m * fraction
    }
}

/// Inputs of collision detection that all particles share.
pub(super) struct Detection<'a> {
    pub(super) surface: &'a Surface,
    pub(super) adjacency: &'a FaceAdjacency,
    pub(super) limb_filter: &'a LimbFilter,
    pub(super) fold_filter: &'a FoldFilter,
    pub(super) folds: &'a Folds,
    /// The body's vertices at the start of the interval, metres.
    pub(super) start: &'a [Vec3],
    /// Motion of the body in the previous interval.
    pub(super) before: BodyMotion,
    /// Motion of the body in this interval.
    pub(super) motion: BodyMotion,
    pub(super) thickness_m: f32,
    /// Length of the interval, seconds.
    pub(super) seconds: f32,
    /// Number of the interval.
    pub(super) interval: usize,
}

impl Detection<'_> {
    /// Updates the contact cache of the particle `index`.
    pub(super) fn update(&self, cache: &mut ContactCache, index: usize, position: Vec3, velocity: Vec3) {
        // The bound of the last search shrinks by what has moved since. While it exceeds the reach,
        // no search is needed.
        cache.clearance_m -= self.before.max_approach_m(position - cache.position);
        cache.position = position;
        let reach = self.thickness_m + self.motion.max_approach_m(velocity * self.seconds) + SLACK_M;
        if self.limb_filter.ignores(index, cache.face) {
            *cache = ContactCache {
                position,
                home_face: cache.home_face,
                passes_foreign: cache.passes_foreign,
                ..ContactCache::UNKNOWN
            };
        }
        // The index staggers the searches over the intervals, for an even load.
        let period = (SEARCH_PERIOD_S / self.seconds).round().max(1.0) as usize;
        let may_wait = cache.is_within_reach && !(self.interval + index).is_multiple_of(period);
        if may_wait && self.stays_near(cache, position, reach) {
            return;
        }
        cache.is_within_reach = false;
        cache.sink_offset = self.sink_offset(index, position);
        if cache.clearance_m > reach {
            return;
        }
        let home_m = self.follow_home(cache, position);
        // The search also has to find penetrations, which may be deeper than the reach.
        let radius = reach.max(MAX_TRACKED_DEPTH_M);
        let hit = match cache.passes_foreign {
            true => None,
            false => self.closest(cache.face, index, position, radius),
        };
        if let Some(hit) = &hit
            && home_m > hit.distance + LOST_M
        {
            cache.home_face = hit.face;
        }
        let is_foreign = |hit: &SurfacePoint| {
            self.folds.is_face_folded(hit.face) && self.fold_filter.is_foreign(cache.home_face, hit.face)
        };
        if cache.passes_foreign || hit.as_ref().is_some_and(is_foreign) {
            cache.passes_foreign |= hit.is_some_and(|hit| hit.signed_distance < self.thickness_m);
            return self.rest_on_home(cache, position, reach);
        }
        let Some(hit) = hit else {
            (cache.face, cache.clearance_m) = (NO_FACE, radius);
            return;
        };
        // Inside the body the distance to the surface bounds nothing: the next interval must
        // search.
        cache.clearance_m = hit.signed_distance.max(0.0);
        cache.is_within_reach = hit.signed_distance <= reach;
        cache.face = self.face_on_the_same_side(cache.face, position, &hit);
        cache.record(HeightSample {
            height_m: hit.signed_distance,
            position,
            fraction: 0.0,
        });
    }

    /// Moves the home face along with a particle, and updates whether the particle still passes
    /// through another part. Returns the distance from the home face, metres; zero without one.
    fn follow_home(&self, cache: &mut ContactCache, position: Vec3) -> f32 {
        if cache.home_face == NO_FACE {
            return 0.0;
        }
        let home = self.adjacency.walk(self.start, cache.home_face, position);
        cache.home_face = home.face;
        cache.passes_foreign = cache.passes_foreign && self.is_inside_foreign(home.face, position);
        home.distance_m()
    }

    /// Makes the home face the only one that a particle collides with.
    fn rest_on_home(&self, cache: &mut ContactCache, position: Vec3, reach: f32) {
        let projection = self.adjacency.walk(self.start, cache.home_face, position);
        let offset = position - self.adjacency.point(self.start, &projection);
        let along = offset.dot(self.adjacency.normal(self.start, projection.face));
        let height_m = offset.length().copysign(along);
        cache.face = projection.face;
        cache.clearance_m = 0.0;
        cache.is_within_reach = height_m <= reach;
        cache.record(HeightSample {
            height_m,
            position,
            fraction: 0.0,
        });
    }

    /// Returns whether a particle touches the nearest of the parts that are not its own, or is
    /// inside it.
    fn is_inside_foreign(&self, home_face: u32, position: Vec3) -> bool {
        let is_foreign = |face| self.fold_filter.is_foreign(home_face, face);
        let hit = self.surface.closest_where(position, PASS_REACH_M, is_foreign);
        hit.is_some_and(|hit| hit.signed_distance < self.thickness_m)
    }

    /// Moves the cached face along with the particle. Returns whether the particle is outside the
    /// body and within reach of that face.
    fn stays_near(&self, cache: &mut ContactCache, position: Vec3, reach: f32) -> bool {
        let projection = self.adjacency.walk(self.start, cache.face, position);
        let offset = position - self.adjacency.point(self.start, &projection);
        let is_outside = offset.dot(self.adjacency.normal(self.start, projection.face)) > 0.0;
        let stays = is_outside && offset.length() < reach;
        if stays {
            cache.face = projection.face;
            cache.record(HeightSample {
                height_m: offset.length(),
                position,
                fraction: 0.0,
            });
        }
        stays
    }

    /// Returns the displacement of a particle inside an ignored limb to the covered part beneath
    /// it, metres; zero for all other particles.
    fn sink_offset(&self, index: usize, position: Vec3) -> Vec3 {
        if !self.limb_filter.may_contain(position) {
            return Vec3::ZERO;
        }
        let inside = self.surface.closest_within(position, MAX_TRACKED_DEPTH_M);
        let inside =
            inside.filter(|hit| hit.signed_distance < 0.0 && self.limb_filter.ignores(index, hit.face));
        let is_covered = |face| self.limb_filter.is_covered(face);
        let beneath = inside.and_then(|_| self.surface.closest_where(position, SINK_REACH_M, is_covered));
        let Some(hit) = beneath.filter(|hit| hit.signed_distance > self.thickness_m) else {
            return Vec3::ZERO;
        };
        // The displacement ends at the cloth's thickness above the covered part.
        (hit.point - position) * (1.0 - self.thickness_m / hit.distance)
    }

    /// Returns the closest point within `radius` on the faces that the particle collides with.
    /// `seed` is a face near it, or [`NO_FACE`].
    fn closest(&self, seed: u32, index: usize, position: Vec3, radius: f32) -> Option<SurfacePoint> {
        let hit = match seed {
            NO_FACE => self.surface.closest_within(position, radius),
            seed => self.surface.closest_from(position, seed),
        };
        let hit = hit.filter(|hit| hit.distance <= radius)?;
        if !self.limb_filter.ignores(index, hit.face) {
            return Some(hit);
        }
        // Searches with a predicate are slower, and few particles need one.
        let collides = |face| !self.limb_filter.ignores(index, face);
        self.surface.closest_where(position, radius, collides)
    }

    /// Returns the face that pushes the particle out: that of `hit`, or one on the side by which
    /// the particle has entered the body.
    ///
    /// The latter applies to a particle inside the body when the face of `hit` points away from the
    /// `last` face. Through a thin limb the far side is closer, but cloth must not pass through.
    fn face_on_the_same_side(&self, last: u32, position: Vec3, hit: &SurfacePoint) -> u32 {
        if last == NO_FACE || hit.signed_distance >= 0.0 {
            return hit.face;
        }
        let is_opposite = self.adjacency.normal(self.start, last).dot(hit.normal) < 0.0;
        let projection = self.adjacency.walk(self.start, last, position);
        let depth = position.distance(self.adjacency.point(self.start, &projection));
        if is_opposite && depth < MAX_TRACKED_DEPTH_M {
            projection.face
        } else {
            hit.face
        }
    }
}
