//! Groups of particles that carry load over distances that single triangles cannot.
//!
//! One sweep over the triangles carries a force across a few of them. A long fine garment would hang
//! like rubber: the column of cloth below holds on by inertia alone, and its upper edge stretches
//! by n g Δt² where n is the number of rows. Aggregates are coarse particles: each a smooth weighted
//! group of particles some edges across, on two levels. Neighbours may not be farther apart than
//! the cloth between them is long; where they are, they pull each other back and take their
//! particles along. Cloth has almost no give under its own weight, so that a limit serves for its
//! stiffness; it says nothing about compression, where cloth buckles.
//!
//! The position of an aggregate is the weighted mean of its particles, and a displacement goes back
//! by the same weights: linear and angular momentum stay as they are.

mod build;
mod unfold;

use crate::Particles;
use glam::Vec3;
use rayon::prelude::*;

/// Sweeps over the pairs of a level each time: they are few.
const SWEEPS: usize = 4;

/// Aggregates that share one particle at most.
const SHARES: usize = 4;

/// All levels, coarsest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Aggregates {
    levels: Vec<Level>,
}

/// Aggregates of one size.
#[derive(Debug, Clone, Default)]
struct Level {
    /// Members of aggregate c are `starts[c]..starts[c + 1]` of `members`, with weights that sum to one.
    starts: Vec<u32>,
    members: Vec<(u32, f32)>,
    /// 1/kg; zero where the members are held.
    inverse_masses: Vec<f32>,
    pairs: Vec<Pair>,
    /// For each particle its aggregates and their shares in it; weightless for held particles.
    shares: Vec<[(u32, f32); SHARES]>,
}

/// Two aggregates with cloth between them.
#[derive(Debug, Clone, Copy)]
struct Pair {
    ends: [u32; 2],
    /// Greatest distance, metres.
    limit: f32,
}

/// Positions of aggregates while they are solved.
#[derive(Debug, Clone, Default)]
pub(crate) struct AggregateScratch {
    start: Vec<Vec3>,
    now: Vec<Vec3>,
}

impl Aggregates {
    pub(crate) fn pair_count(&self) -> usize {
        self.levels.iter().map(|level| level.pairs.len()).sum()
    }

    /// Pulls back what has gone beyond its limit, from the coarsest level to the finest.
    pub(crate) fn solve(&self, particles: &mut Particles, scratch: &mut AggregateScratch) {
        for level in &self.levels {
            level.solve(&mut particles.positions, scratch);
        }
    }
}

impl Level {
    fn solve(&self, positions: &mut [Vec3], scratch: &mut AggregateScratch) {
        let at = |c: usize| self.starts[c] as usize..self.starts[c + 1] as usize;
        let mean = |c: usize| -> Vec3 {
            let members = &self.members[at(c)];
            members.iter().map(|&(p, w)| positions[p as usize] * w).sum()
        };
        (0..self.inverse_masses.len())
            .into_par_iter()
            .with_min_len(256)
            .map(mean)
            .collect_into_vec(&mut scratch.start);
        scratch.now.clone_from(&scratch.start);
        let mut has_moved = false;
        for _ in 0..SWEEPS {
            for pair in &self.pairs {
                has_moved |= pair.pull(&mut scratch.now, &self.inverse_masses);
            }
        }
        if !has_moved {
            return;
        }
        (scratch.now.iter_mut().zip(&scratch.start)).for_each(|(now, start)| *now -= *start);
        let moves = &scratch.now;
        (positions.par_iter_mut().zip(&self.shares))
            .with_min_len(2048)
            .for_each(|(position, shares)| {
                *position += (shares.iter())
                    .map(|&(c, share)| moves[c as usize] * share)
                    .sum::<Vec3>();
            });
    }
}

impl Pair {
    /// True when the two were too far apart.
    fn pull(&self, places: &mut [Vec3], inverse_masses: &[f32]) -> bool {
        let [a, b] = self.ends.map(|c| c as usize);
        let apart = places[b] - places[a];
        let squared = apart.length_squared();
        let mobility = inverse_masses[a] + inverse_masses[b];
        if squared <= self.limit * self.limit || mobility == 0.0 {
            return false;
        }
        let distance = squared.sqrt();
        let step = apart * ((distance - self.limit) / (distance * mobility));
        places[a] += step * inverse_masses[a];
        places[b] -= step * inverse_masses[b];
        true
    }
}

#[cfg(test)]
mod tests;
