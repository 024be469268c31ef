//! Corrections on their way over the garment.

use super::{
    movements::{Movements, clear},
    neighbours::Neighbours,
};
use crate::{bvh::LANES, intersection::packets::Packets, parallel::for_each};
use glam::Vec3;

/// Sweeps of the smoothing: a correction is seen this many edges away.
pub(super) const SWEEPS: usize = 4;

/// Share of its neighbours' mean that a place takes in a sweep.
const SHARE: f32 = 0.7;

/// Movements of places by slot, spread from the corrections that some of them need.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    now: Movements,
    next: Movements,
}

impl Spread {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            now: Movements::new(slots),
            next: Movements::new(slots),
        }
    }

    /// What each place moves by, metres.
    pub(super) fn movements(&self) -> &Movements {
        &self.now
    }

    /// Jacobi sweeps: what has a correction keeps it or moves on along it, what has none goes with
    /// its neighbours.
    pub(super) fn sweep(&mut self, neighbours: &Neighbours, corrections: &Movements) {
        self.now.copy_from(corrections);
        for _ in 0..SWEEPS {
            let Self { now, next } = self;
            let now = &*now;
            let groups = next.groups_mut(Packets::GROUP / LANES);
            for_each(groups, |(first, (next, moving))| {
                for (k, (next, moves)) in next.chunks_mut(LANES).zip(moving).enumerate() {
                    let packet = first + k;
                    let around = neighbours.of_packet(packet);
                    if around.iter().any(|&packet| now.moves(packet)) {
                        for (place, next) in (packet * LANES..).zip(next.iter_mut()) {
                            let mean = neighbours.mean(place, now.by_slot()) * SHARE;
                            *next = carried_along(corrections.of(place), mean);
                        }
                        *moves = next.iter().any(|movement| *movement != Vec3::ZERO);
                    } else {
                        clear(next, moves);
                    }
                }
            });
            std::mem::swap(&mut self.now, &mut self.next);
        }
    }
}

/// A correction beside neighbours that move by `mean`: at least itself, along itself.
fn carried_along(correction: Vec3, mean: Vec3) -> Vec3 {
    let Some(direction) = correction.try_normalize() else {
        return mean;
    };
    let farther = mean.dot(direction) - correction.length();
    correction + direction * farther.max(0.0)
}
