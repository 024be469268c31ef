//! Moving points, laid out to be looked at eight at a time.

use crate::lanes::{Lanes, Lanes3, WIDTH};
use glam::Vec3;
use std::ops::Range;

/// Moving points, an axis at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Points {
    /// Number of each.
    indices: Vec<u32>,
    /// Coordinates in metres and velocities in m/s, with room to read [`WIDTH`] from the last one.
    positions: [Vec<f32>; 3],
    velocities: [Vec<f32>; 3],
}

/// A part of space that depends on how fast a point moves.
pub(super) trait Region {
    /// How far points are from the region, metres; none in it is above zero, and NaN is not in it.
    fn excess_m(&self, places: Lanes3, velocities: Lanes3) -> Lanes;
}

impl Points {
    pub(super) fn len(&self) -> usize {
        self.indices.len()
    }

    /// Makes room for so many, all of them nowhere.
    pub(super) fn reset(&mut self, count: usize) {
        self.indices.clear();
        self.indices.resize(count, 0);
        for axis in self.positions.iter_mut().chain(&mut self.velocities) {
            axis.clear();
            axis.resize(count + WIDTH, f32::INFINITY);
        }
    }

    #[inline]
    pub(super) fn set(&mut self, entry: usize, index: u32, position: Vec3, velocity: Vec3) {
        self.indices[entry] = index;
        for axis in 0..3 {
            self.positions[axis][entry] = position[axis];
            self.velocities[axis][entry] = velocity[axis];
        }
    }

    /// Becomes those `entries` of others.
    pub(super) fn select(&mut self, others: &Self, entries: &[u32]) {
        self.reset(entries.len());
        for (entry, &other) in entries.iter().enumerate() {
            let other = other as usize;
            self.indices[entry] = others.indices[other];
            for axis in 0..3 {
                self.positions[axis][entry] = others.positions[axis][other];
                self.velocities[axis][entry] = others.velocities[axis][other];
            }
        }
    }

    #[inline]
    pub(super) fn index(&self, entry: usize) -> u32 {
        self.indices[entry]
    }

    #[cfg(test)]
    pub(super) fn point(&self, entry: usize) -> (Vec3, Vec3) {
        let at = |axes: &[Vec<f32>; 3]| Vec3::from(axes.each_ref().map(|axis| axis[entry]));
        (at(&self.positions), at(&self.velocities))
    }

    /// Appends the entries of a range that are in a region.
    pub(super) fn sieve(&self, range: Range<usize>, region: &impl Region, found: &mut Vec<u32>) {
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn with_avx2(points: &Points, range: Range<usize>, region: &impl Region, found: &mut Vec<u32>) {
                points.sieve_lanes(range, region, found);
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the instructions are there.
                return unsafe { with_avx2(self, range, region, found) };
            }
        }
        self.sieve_lanes(range, region, found);
    }

    #[inline(always)]
    fn sieve_lanes(&self, range: Range<usize>, region: &impl Region, found: &mut Vec<u32>) {
        for first in range.clone().step_by(WIDTH) {
            let places = Lanes3::load(&self.positions, first);
            let excess_m = region.excess_m(places, Lanes3::load(&self.velocities, first));
            let mut inside = excess_m.not_above_zero();
            while inside != 0 {
                let entry = first + inside.trailing_zeros() as usize;
                if entry < range.end {
                    found.push(entry as u32);
                }
                inside &= inside - 1;
            }
        }
    }
}
