//! Which particles an aggregate has, and how far it may be from its neighbours.

use super::{
    Aggregates, Level, Pair, SHARES,
    unfold::{Chart, Unfolder},
};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use unic_core::{mesh::TriMesh, topology::edges};

/// Distance of aggregates on the finest level, in mean edge lengths, and the ratio of one level's
/// to the next finer one's.
const SPACING: f32 = 5.0;
const RATIO: f32 = 4.0;

/// Fewer aggregates than this carry nothing that the level below does not.
const LEAST_COUNT: usize = 8;

/// Reach of an aggregate and of the search for neighbours, in spacings.
const REACH: f32 = 1.5;
const NEIGHBOURS: f32 = 1.8;

/// Give of the limits: what woven cloth stretches under its own weight, and what flattening gets
/// wrong in cloth that cannot be flattened.
const SLACK: f32 = 0.005;

/// Share of an aggregate that must be laid out for its place to be known.
const LAID_OUT: f32 = 0.95;

/// What all levels are built from.
struct Site<'a> {
    mesh: &'a TriMesh,
    masses: &'a [f32],
    is_held: &'a [bool],
    unfolder: Unfolder<'a>,
}

impl Aggregates {
    /// For particles and triangles at rest; `is_held` tells which particles something else places.
    pub(crate) fn build(rest: &TriMesh, masses: &[f32], is_held: &[bool]) -> Self {
        let site = Site {
            mesh: rest,
            masses,
            is_held,
            unfolder: Unfolder::new(rest),
        };
        let mut levels = Vec::new();
        let mut spacing = SPACING * mean_edge(rest);
        let mut count = rest.vertices.len();
        while let Some(level) = site.level(spacing, count) {
            count = level.inverse_masses.len();
            levels.push(level);
            spacing *= RATIO;
        }
        levels.reverse();
        Self { levels }
    }
}

fn mean_edge(mesh: &TriMesh) -> f32 {
    let edges = edges(&mesh.faces);
    let length = |&[a, b]: &[u32; 2]| mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    edges.iter().map(length).sum::<f32>() / edges.len().max(1) as f32
}

/// Aggregates and their shares of one particle.
type Shares = [(u32, f32); SHARES];

impl Site<'_> {
    /// None when there would be too few, or not many less than the `count` of the finer level:
    /// separate parts have one each, however small.
    fn level(&self, spacing: f32, count: usize) -> Option<Level> {
        let seeds = self.seeds(spacing);
        if seeds.len() < LEAST_COUNT || 4 * seeds.len() > count {
            return None;
        }
        let shares = self.shares(&seeds, REACH * spacing);
        let (starts, members, inverse_masses) = self.members(&seeds, &shares);
        let mut level = Level {
            starts,
            members,
            inverse_masses,
            pairs: Vec::new(),
            shares,
        };
        level.pairs = self.pairs(&seeds, spacing, &level);
        Some(level)
    }

    /// Particles about `spacing` apart that leave none farther away; held ones among held ones and
    /// free among free.
    fn seeds(&self, spacing: f32) -> Vec<u32> {
        let mut is_near = vec![false; self.masses.len()];
        let mut chart = Chart::new(self.mesh);
        let mut seeds = Vec::new();
        for particle in 0..self.masses.len() as u32 {
            if is_near[particle as usize] {
                continue;
            }
            seeds.push(particle);
            self.unfolder.lay_out(particle, spacing, &mut chart);
            for &other in &chart.reached {
                let is_alike = self.is_held[other as usize] == self.is_held[particle as usize];
                is_near[other as usize] |= is_alike;
            }
        }
        seeds
    }

    fn shares(&self, seeds: &[u32], reach: f32) -> Vec<Shares> {
        let bump = |distance: f32| (1.0 - (distance / reach).powi(2)).max(0.0).powi(2);
        let around = |chart: &mut Chart, &seed: &u32| -> Vec<(u32, f32)> {
            self.unfolder.lay_out(seed, reach, chart);
            let weight = |&p: &u32| (p, chart.place(p).map_or(0.0, |at| bump(at.length())));
            chart.reached.iter().map(weight).collect()
        };
        let all: Vec<Vec<(u32, f32)>> = (seeds.par_iter())
            .map_init(|| Chart::new(self.mesh), around)
            .collect();
        let mut shares = vec![[(0, 0.0); SHARES]; self.masses.len()];
        for (aggregate, weights) in all.into_iter().enumerate() {
            let holds = self.is_held[seeds[aggregate] as usize];
            for (particle, weight) in weights {
                // Held particles belong to held aggregates alone: those do not move.
                if holds || !self.is_held[particle as usize] {
                    insert(&mut shares[particle as usize], (aggregate as u32, weight));
                }
            }
        }
        shares.iter_mut().for_each(normalise);
        shares
    }

    /// Members of each aggregate with their weights in its mean, and its inverse mass. The mean of
    /// a held aggregate is over held particles, that of a free one over free particles.
    fn members(&self, seeds: &[u32], shares: &[Shares]) -> (Vec<u32>, Vec<(u32, f32)>, Vec<f32>) {
        let mut lists: Vec<Vec<(u32, f32)>> = vec![Vec::new(); seeds.len()];
        for (particle, shares) in shares.iter().enumerate() {
            for &(aggregate, share) in shares.iter().filter(|(_, share)| *share > 0.0) {
                let seed = seeds[aggregate as usize] as usize;
                if self.is_held[seed] == self.is_held[particle] {
                    lists[aggregate as usize].push((particle as u32, share * self.masses[particle]));
                }
            }
        }
        let (mut starts, mut inverse_masses) = (vec![0], Vec::new());
        let mut members = Vec::new();
        for (list, &seed) in lists.iter().zip(seeds) {
            let mass: f32 = list.iter().map(|(_, m)| m).sum();
            let is_free = !self.is_held[seed as usize] && mass > 0.0;
            inverse_masses.push(if is_free { mass.recip() } else { 0.0 });
            members.extend(list.iter().map(|&(p, m)| (p, m / mass)));
            starts.push(members.len() as u32);
        }
        (starts, members, inverse_masses)
    }

    fn pairs(&self, seeds: &[u32], spacing: f32, level: &Level) -> Vec<Pair> {
        let mut aggregate_at = vec![u32::MAX; self.masses.len()];
        for (aggregate, &seed) in seeds.iter().enumerate() {
            aggregate_at[seed as usize] = aggregate as u32;
        }
        let around = |chart: &mut Chart, aggregate: usize| -> Vec<([u32; 2], f32)> {
            let search = Search {
                site: self,
                level,
                spacing,
                chart,
            };
            search.neighbours(aggregate as u32, seeds, &aggregate_at)
        };
        let mut found: Vec<([u32; 2], f32)> = (0..seeds.len())
            .into_par_iter()
            .map_init(|| Chart::new(self.mesh), around)
            .flatten_iter()
            .collect();
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // Seen from both ends, the longer of the two.
        let mut pairs: Vec<Pair> = Vec::with_capacity(found.len() / 2);
        for (ends, limit) in found {
            match pairs.last_mut() {
                Some(last) if last.ends == ends => last.limit = limit,
                _ => pairs.push(Pair { ends, limit }),
            }
        }
        pairs
    }
}

/// Looks for the neighbours of one aggregate.
struct Search<'a> {
    site: &'a Site<'a>,
    level: &'a Level,
    spacing: f32,
    chart: &'a mut Chart,
}

impl Search<'_> {
    fn neighbours(self, aggregate: u32, seeds: &[u32], aggregate_at: &[u32]) -> Vec<([u32; 2], f32)> {
        let reach = (NEIGHBOURS + REACH) * self.spacing;
        self.site
            .unfolder
            .lay_out(seeds[aggregate as usize], reach, self.chart);
        let chart = &*self.chart;
        let Some((flat, place)) = self.centre(aggregate) else {
            return Vec::new();
        };
        let is_near = |p: &u32| {
            let at = chart.place(*p).map_or(f32::INFINITY, Vec2::length);
            aggregate_at[*p as usize] != u32::MAX && at <= NEIGHBOURS * self.spacing
        };
        let others = chart.reached.iter().filter(|p| is_near(p));
        let limit = |&seed: &u32| {
            let other = aggregate_at[seed as usize];
            let masses = [aggregate, other].map(|c| self.level.inverse_masses[c as usize]);
            if other == aggregate || masses == [0.0; 2] || !self.is_whole(chart.place(seed)?) {
                return None;
            }
            let (other_flat, other_place) = self.centre(other)?;
            let length = flat.distance(other_flat).max(place.distance(other_place));
            let ends = [aggregate.min(other), aggregate.max(other)];
            Some((ends, length * (1.0 + SLACK)))
        };
        others.filter_map(limit).collect()
    }

    /// Mean of an aggregate, laid out and in space; none unless nearly all of it is laid out.
    fn centre(&self, aggregate: u32) -> Option<(Vec2, Vec3)> {
        let c = aggregate as usize;
        let members = self.level.starts[c] as usize..self.level.starts[c + 1] as usize;
        let (mut flat, mut place, mut sum) = (Vec2::ZERO, Vec3::ZERO, 0.0);
        for &(particle, weight) in &self.level.members[members] {
            if let Some(at) = self.chart.place(particle) {
                flat += at * weight;
                place += self.site.mesh.vertices[particle as usize] * weight;
                sum += weight;
            }
        }
        (sum > LAID_OUT).then(|| (flat / sum, place / sum))
    }

    /// There is cloth all along the straight line from the origin: around a hole the way is longer
    /// than the line that the layout shows.
    fn is_whole(&self, end: Vec2) -> bool {
        let near = (self.spacing / SPACING * 1.5).powi(2);
        [0.25, 0.5, 0.75].into_iter().all(|t| {
            let point = end * t;
            self.chart
                .laid
                .iter()
                .any(|at| at.distance_squared(point) <= near)
        })
    }
}

/// Keeps the largest weights, sorted from large to small.
fn insert(shares: &mut Shares, mut entry: (u32, f32)) {
    for share in shares.iter_mut() {
        if entry.1 > share.1 {
            std::mem::swap(share, &mut entry);
        }
    }
}

fn normalise(shares: &mut Shares) {
    let sum: f32 = shares.iter().map(|(_, w)| w).sum();
    if sum > 0.0 {
        shares.iter_mut().for_each(|(_, w)| *w /= sum);
    }
}
