//! Contact of the cloth with itself, between folds and layers.

mod cull;
mod grid;
mod moving_points;
mod pair;
mod pairs;
mod rest_shape;
mod search;
#[cfg(test)]
mod tests;
mod vertex_face;

use crate::{
    Particles,
    contact::{Friction, Gap},
};
use glam::Vec3;
use pair::ContactPair;
use pairs::ContactPairs;
use rayon::prelude::*;
use rest_shape::RestShape;
use unic_core::mesh::TriMesh;
use vertex_face::VertexFace;

/// Number of pairs in a rayon task.
const PAIRS_PER_CHUNK: usize = 1024;

/// Settings of contact of the cloth with itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContactSettings {
    /// Distance between layers, metres. Layers that are closer at rest keep less.
    pub thickness_m: f32,
    /// Friction between layers of cloth.
    pub friction: Friction,
    /// Speed at which layers that are too close are separated, m/s.
    pub recovery_m_per_s: f32,
}

impl Default for SelfContactSettings {
    /// Returns a thickness of 2 mm, the friction of cotton on cotton and a recovery of 0.2 m/s.
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
/// **Detection.** Pairs of a vertex and a face that may touch are collected once per interval. Each
/// pair keeps the side that the vertex was on when the two met, even when the vertex slides to an
/// adjacent face. Folds and layers therefore do not pass through one another. A pair is ignored
/// when its vertex belongs to the face or is joined to it by an edge. A pair keeps at most nine
/// tenths of its distance at rest, so that layers that touch in the rest shape do not push each
/// other.
///
/// **Projection.** A substep computes the impulses of all pairs from the same positions (Jacobi).
/// Each is divided by the largest number of active pairs at any of its four particles. Vertex and
/// face get opposite impulses, so that linear momentum is conserved. Friction is Coulomb's. As in
/// [`BodyContacts`](crate::contact::BodyContacts), existing penetrations do not grow, and are
/// undone at `recovery_m_per_s` without becoming velocity.
///
/// **Limits.** There is no contact between two edges: layers must be meshed finer than the radius
/// of their folds. The winding of faces must agree across edges. Results have the same bytes for
/// any number of threads.
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
    pairs: ContactPairs,
    /// True for each vertex that is disabled in this interval; empty when none is.
    disabled: Vec<bool>,
    /// Impulses of a substep, one list per chunk of pairs. Scratch.
    impulses: Vec<Vec<Impulse>>,
    /// Number of impulses at each particle in a substep; zero between substeps. Scratch.
    counts: Vec<u16>,
}

/// The impulse of one pair in a substep. A particle moves by impulse · share · inverse mass.
#[derive(Clone, Copy, Debug)]
struct Impulse {
    /// The vertex and the corners of its face.
    particles: [u32; 4],
    /// Share of each particle: 1 for the vertex, minus the barycentric weights for the corners.
    shares: [f32; 4],
    /// Impulse on the positions, m · kg.
    total: Vec3,
    /// Part of `total` that recovers from an old penetration, m · kg. It also acts on the previous
    /// positions, so that it does not become velocity.
    recovered: Vec3,
}

impl SelfContacts {
    /// Creates the contacts of a garment whose vertices are particles, welded at seams.
    ///
    /// # Panics
    /// Panics when a face names a vertex that does not exist; see [`TriMesh::check`].
    pub fn new(rest: &TriMesh, settings: SelfContactSettings) -> Self {
        Self {
            settings,
            rest: RestShape::new(rest),
            pairs: ContactPairs::default(),
            disabled: Vec::new(),
            impulses: Vec::new(),
            counts: vec![0; rest.vertices.len()],
        }
    }

    /// Returns the number of pairs in this interval.
    pub fn pair_count(&self) -> usize {
        self.pairs.all.len()
    }

    /// Forgets all pairs and their sides. Needed when the cloth is moved discontinuously.
    pub fn reset(&mut self) {
        self.pairs.clear();
    }

    /// Collects the pairs that may touch in an interval of `seconds`, from the positions and
    /// velocities at its start.
    ///
    /// # Panics
    /// Panics when the number of particles differs from that of the rest shape's vertices.
    pub fn begin_interval(&mut self, particles: &Particles, seconds: f32) {
        assert_eq!(particles.positions.len(), self.rest.vertex_count(), "particles");
        let thickness_m = self.settings.thickness_m;
        self.pairs.collect(&self.rest, particles, seconds, thickness_m);
        self.disabled.clear();
    }

    /// Disables the pairs of some vertices until the next interval. Used for cloth in folds of the
    /// body, where there is no room for layers. The sides of these pairs are kept.
    pub(crate) fn disable_vertices(&mut self, is_disabled: impl Fn(usize) -> bool) {
        self.disabled.clear();
        self.disabled
            .extend((0..self.rest.vertex_count()).map(is_disabled));
    }

    /// Projects all pairs once: keeps layers apart in a substep of `seconds`.
    ///
    /// # Panics
    /// Panics when the number of particles differs from that of the rest shape's vertices.
    pub fn project(&mut self, seconds: f32, particles: &mut Particles) {
        assert_eq!(particles.positions.len(), self.rest.vertex_count(), "particles");
        let substep = PairSolver {
            particles,
            faces: &self.rest.faces,
            friction: self.settings.friction,
            recovery_m: self.settings.recovery_m_per_s * seconds,
        };
        let disabled = &self.disabled;
        let chunks = self.pairs.all.par_chunks(PAIRS_PER_CHUNK);
        self.impulses.resize_with(chunks.len(), Vec::new);
        self.impulses
            .par_iter_mut()
            .zip(chunks)
            .for_each(|(impulses, pairs)| {
                impulses.clear();
                let is_enabled =
                    |pair: &&ContactPair| !disabled.get(pair.vertex as usize).is_some_and(|&is| is);
                impulses.extend(
                    pairs
                        .iter()
                        .filter(is_enabled)
                        .filter_map(|pair| substep.impulse(pair)),
                );
            });
        self.apply(particles);
    }

    /// Applies all impulses to the particles.
    fn apply(&mut self, particles: &mut Particles) {
        let counts = &mut self.counts;
        // On one thread, because few pairs touch. The order of the sums is fixed this way.
        for i in self
            .impulses
            .iter()
            .flatten()
            .flat_map(|impulse| impulse.particles)
        {
            // 65,535 contacts of one particle do not occur in practice; wrapping around would make
            // the divisor small.
            counts[i as usize] = counts[i as usize].saturating_add(1);
        }
        // The divisor is the same for all four particles of a pair: momentum is conserved, and no
        // particle is moved too far by all its pairs together.
        for impulse in self.impulses.iter().flatten() {
            let most = impulse.particles.iter().map(|&i| counts[i as usize]).max();
            impulse.apply(1.0 / f32::from(most.unwrap_or(1)), particles);
        }
        // Only the counts in use are cleared: most particles have no contact.
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
            particles.positions[i] += self.total * scaled;
            particles.previous[i] += self.recovered * scaled;
        }
    }
}

/// Computes the impulses of pairs in a substep.
struct PairSolver<'a> {
    particles: &'a Particles,
    faces: &'a [[u32; 3]],
    friction: Friction,
    recovery_m: f32,
}

impl PairSolver<'_> {
    /// Returns the impulse of a pair; `None` when the pair does not touch.
    fn impulse(&self, pair: &ContactPair) -> Option<Impulse> {
        let face = self.faces[pair.face as usize];
        let after = VertexFace::new(&self.particles.positions, pair, face);
        // Most pairs leave here, before the costlier tests.
        if after.is_clear(pair) {
            return None;
        }
        let weights = after.barycentric(pair)?;
        let before = VertexFace::new(&self.particles.previous, pair, face);
        let correction = Gap {
            before: before.height(pair) - pair.thickness_m,
            after: after.height(pair) - pair.thickness_m,
            recovery_m: self.recovery_m,
        }
        .correction()?;
        let particles = [pair.vertex, face[0], face[1], face[2]];
        let shares = [1.0, -weights.x, -weights.y, -weights.z];
        let inverse_mass = self.inverse_mass(particles, shares)?;
        let normal = after.normal() * pair.side;
        let relative = after.offset(weights) - before.offset(weights);
        let slip = relative - normal * relative.dot(normal);
        let pressed_m = correction.total - correction.recovered;
        let friction = self.friction.correction(slip, pressed_m);
        Some(Impulse {
            particles,
            shares,
            total: (normal * correction.total + friction) / inverse_mass,
            recovered: normal * correction.recovered / inverse_mass,
        })
    }

    /// Returns the effective inverse mass of a pair, Σ share² / mass, in 1/kg; `None` when all four
    /// particles are pinned.
    fn inverse_mass(&self, particles: [u32; 4], shares: [f32; 4]) -> Option<f32> {
        let each = particles.iter().zip(shares);
        let sum: f32 = each
            .map(|(&i, share)| share * share * self.particles.inverse_masses[i as usize])
            .sum();
        (sum > 0.0).then_some(sum)
    }
}
