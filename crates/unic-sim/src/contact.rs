//! Contact of cloth with the body and the ground.

mod detect;
mod response;
mod substep;
mod visitors;
mod walk;

use crate::{
    Particles,
    body::{BodyInterval, PosedBody},
};
use detect::{BodyMotion, Detection, Nearby};
use rayon::prelude::*;
use substep::Substep;
use unic_core::{folds::Folds, mesh::TriMesh, surface::Surface};
use visitors::Visitors;
use walk::FaceGraph;

pub use response::Friction;
pub(crate) use response::Gap;
pub(crate) use visitors::Limbs;

/// Particles that one thread takes at a time: whole cache lines of each array.
const CHUNK: usize = 256;

/// A fold mask is used for this long, seconds: a frame at 30 fps.
const FOLD_PERIOD_S: f32 = 1.0 / 30.0;

/// Speed at which cloth leaves a limb that passes through it, m/s: that of arms that swing.
const SINK_M_PER_S: f32 = 3.0;

/// How cloth touches the body and the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Distance that particles keep from the body and from the ground, metres.
    pub thickness_m: f32,
    /// Against the body.
    pub body_friction: Friction,
    /// Against the ground.
    pub ground_friction: Friction,
    /// Speed at which penetrations that are there already are undone, m/s.
    pub recovery_m_per_s: f32,
    /// Height of the ground, world space, metres; none without a ground.
    pub ground_height_m: Option<f32>,
}

impl Default for ContactSettings {
    /// 3 mm, cotton on skin, half a metre a second; no ground.
    fn default() -> Self {
        Self {
            thickness_m: 0.003,
            body_friction: Friction {
                r#static: 0.6,
                dynamic: 0.5,
            },
            ground_friction: Friction {
                r#static: 0.6,
                dynamic: 0.5,
            },
            recovery_m_per_s: 0.5,
            ground_height_m: None,
        }
    }
}

/// Contact of particles with an animated body: found once an interval, kept in every substep.
///
/// Each particle keeps `thickness_m` from the body's surface near it. The nearest face is searched
/// for at the start of an interval, or every sixtieth of a second while one is known; within it the
/// foot of the particle walks over the faces, and the surface under it moves with the body. Normals are interpolated over the faces, so that cloth
/// does not catch on edges; sides are those of the pseudonormals of [`Surface`].
///
/// - Restitution is zero. Friction is Coulomb's, relative to the motion of the surface under the
///   particle, so that cloth at rest on a moving body is carried and does not creep.
/// - A penetration that is there at the start of a substep may not grow, and is undone at
///   `recovery_m_per_s` on top of the body's motion. That part moves [`Particles::previous`]
///   along, so that it never becomes velocity.
/// - A particle inside the body leaves through the side that it came from, up to
///   [`SIDE_DEPTH_M`]: a limb that is swept through hanging cloth takes it along.
/// - In folds of the body ([`Folds`], found again every thirtieth of a second) there is no room:
///   there a penetration may not grow, is not undone, and nothing rubs. Cloth caught in an
///   armpit goes with it and is pushed out when the arm is lifted.
/// - On a character, a bare limb that comes too close to a dressed part passes through the cloth, as
///   captured arms pass through bellies: between the two there would be no room. What of the cloth is
///   inside it sinks to the dressed part beneath, at 3 m/s and without becoming velocity.
///   And it touches the cloth's outer side alone, so that it lifts nothing under which it has come
///   that way.
///
/// The same bytes for any number of threads: particles do not see each other.
///
/// ```
/// use glam::Vec3;
/// use unic_core::mesh::TriMesh;
/// use unic_sim::{Particles, body::BodyInterval, contact::{BodyContacts, ContactSettings}};
///
/// let table = TriMesh::new(vec![-Vec3::ONE, Vec3::new(-1.0, -1.0, 3.0), Vec3::new(3.0, -1.0, -1.0)], vec![[0, 1, 2]])?;
/// let mut particles = Particles {
///     positions: vec![Vec3::new(0.0, -0.9985, 0.0)],
///     previous: vec![Vec3::new(0.0, -0.997, 0.0)],
///     velocities: vec![Vec3::ZERO],
///     inverse_masses: vec![1.0],
/// };
/// let interval = BodyInterval::new(&table);
/// let mut contacts = BodyContacts::new(&table, 1, ContactSettings::default());
/// contacts.begin_interval(&interval, &particles, 0.01);
/// contacts.project(&interval, 0.0, 1.0, &mut particles);
/// assert!((particles.positions[0].y + 0.997).abs() < 1e-6);
/// # Ok::<(), unic_core::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct BodyContacts {
    settings: ContactSettings,
    graph: FaceGraph,
    nearby: Vec<Nearby>,
    motion: BodyMotion,
    interval_s: f32,
    intervals: usize,
    surface: Surface,
    folds: Folds,
    folds_age_s: f32,
    visitors: Visitors,
    before: PosedBody,
    after: PosedBody,
    posed_at: f32,
}

/// Depth up to which a particle inside the body stays on the side that it came from, metres; the
/// deepest that penetrations are looked for, too. A lower arm is 6 to 8 cm thick.
pub const SIDE_DEPTH_M: f32 = 0.05;

impl BodyContacts {
    /// Contact of `particle_count` particles with a body, given in its bind pose.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] tells.
    pub fn new(body: &TriMesh, particle_count: usize, settings: ContactSettings) -> Self {
        Self {
            settings,
            graph: FaceGraph::new(body),
            nearby: vec![Nearby::UNKNOWN; particle_count],
            motion: BodyMotion::default(),
            interval_s: 0.0,
            intervals: 0,
            surface: Surface::build(body),
            folds: Folds::default(),
            folds_age_s: f32::INFINITY,
            visitors: Visitors::default(),
            before: PosedBody::default(),
            after: PosedBody::default(),
            posed_at: f32::NAN,
        }
    }

    /// Lets bare limbs that come too close to dressed parts pass through the cloth.
    pub(crate) fn with_limbs(self, limbs: Limbs) -> Self {
        Self {
            visitors: Visitors::new(limbs),
            ..self
        }
    }

    /// How cloth touches from the next substep on.
    pub fn set_settings(&mut self, settings: ContactSettings) {
        self.settings = settings;
    }

    /// The settings in use.
    pub fn settings(&self) -> &ContactSettings {
        &self.settings
    }

    /// The folds of the body that were found last.
    pub fn folds(&self) -> &Folds {
        &self.folds
    }

    /// The body at the start of the interval, posed: for queries beside the contact.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Forgets where particles were: for a cut, after which they are elsewhere.
    pub fn reset(&mut self) {
        self.nearby.fill(Nearby::UNKNOWN);
        self.intervals = 0;
        self.folds_age_s = f32::INFINITY;
    }

    /// Looks for what each particle can touch in an interval of `seconds`, from the positions and
    /// velocities that particles have at its start.
    ///
    /// # Panics
    /// When the number of particles or of body vertices is another than at the start.
    pub fn begin_interval(&mut self, interval: &BodyInterval, particles: &Particles, seconds: f32) {
        assert_eq!(particles.positions.len(), self.nearby.len(), "particles");
        self.surface.refit(interval.start());
        if self.folds_age_s >= FOLD_PERIOD_S * 0.999 {
            self.folds.find(&self.surface);
            self.visitors
                .find(&self.surface, &self.folds, interval.start(), &particles.positions);
            self.folds_age_s = 0.0;
        }
        self.folds_age_s += seconds;
        self.interval_s = seconds;
        self.posed_at = f32::NAN;
        let motion = BodyMotion::of(interval);
        let detection = Detection {
            surface: &self.surface,
            graph: &self.graph,
            visitors: &self.visitors,
            start: interval.start(),
            before: std::mem::replace(&mut self.motion, motion),
            motion,
            thickness_m: self.settings.thickness_m,
            seconds,
            interval: self.intervals,
        };
        self.intervals = self.intervals.wrapping_add(1);
        (self.nearby.par_chunks_mut(CHUNK))
            .zip(particles.positions.par_chunks(CHUNK))
            .zip(particles.velocities.par_chunks(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((nearby, positions), velocities))| {
                let each = nearby.iter_mut().zip(positions).zip(velocities).enumerate();
                for (k, ((nearby, &p), &v)) in each {
                    detection.update(nearby, chunk * CHUNK + k, p, v);
                }
            });
    }

    /// Whether a particle touches a fold of the body in this interval.
    pub(crate) fn is_caught(&self, particle: usize) -> bool {
        let nearby = &self.nearby[particle];
        nearby.is_within_reach && self.folds.has_face(nearby.face)
    }

    /// Keeps particles out of the body and the ground in the substep from `fraction_before` to
    /// `fraction_after` of the interval. Pinned particles stay.
    ///
    /// # Panics
    /// When the number of particles is another than at the start.
    pub fn project(
        &mut self,
        interval: &BodyInterval,
        fraction_before: f32,
        fraction_after: f32,
        particles: &mut Particles,
    ) {
        assert_eq!(particles.positions.len(), self.nearby.len(), "particles");
        self.pose(interval, fraction_before, fraction_after);
        let seconds = self.interval_s * (fraction_after - fraction_before);
        let substep = Substep {
            settings: &self.settings,
            graph: &self.graph,
            folds: &self.folds,
            before: &self.before,
            after: &self.after,
            recovery_m: self.settings.recovery_m_per_s * seconds,
            sink_m: SINK_M_PER_S * seconds,
            motion: &self.motion,
            fraction: fraction_after,
        };
        (self.nearby.par_chunks_mut(CHUNK))
            .zip(particles.positions.par_chunks_mut(CHUNK))
            .zip(particles.previous.par_chunks_mut(CHUNK))
            .zip(particles.inverse_masses.par_chunks(CHUNK))
            .for_each(|(((nearby, positions), previous), inverse_masses)| {
                let moved = nearby.iter_mut().zip(positions).zip(previous).zip(inverse_masses);
                for (((nearby, position), previous), _) in moved.filter(|(_, w)| **w > 0.0) {
                    substep.keep_out(nearby, position, previous);
                }
            });
    }

    fn pose(&mut self, interval: &BodyInterval, before: f32, after: f32) {
        if self.posed_at == before {
            std::mem::swap(&mut self.before, &mut self.after);
        } else {
            interval.pose_at(before, &mut self.before);
        }
        interval.pose_at(after, &mut self.after);
        self.posed_at = after;
    }
}

#[cfg(test)]
mod tests;
