//! Construction of the coarse particles and of the distance limits between them.

use super::{
    CoarseLevel, DistanceLimit, LongRangeLimits, Shares, Weighted,
    flatten::{Chart, Flattener},
};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use unic_core::{mesh::TriMesh, topology::edges};

/// Distance between coarse particles on the finest level, in mean edge lengths.
const SPACING: f32 = 5.0;

/// Ratio of the distance on one level to that on the next finer level.
const RATIO: f32 = 4.0;

/// Smallest number of coarse particles on a level. Fewer carry no load that the finer level does
/// not carry.
const LEAST_COUNT: usize = 8;

/// Radius of a coarse particle, in spacings. Above 1, so that neighbours overlap and their
/// displacements blend smoothly.
const REACH: f32 = 1.5;

/// Largest distance between the seeds of two neighbours, in spacings.
const NEIGHBOURS: f32 = 1.8;

/// Relative tolerance of the distance limits. It covers the stretch of woven cloth under its own
/// weight, and the error of flattening cloth that is not developable.
const SLACK: f32 = 0.005;

/// Weight of a coarse particle's members that must be in a chart for its mean to be used.
const LEAST_COVERED_WEIGHT: f32 = 0.95;

/// Inputs from which all levels are built.
struct LevelBuilder<'a> {
    /// Particles and triangles at rest.
    mesh: &'a TriMesh,
    masses: &'a [f32],
    is_held: &'a [bool],
    flattener: Flattener<'a>,
}

impl LongRangeLimits {
    /// Builds all levels for particles and triangles at rest.
    ///
    /// `masses` are in kilograms. `is_held` marks particles that are pinned or attached, which the
    /// limits do not move.
    pub(crate) fn build(rest: &TriMesh, masses: &[f32], is_held: &[bool]) -> Self {
        let builder = LevelBuilder {
            mesh: rest,
            masses,
            is_held,
            flattener: Flattener::new(rest),
        };
        let mut levels = Vec::new();
        let mut spacing = SPACING * mean_edge(rest);
        let mut count = rest.vertices.len();
        while let Some(level) = builder.level(spacing, count) {
            count = level.inverse_masses.len();
            levels.push(level);
            spacing *= RATIO;
        }
        levels.reverse();
        Self { levels }
    }
}

/// Returns the mean edge length, metres.
fn mean_edge(mesh: &TriMesh) -> f32 {
    let edges = edges(&mesh.faces);
    let length = |&[a, b]: &[u32; 2]| mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    edges.iter().map(length).sum::<f32>() / edges.len().max(1) as f32
}

impl LevelBuilder<'_> {
    /// Builds the level of coarse particles `spacing` metres apart. `count` is the number of
    /// particles on the next finer level.
    ///
    /// Returns `None` when there would be too few coarse particles, or more than a quarter of
    /// `count`. Separate parts of a mesh have at least one each, so that their number stops falling
    /// at some level.
    fn level(&self, spacing: f32, count: usize) -> Option<CoarseLevel> {
        let seeds = self.seeds(spacing);
        if seeds.len() < LEAST_COUNT || 4 * seeds.len() > count {
            return None;
        }
        let shares = self.shares(&seeds, REACH * spacing);
        let mut level = self.members(&seeds, shares);
        level.limits = self.limits(&seeds, spacing, &level);
        Some(level)
    }

    /// Selects the particles around which coarse particles are made.
    ///
    /// Every free particle is within `spacing` metres of a free seed, and every held particle
    /// within `spacing` of a held one.
    fn seeds(&self, spacing: f32) -> Vec<u32> {
        let mut is_near = vec![false; self.masses.len()];
        let mut chart = Chart::new(self.mesh);
        let mut seeds = Vec::new();
        for particle in 0..self.masses.len() as u32 {
            if is_near[particle as usize] {
                continue;
            }
            seeds.push(particle);
            self.flattener.flatten(particle, spacing, &mut chart);
            for &other in &chart.reached {
                let is_same_kind = self.is_held[other as usize] == self.is_held[particle as usize];
                is_near[other as usize] |= is_same_kind;
            }
        }
        seeds
    }

    /// Computes the shares of every particle in the coarse particles within `reach` metres.
    fn shares(&self, seeds: &[u32], reach: f32) -> Vec<Shares> {
        // A smooth bump, of value and slope zero at the edge of the coarse particle.
        let bump = |distance: f32| (1.0 - (distance / reach).powi(2)).max(0.0).powi(2);
        let around = |chart: &mut Chart, &seed: &u32| -> Vec<Weighted> {
            self.flattener.flatten(seed, reach, chart);
            let weighted = |&index: &u32| Weighted {
                index,
                weight: chart.position(index).map_or(0.0, |at| bump(at.length())),
            };
            chart.reached.iter().map(weighted).collect()
        };
        let all: Vec<Vec<Weighted>> = (seeds.par_iter())
            .map_init(|| Chart::new(self.mesh), around)
            .collect();
        let mut shares = vec![Shares::default(); self.masses.len()];
        for (coarse, members) in all.into_iter().enumerate() {
            let is_held = self.is_held[seeds[coarse] as usize];
            for member in members {
                let particle = member.index as usize;
                // Held coarse particles do not move. A held particle belongs to no others, so that
                // it does not move either.
                if is_held || !self.is_held[particle] {
                    let share = Weighted {
                        index: coarse as u32,
                        weight: member.weight,
                    };
                    insert(&mut shares[particle], share);
                }
            }
        }
        shares.iter_mut().for_each(normalise);
        shares
    }

    /// Collects the members of each coarse particle, with weights, and its inverse mass. Makes a
    /// level without limits.
    ///
    /// The mean of a held coarse particle is over held particles, that of a free one over free
    /// particles.
    fn members(&self, seeds: &[u32], shares: Vec<Shares>) -> CoarseLevel {
        let mut lists: Vec<Vec<Weighted>> = vec![Vec::new(); seeds.len()];
        for (particle, shares) in shares.iter().enumerate() {
            for share in shares.iter().filter(|share| share.weight > 0.0) {
                let seed = seeds[share.index as usize] as usize;
                if self.is_held[seed] == self.is_held[particle] {
                    lists[share.index as usize].push(Weighted {
                        index: particle as u32,
                        weight: share.weight * self.masses[particle],
                    });
                }
            }
        }
        let (mut starts, mut inverse_masses) = (vec![0], Vec::new());
        let mut members = Vec::new();
        for (list, &seed) in lists.iter().zip(seeds) {
            let mass: f32 = list.iter().map(|member| member.weight).sum();
            let is_free = !self.is_held[seed as usize] && mass > 0.0;
            inverse_masses.push(if is_free { mass.recip() } else { 0.0 });
            members.extend(list.iter().map(|member| Weighted {
                index: member.index,
                weight: member.weight / mass,
            }));
            starts.push(members.len() as u32);
        }
        CoarseLevel {
            starts,
            members,
            inverse_masses,
            limits: Vec::new(),
            shares,
        }
    }

    /// Computes the distance limits between neighbouring coarse particles of a level.
    fn limits(&self, seeds: &[u32], spacing: f32, level: &CoarseLevel) -> Vec<DistanceLimit> {
        let mut coarse_at = vec![u32::MAX; self.masses.len()];
        for (coarse, &seed) in seeds.iter().enumerate() {
            coarse_at[seed as usize] = coarse as u32;
        }
        let around = |chart: &mut Chart, coarse: usize| -> Vec<DistanceLimit> {
            let search = NeighbourSearch {
                builder: self,
                level,
                spacing,
                chart,
            };
            search.limits(coarse as u32, seeds, &coarse_at)
        };
        let mut found: Vec<DistanceLimit> = (0..seeds.len())
            .into_par_iter()
            .map_init(|| Chart::new(self.mesh), around)
            .flatten_iter()
            .collect();
        found.sort_by(|a, b| {
            let by_ends = a.ends.cmp(&b.ends);
            by_ends.then(a.max_distance.total_cmp(&b.max_distance))
        });
        // Most pairs are found from both ends, in two charts. The longer distance wins: a limit
        // that is too short would contract cloth at rest.
        let mut limits: Vec<DistanceLimit> = Vec::with_capacity(found.len() / 2);
        for limit in found {
            match limits.last_mut() {
                Some(last) if last.ends == limit.ends => *last = limit,
                _ => limits.push(limit),
            }
        }
        limits
    }
}

/// The search for the neighbours of one coarse particle.
struct NeighbourSearch<'a> {
    builder: &'a LevelBuilder<'a>,
    level: &'a CoarseLevel,
    spacing: f32,
    chart: &'a mut Chart,
}

/// The mean position of a coarse particle at rest, metres.
struct Centre {
    /// Position in the chart.
    flat: Vec2,
    /// Position in space.
    spatial: Vec3,
}

impl NeighbourSearch<'_> {
    /// Lists the distance limits of the coarse particle `coarse`. `coarse_at` maps each seed to its
    /// coarse particle and all other particles to `u32::MAX`.
    fn limits(self, coarse: u32, seeds: &[u32], coarse_at: &[u32]) -> Vec<DistanceLimit> {
        // Large enough to contain all members of the farthest neighbour.
        let reach = (NEIGHBOURS + REACH) * self.spacing;
        self.builder
            .flattener
            .flatten(seeds[coarse as usize], reach, self.chart);
        let chart = &*self.chart;
        let Some(centre) = self.centre(coarse) else {
            return Vec::new();
        };
        let is_near = |p: &u32| {
            let distance = chart.position(*p).map_or(f32::INFINITY, Vec2::length);
            coarse_at[*p as usize] != u32::MAX && distance <= NEIGHBOURS * self.spacing
        };
        let others = chart.reached.iter().filter(|p| is_near(p));
        let limit = |&seed: &u32| {
            let other = coarse_at[seed as usize];
            let masses = [coarse, other].map(|c| self.level.inverse_masses[c as usize]);
            if other == coarse || masses == [0.0; 2] || !self.is_cloth_between(chart.position(seed)?) {
                return None;
            }
            let other_centre = self.centre(other)?;
            let flat = centre.flat.distance(other_centre.flat);
            // A distorted chart can be shorter than the straight line in space, which no cloth is.
            let length = flat.max(centre.spatial.distance(other_centre.spatial));
            Some(DistanceLimit {
                ends: [coarse.min(other), coarse.max(other)],
                max_distance: length * (1.0 + SLACK),
            })
        };
        others.filter_map(limit).collect()
    }

    /// Computes the centre of a coarse particle; `None` unless nearly all its members are in the
    /// chart.
    fn centre(&self, coarse: u32) -> Option<Centre> {
        let c = coarse as usize;
        let members = self.level.starts[c] as usize..self.level.starts[c + 1] as usize;
        let (mut flat, mut spatial, mut sum) = (Vec2::ZERO, Vec3::ZERO, 0.0);
        for member in &self.level.members[members] {
            if let Some(at) = self.chart.position(member.index) {
                flat += at * member.weight;
                spatial += self.builder.mesh.vertices[member.index as usize] * member.weight;
                sum += member.weight;
            }
        }
        (sum > LEAST_COVERED_WEIGHT).then(|| Centre {
            flat: flat / sum,
            spatial: spatial / sum,
        })
    }

    /// Returns whether there is cloth along the straight line from the chart's origin to `end`. The
    /// path around a hole is longer than that line, so that a limit would be too short.
    fn is_cloth_between(&self, end: Vec2) -> bool {
        // Within one and a half mean edges of each sample there is a particle, unless it lies in a
        // hole.
        let near = (self.spacing / SPACING * 1.5).powi(2);
        [0.25, 0.5, 0.75].into_iter().all(|t| {
            let point = end * t;
            self.chart
                .positions
                .iter()
                .any(|at| at.distance_squared(point) <= near)
        })
    }
}

/// Inserts an entry into a list sorted by falling weight, and drops the smallest one.
fn insert(shares: &mut Shares, mut entry: Weighted) {
    for share in shares.iter_mut() {
        if entry.weight > share.weight {
            std::mem::swap(share, &mut entry);
        }
    }
}

/// Scales the weights to sum to one, unless all are zero.
fn normalise(shares: &mut Shares) {
    let sum: f32 = shares.iter().map(|share| share.weight).sum();
    if sum > 0.0 {
        shares.iter_mut().for_each(|share| share.weight /= sum);
    }
}
