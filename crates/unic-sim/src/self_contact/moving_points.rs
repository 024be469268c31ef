//! Moving points in structure-of-arrays layout, for culling eight at a time.

use crate::simd::{F32x8, LANES, Vec3x8};
use glam::Vec3;
use std::ops::Range;

/// Moving points, one array per axis.
#[derive(Clone, Debug, Default)]
pub(super) struct MovingPoints {
    /// Index of each point's particle.
    indices: Vec<u32>,
    /// Coordinates per axis, metres. All arrays have [`LANES`] extra entries, so that a whole
    /// vector can be loaded from any point on.
    positions: [Vec<f32>; 3],
    /// Velocities per axis, m/s.
    velocities: [Vec<f32>; 3],
}

/// A part of space that is larger for points that move faster.
pub(super) trait CullVolume {
    /// Returns a value for each point that is at most zero inside the volume and positive outside,
    /// metres; NaN counts as outside.
    fn outside_m(&self, positions: Vec3x8, velocities: Vec3x8) -> F32x8;
}

impl MovingPoints {
    pub(super) fn len(&self) -> usize {
        self.indices.len()
    }

    /// Resizes to `count` points, all at infinity.
    pub(super) fn reset(&mut self, count: usize) {
        self.indices.clear();
        self.indices.resize(count, 0);
        for axis in self.positions.iter_mut().chain(&mut self.velocities) {
            axis.clear();
            axis.resize(count + LANES, f32::INFINITY);
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

    /// Replaces the points by some entries of another list.
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

    /// Returns the position and the velocity of an entry.
    #[cfg(test)]
    pub(super) fn point(&self, entry: usize) -> (Vec3, Vec3) {
        let at = |axes: &[Vec<f32>; 3]| Vec3::from(axes.each_ref().map(|axis| axis[entry]));
        (at(&self.positions), at(&self.velocities))
    }

    /// Appends those entries of a range to `found` that are inside a volume.
    pub(super) fn cull(&self, range: Range<usize>, volume: &impl CullVolume, found: &mut Vec<u32>) {
        #[cfg(target_arch = "x86_64")]
        {
            // The same code, compiled once more for 256-bit registers, with the same bits.
            #[target_feature(enable = "avx2")]
            fn with_avx2(
                points: &MovingPoints,
                range: Range<usize>,
                volume: &impl CullVolume,
                found: &mut Vec<u32>,
            ) {
                points.cull_lanes(range, volume, found);
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature was detected.
                return unsafe { with_avx2(self, range, volume, found) };
            }
        }
        self.cull_lanes(range, volume, found);
    }

    #[inline(always)]
    fn cull_lanes(&self, range: Range<usize>, volume: &impl CullVolume, found: &mut Vec<u32>) {
        for first in range.clone().step_by(LANES) {
            let positions = Vec3x8::load(&self.positions, first);
            let outside_m = volume.outside_m(positions, Vec3x8::load(&self.velocities, first));
            let mut inside = outside_m.not_above_zero();
            // One turn per bit that is set. The last vector may reach beyond the range.
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
