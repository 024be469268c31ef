//! Corrections on their way over the garment.

use super::neighbours::Neighbours;
use crate::{bvh::LANES, intersection::packets::Packets, parallel::for_each_chunk};
use glam::Vec3;

/// Sweeps of the smoothing: a correction is seen this many edges away.
pub(super) const SWEEPS: usize = 4;

/// Share of its neighbours' mean that a place takes in a sweep.
const SHARE: f32 = 0.7;

/// Movements of places by slot, spread from the corrections that some of them need.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    now: Vec<Vec3>,
    next: Vec<Vec3>,
    /// By packet: does anything in it move?
    moves: Vec<bool>,
}

impl Spread {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            now: vec![Vec3::ZERO; slots],
            next: vec![Vec3::ZERO; slots],
            moves: vec![false; slots / LANES],
        }
    }

    /// What each place moves by, metres.
    pub(super) fn movements(&self) -> &[Vec3] {
        &self.now
    }

    /// Jacobi sweeps: what has a correction keeps it or moves on along it, what has none goes with
    /// its neighbours.
    pub(super) fn sweep(&mut self, neighbours: &Neighbours, corrections: &[Vec3]) {
        self.now.copy_from_slice(corrections);
        for _ in 0..SWEEPS {
            self.find_moving();
            let Self { now, next, moves } = self;
            for_each_chunk(next, Packets::GROUP, |first, next| {
                for (k, next) in next.chunks_mut(LANES).enumerate() {
                    let first = first + k * LANES;
                    let around = neighbours.of_packet(first / LANES);
                    if around.iter().any(|&packet| moves[packet as usize]) {
                        for (place, next) in (first..).zip(next) {
                            let mean = neighbours.mean(place, now) * SHARE;
                            *next = carried_along(corrections[place], mean);
                        }
                    } else {
                        next.fill(Vec3::ZERO);
                    }
                }
            });
            std::mem::swap(now, next);
        }
    }

    fn find_moving(&mut self) {
        let moves = |packet: &[Vec3]| packet.iter().any(|movement| *movement != Vec3::ZERO);
        let packets = self.now.chunks(LANES).zip(&mut self.moves);
        packets.for_each(|(packet, moving)| *moving = moves(packet));
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
