//! Long-range limits: distance limits between coarse particles, which carry load over distances
//! that single triangles cannot.
//!
//! One sweep over the triangles carries a force across a few of them. The weight of a long fine
//! garment would be held by inertia alone: its upper edge would stretch by n g Δt², where n is the
//! number of rows. Coarse particles prevent that. Each is a smoothly weighted group of particles
//! some edges across, on one or more levels of size.
//!
//! Two neighbouring coarse particles may not be farther apart than the cloth between them is long.
//! Where they are, both are pulled back and take their particles along. The limits act on tension
//! only, because cloth buckles under compression. They are nearly rigid, because cloth hardly
//! stretches under its own weight.
//!
//! The position of a coarse particle is the weighted mean of its particles. A displacement is
//! distributed to the particles with the same weights, so that linear and angular momentum are
//! conserved.

mod build;
mod flatten;

use crate::Particles;
use glam::Vec3;
use rayon::prelude::*;

/// Sweeps over the limits of a level in each substep. Limits are few, so that several sweeps are
/// cheap, and each carries tension farther.
const SWEEPS: usize = 4;

/// Largest number of coarse particles that share one particle.
const MAX_SHARES: usize = 4;

/// The distance limits of all levels, coarsest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct LongRangeLimits {
    levels: Vec<CoarseLevel>,
}

/// Coarse particles of one size.
#[derive(Debug, Clone, Default)]
struct CoarseLevel {
    /// Row starts of `members`: the particles of coarse particle c are
    /// `members[starts[c]..starts[c + 1]]`.
    starts: Vec<u32>,
    /// Particles with their weights in the mean, which sum to one for each coarse particle.
    members: Vec<Weighted>,
    /// Inverse mass of each coarse particle, 1/kg; zero where its particles are held.
    inverse_masses: Vec<f32>,
    limits: Vec<DistanceLimit>,
    /// Coarse particles of each particle, with the share of their displacement that it takes.
    shares: Vec<Shares>,
}

/// An index with a weight.
#[derive(Debug, Clone, Copy, Default)]
struct Weighted {
    index: u32,
    weight: f32,
}

/// The coarse particles that share one particle, of falling weight. The weights sum to one; unused
/// entries have weight zero.
type Shares = [Weighted; MAX_SHARES];

/// An upper limit of the distance between two coarse particles.
#[derive(Debug, Clone, Copy)]
struct DistanceLimit {
    /// Indices of the two coarse particles, lower first.
    ends: [u32; 2],
    /// Largest distance, metres.
    max_distance: f32,
}

/// Positions of the coarse particles of a level, in metres; scratch of [`LongRangeLimits::solve`].
#[derive(Debug, Clone, Default)]
pub(crate) struct LongRangeScratch {
    /// Positions before the sweeps.
    start: Vec<Vec3>,
    /// Positions during the sweeps, then displacements.
    now: Vec<Vec3>,
}

impl LongRangeLimits {
    /// Returns the number of distance limits on all levels.
    pub(crate) fn limit_count(&self) -> usize {
        self.levels.iter().map(|level| level.limits.len()).sum()
    }

    /// Projects all limits, from the coarsest level to the finest.
    pub(crate) fn solve(&self, particles: &mut Particles, scratch: &mut LongRangeScratch) {
        for level in &self.levels {
            level.solve(&mut particles.positions, scratch);
        }
    }
}

impl CoarseLevel {
    fn solve(&self, positions: &mut [Vec3], scratch: &mut LongRangeScratch) {
        let row = |c: usize| self.starts[c] as usize..self.starts[c + 1] as usize;
        let mean = |c: usize| -> Vec3 {
            let members = self.members[row(c)].iter();
            members.map(|m| positions[m.index as usize] * m.weight).sum()
        };
        // Each mean is summed by one thread in a fixed order, so that threads do not change the
        // bits.
        (0..self.inverse_masses.len())
            .into_par_iter()
            .with_min_len(256)
            .map(mean)
            .collect_into_vec(&mut scratch.start);
        scratch.now.clone_from(&scratch.start);
        let mut has_moved = false;
        // On one thread: limits share coarse particles, and the order decides the result.
        for _ in 0..SWEEPS {
            for limit in &self.limits {
                has_moved |= limit.project(&mut scratch.now, &self.inverse_masses);
            }
        }
        // Cloth that is not stretched keeps its bits, and costs no pass over the particles.
        if !has_moved {
            return;
        }
        (scratch.now.iter_mut().zip(&scratch.start)).for_each(|(now, start)| *now -= *start);
        // Gathered per particle instead of scattered per coarse particle: no two threads write to
        // one particle.
        let displacements = &scratch.now;
        (positions.par_iter_mut().zip(&self.shares))
            .with_min_len(2048)
            .for_each(|(position, shares)| {
                *position += (shares.iter())
                    .map(|share| displacements[share.index as usize] * share.weight)
                    .sum::<Vec3>();
            });
    }
}

impl DistanceLimit {
    /// Pulls the two coarse particles together if they are too far apart. Returns whether they
    /// were.
    fn project(&self, positions: &mut [Vec3], inverse_masses: &[f32]) -> bool {
        let [a, b] = self.ends.map(|c| c as usize);
        let apart = positions[b] - positions[a];
        let squared = apart.length_squared();
        let mobility = inverse_masses[a] + inverse_masses[b];

        if squared <= self.max_distance * self.max_distance || mobility == 0.0 {
            return false;
        }
        let distance = squared.sqrt();
        let step = apart * ((distance - self.max_distance) / (distance * mobility));
        positions[a] += step * inverse_masses[a];
        positions[b] -= step * inverse_masses[b];
        true
    }
}

#[cfg(test)]
mod tests;
