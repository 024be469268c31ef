//! Smoothing of corrections over the garment.

use super::{
    corrections::{Corrections, clear_packet},
    neighbours::Neighbours,
};
use crate::{aabb_tree::LANES, intersection::packets::Packets, parallel::for_each};
use glam::Vec3;

/// Number of sweeps: a correction reaches vertices this many edges away.
pub(super) const SWEEPS: usize = 4;

/// Fraction of the mean displacement of its neighbours that a vertex takes in a sweep.
const NEIGHBOUR_FRACTION: f32 = 0.7;

/// Displacements of vertices by slot, spread from the corrections that some of them need.
#[derive(Clone, Debug)]
pub(super) struct Smoothing {
    current: Corrections,
    next: Corrections,
}

impl Smoothing {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            current: Corrections::new(slots),
            next: Corrections::new(slots),
        }
    }

    /// Smoothed displacements, metres.
    pub(super) fn displacements(&self) -> &Corrections {
        &self.current
    }

    /// Spreads corrections by Jacobi sweeps. A corrected vertex moves by its correction, or farther
    /// in the same direction; any other vertex moves with its neighbours.
    // Jacobi and not Gauss-Seidel: the result must not depend on the order of the vertices or
    // threads.
    pub(super) fn spread(&mut self, neighbours: &Neighbours, corrections: &Corrections) {
        self.current.copy_from(corrections);
        for _ in 0..SWEEPS {
            let Self { current, next } = self;
            let current = &*current;
            let groups = next.groups_mut(Packets::GROUP / LANES);
            for_each(groups, |(first, (next, is_active))| {
                for (k, (next, is_active)) in next.chunks_mut(LANES).zip(is_active).enumerate() {
                    let packet = first + k;
                    let around = neighbours.of_packet(packet);
                    if around.iter().any(|&packet| current.is_active(packet)) {
                        for (slot, next) in (packet * LANES..).zip(next.iter_mut()) {
                            let mean = neighbours.mean(slot, current.by_slot()) * NEIGHBOUR_FRACTION;
                            *next = at_least(corrections.at(slot), mean);
                        }
                        *is_active = next.iter().any(|displacement| *displacement != Vec3::ZERO);
                    } else {
                        clear_packet(next, is_active);
                    }
                }
            });
            std::mem::swap(&mut self.current, &mut self.next);
        }
    }
}

/// Displacement of a vertex whose neighbours move by `mean`: at least its correction, and along it.
fn at_least(correction: Vec3, mean: Vec3) -> Vec3 {
    let Some(direction) = correction.try_normalize() else {
        return mean;
    };
    let excess = mean.dot(direction) - correction.length();
    correction + direction * excess.max(0.0)
}
