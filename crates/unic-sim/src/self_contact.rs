//! Contact of cloth with itself: folds and layers.

mod configuration;
mod grid;
mod pairs;
mod points;
mod rest_shape;
mod search;
mod sieve;
#[cfg(test)]
mod tests;

use crate::{
    Particles,
    contact::{Friction, Gap},
};
use configuration::Configuration;
use glam::Vec3;
use pairs::{Pair, Pairs};
use rayon::prelude::*;
use rest_shape::RestShape;
use unic_core::mesh::TriMesh;

/// Pairs that one thread takes at a time.
const PAIRS_A_CHUNK: usize = 1024;

/// How cloth touches itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContactSettings {
    /// Distance between layers, metres; less for what is closer at rest.
    pub thickness_m: f32,
    /// Cloth on cloth.
    pub friction: Friction,
    /// Speed at which layers that are too close already are parted, m/s.
    pub recovery_m_per_s: f32,
}

impl Default for SelfContactSettings {
    /// 2 mm, cotton on cotton, 0.2 m/s.
    fn default() -> Self {
        Self {
            thickness_m: 0.002,
            friction: Friction {
                r#static: 0.5,
                dynamic: 0.4,
            },
            recovery_m_per_s: 0.2,
        }
    }
}

/// Contact of a garment with itself: vertices against faces.
///
/// Pairs of a vertex and a face that may come together are collected once an interval; each keeps
/// the side that the vertex was on when the two met, also when it slides to the next face, so that
/// folds and layers do not pass through one another. Faces that share a vertex with a vertex's
/// neighbours are left out, and a pair keeps at most nine tenths of its distance at rest: layers that
/// touch in the rest shape do not push.
///
/// A substep solves all pairs from the same positions and adds up what they ask for, each divided by
/// the most pairs that any of its four particles is in (Jacobi): what a vertex gains its face loses,
/// so that linear momentum is kept. Friction is Coulomb's; penetrations that are there already do
/// not grow and are undone at `recovery_m_per_s` without becoming velocity, as with
/// [`BodyContacts`](crate::contact::BodyContacts).
///
/// Edges are not held against edges: layers must be meshed finer than the radius of their folds.
/// Winding must agree across edges. The same bytes for any number of threads.
///
/// ```
/// use glam::Vec3;
/// use unic_core::mesh::TriMesh;
/// use unic_sim::{Particles, self_contact::{SelfContactSettings, SelfContacts}};
///
/// // A vertex 1 mm over the middle of a face, falling.
/// let corners = [Vec3::ZERO, Vec3::Z * 0.1, Vec3::X * 0.1];
/// let lone = [0.001, 0.101, 0.101].map(|y| Vec3::new(0.03, y, 0.03 + y));
/// let rest: Vec<Vec3> = corners.iter().copied().chain(lone.map(|p| p + Vec3::Y)).collect();
/// let rest = TriMesh::new(rest, vec![[0, 1, 2], [3, 4, 5]])?;
/// let positions: Vec<Vec3> = corners.iter().copied().chain(lone).collect();
/// let mut particles = Particles {
///     previous: positions.clone(),
///     velocities: vec![Vec3::ZERO; 6],
///     inverse_masses: vec![1.0; 6],
///     positions,
/// };
/// let mut contacts = SelfContacts::new(&rest, SelfContactSettings::default());
/// contacts.begin_interval(&particles, 0.01);
/// particles.positions[3].y = -0.002;
/// contacts.project(0.01, &mut particles);
/// let [a, b, c] = [0, 1, 2].map(|i| particles.positions[i].y);
/// assert!(particles.positions[3].y > 0.39 * a + 0.31 * b + 0.3 * c);
/// # Ok::<(), unic_core::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SelfContacts {
    settings: SelfContactSettings,
    rest: RestShape,
    pairs: Pairs,
    /// Vertices that hold nothing in this interval; empty where all do.
    caught: Vec<bool>,
    impulses: Vec<Vec<Impulse>>,
    /// Pairs that each particle is pushed by in a substep; zero between substeps.
    counts: Vec<u16>,
}

/// What one pair asks for in a substep, for a unit of inverse mass.
#[derive(Clone, Copy, Debug)]
struct Impulse {
    /// The vertex and the corners of its face.
    particles: [u32; 4],
    /// Share of each: 1 for the vertex, minus the weights of the face's corners.
    shares: [f32; 4],
    /// Of the positions, m · kg.
    all: Vec3,
    /// The part that must not become velocity: of the previous positions, too.
    recovered: Vec3,
}

impl SelfContacts {
    /// Contact within a garment: one particle a vertex, vertices at seams welded.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] tells.
    pub fn new(rest: &TriMesh, settings: SelfContactSettings) -> Self {
        Self {
            settings,
            rest: RestShape::new(rest),
            pairs: Pairs::default(),
            caught: Vec::new(),
            impulses: Vec::new(),
            counts: vec![0; rest.vertices.len()],
        }
    }

    /// Number of pairs that are watched in this interval.
    pub fn pair_count(&self) -> usize {
        self.pairs.all.len()
    }

    /// Forgets the sides: for a cut, after which the cloth lies elsewhere.
    pub fn reset(&mut self) {
        self.pairs.clear();
    }

    /// Looks for what may touch in an interval of `seconds`, from the positions and velocities at
    /// its start.
    ///
    /// # Panics
    /// When the number of particles is not that of the rest shape's vertices.
    pub fn begin_interval(&mut self, particles: &Particles, seconds: f32) {
        assert_eq!(particles.positions.len(), self.rest.vertex_count(), "particles");
        let thickness_m = self.settings.thickness_m;
        self.pairs.collect(&self.rest, particles, seconds, thickness_m);
        self.caught.clear();
    }

    /// Leaves vertices out until the next interval: cloth in a fold of the body, where there is no room
    /// for layers. Sides are remembered meanwhile.
    pub(crate) fn leave_out(&mut self, is_caught: impl Fn(usize) -> bool) {
        self.caught.clear();
        self.caught.extend((0..self.rest.vertex_count()).map(is_caught));
    }

    /// Keeps layers apart in a substep of `seconds`.
    ///
    /// # Panics
    /// When the number of particles is not that of the rest shape's vertices.
    pub fn project(&mut self, seconds: f32, particles: &mut Particles) {
        assert_eq!(particles.positions.len(), self.rest.vertex_count(), "particles");
        let substep = Substep {
            particles,
            faces: &self.rest.faces,
            friction: self.settings.friction,
            recovery_m: self.settings.recovery_m_per_s * seconds,
        };
        let caught = &self.caught;
        let chunks = self.pairs.all.par_chunks(PAIRS_A_CHUNK);
        self.impulses.resize_with(chunks.len(), Vec::new);
        self.impulses
            .par_iter_mut()
            .zip(chunks)
            .for_each(|(impulses, pairs)| {
                impulses.clear();
                let is_held = |pair: &&Pair| !caught.get(pair.vertex as usize).is_some_and(|&is| is);
                impulses.extend(
                    pairs
                        .iter()
                        .filter(is_held)
                        .filter_map(|pair| substep.impulse(pair)),
                );
            });
        self.apply(particles);
    }

    /// Adds the impulses up, in their order: few pairs touch, so that one thread is enough.
    fn apply(&mut self, particles: &mut Particles) {
        let counts = &mut self.counts;
        for i in self
            .impulses
            .iter()
            .flatten()
            .flat_map(|impulse| impulse.particles)
        {
            counts[i as usize] = counts[i as usize].saturating_add(1);
        }
        for impulse in self.impulses.iter().flatten() {
            let most = impulse.particles.iter().map(|&i| counts[i as usize]).max();
            impulse.apply(1.0 / f32::from(most.unwrap_or(1)), particles);
        }
        for i in self
            .impulses
            .iter()
            .flatten()
            .flat_map(|impulse| impulse.particles)
        {
            counts[i as usize] = 0;
        }
    }
}

impl Impulse {
    fn apply(&self, scale: f32, particles: &mut Particles) {
        for (&i, share) in self.particles.iter().zip(self.shares) {
            let i = i as usize;
            let scaled = scale * share * particles.inverse_masses[i];
            particles.positions[i] += self.all * scaled;
            particles.previous[i] += self.recovered * scaled;
        }
    }
}

/// What all pairs share in a substep.
struct Substep<'a> {
    particles: &'a Particles,
    faces: &'a [[u32; 3]],
    friction: Friction,
    recovery_m: f32,
}

impl Substep<'_> {
    fn impulse(&self, pair: &Pair) -> Option<Impulse> {
        let face = self.faces[pair.face as usize];
        let after = Configuration::of(&self.particles.positions, pair, face);
        if after.is_clear(pair) {
            return None;
        }
        let weights = after.barycentric(pair)?;
        let before = Configuration::of(&self.particles.previous, pair, face);
        let push = Gap {
            before: before.height(pair) - pair.thickness_m,
            after: after.height(pair) - pair.thickness_m,
            recovery_m: self.recovery_m,
        }
        .push()?;
        let particles = [pair.vertex, face[0], face[1], face[2]];
        let shares = [1.0, -weights.x, -weights.y, -weights.z];
        let inverse_mass = self.inverse_mass(particles, shares)?;
        let normal = after.normal() * pair.side;
        let relative = after.offset(weights) - before.offset(weights);
        let slip = relative - normal * relative.dot(normal);
        let friction = self.friction.correction(slip, push.total - push.recovered);
        Some(Impulse {
            particles,
            shares,
            all: (normal * push.total + friction) / inverse_mass,
            recovered: normal * push.recovered / inverse_mass,
        })
    }

    /// Σ share² / mass, 1/kg; none when all four are pinned.
    fn inverse_mass(&self, particles: [u32; 4], shares: [f32; 4]) -> Option<f32> {
        let each = particles.iter().zip(shares);
        let sum: f32 = each
            .map(|(&i, share)| share * share * self.particles.inverse_masses[i as usize])
            .sum();
        (sum > 0.0).then_some(sum)
    }
}
