//! Contact of cloth with the body and the ground.

mod detect;
mod fold_filter;
mod limb_filter;
mod response;
mod settings;
mod substep;
mod walk;

use crate::{
    Particles,
    body::{BodyInterval, PosedBody},
};
use detect::{BodyMotion, ContactCache, Detection};
use limb_filter::LimbFilter;
use rayon::prelude::*;
use substep::BodySubstep;
use unic_core::{folds::Folds, mesh::TriMesh, surface::Surface};
use walk::FaceAdjacency;

pub(crate) use fold_filter::FoldFilter;
pub(crate) use limb_filter::{BareLimbs, hits_in_bind_pose};
pub use response::Friction;
pub(crate) use response::Gap;
pub use settings::{ContactSettings, MAX_TRACKED_DEPTH_M};

/// Number of particles in a rayon task: a whole number of cache lines of each array, so that
/// threads hardly ever write to the same line.
const CHUNK: usize = 256;

/// Time between two updates of the body's folds, seconds: a frame at 30 fps. Folds change slowly,
/// and finding them costs a ray per vertex of the body.
const FOLD_PERIOD_S: f32 = 1.0 / 30.0;

/// Speed at which cloth leaves a limb that passes through it, m/s: the speed of swinging arms.
const SINK_M_PER_S: f32 = 3.0;

/// Contact of particles with an animated body. Contacts are detected once per interval and
/// projected in every substep.
///
/// Each particle keeps a distance of `thickness_m` from the body's surface next to it. The nearest
/// face is searched for at the start of an interval. While a face is known, it is searched for
/// every sixtieth of a second only. In between, the particle's projection onto the surface moves
/// from face to adjacent face, and the surface moves with the body. Normals are interpolated over
/// the faces, so that cloth does not catch on edges. The pseudonormals of [`Surface`] decide which
/// side is outside.
///
/// - **Restitution** is zero.
/// - **Friction** is Coulomb's, relative to the motion of the surface under the particle. Cloth at
///   rest on a moving body is carried along and does not creep.
/// - **Penetration** that exists at the start of a substep may not grow. It is undone at
///   `recovery_m_per_s` on top of the body's motion. That correction also moves
///   [`Particles::previous`], so that it does not become velocity.
/// - **Sides**: a particle inside the body leaves through the side that it entered by, down to
///   [`MAX_TRACKED_DEPTH_M`]. A limb that sweeps through hanging cloth therefore pushes it along.
/// - **Folds** of the body ([`Folds`], updated every thirtieth of a second) leave no room for
///   cloth. The cloth of a garment there collides only with the part of the body that it lies on: a
///   sleeve stays outside its arm and passes into the torso with it. In the crease between two
///   parts a penetration may not grow, is not undone and has no friction.
/// - **Bare limbs** of a character pass through the cloth where they come too close to a covered
///   part, as captured arms intersect bellies. Cloth inside such a limb moves to the covered part
///   beneath it, at 3 m/s and without becoming velocity. Bare limbs that the garment does not
///   enclose collide with its outer side only, so that they do not lift it from beneath.
///
/// Particles do not interact, so that results have the same bytes for any number of threads.
///
/// ```
/// use glam::Vec3;
/// use unic_core::mesh::TriMesh;
/// use unic_sim::{Particles, body::BodyInterval, contact::{BodyContacts, ContactSettings}};
///
/// let corners = vec![-Vec3::ONE, Vec3::new(-1.0, -1.0, 3.0), Vec3::new(3.0, -1.0, -1.0)];
/// let table = TriMesh::new(corners, vec![[0, 1, 2]])?;
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
    adjacency: FaceAdjacency,
    /// Contact cache of each particle.
    caches: Vec<ContactCache>,
    /// Motion of the body in the current interval.
    motion: BodyMotion,
    /// Length of the current interval, seconds.
    interval_s: f32,
    /// Number of intervals since the last reset.
    intervals: usize,
    /// The body at the start of the interval.
    surface: Surface,
    folds: Folds,
    folds_age_s: f32,
    limb_filter: LimbFilter,
    fold_filter: FoldFilter,
    /// The body at the start of the substep.
    before: PosedBody,
    /// The body at the end of the substep.
    after: PosedBody,
    /// Fraction of the interval at which `after` is posed; NaN when it is out of date.
    posed_at: f32,
}

impl BodyContacts {
    /// Creates the contacts of `particle_count` particles with a body, given in its bind pose.
    ///
    /// # Panics
    /// Panics when a face names a vertex that does not exist; see [`TriMesh::check`].
    pub fn new(body: &TriMesh, particle_count: usize, settings: ContactSettings) -> Self {
        Self {
            settings,
            adjacency: FaceAdjacency::new(body),
            caches: vec![ContactCache::UNKNOWN; particle_count],
            motion: BodyMotion::default(),
            interval_s: 0.0,
            intervals: 0,
            surface: Surface::build(body),
            folds: Folds::default(),
            folds_age_s: f32::INFINITY,
            limb_filter: LimbFilter::default(),
            fold_filter: FoldFilter::default(),
            before: PosedBody::default(),
            after: PosedBody::default(),
            posed_at: f32::NAN,
        }
    }

    /// Enables the filter that lets bare limbs pass through the cloth where they come too close to
    /// covered parts.
    pub(crate) fn with_limbs(self, limbs: BareLimbs) -> Self {
        Self {
            limb_filter: LimbFilter::new(limbs),
            ..self
        }
    }

    /// Enables the filter that lets cloth pass through foreign parts in folds of the body.
    ///
    /// # Panics
    /// Panics when the filter was made for another number of particles.
    pub(crate) fn with_fold_filter(self, fold_filter: FoldFilter) -> Self {
        assert_eq!(fold_filter.home_faces.len(), self.caches.len(), "particles");
        let mut contacts = Self { fold_filter, ..self };
        contacts.reset();
        contacts
    }

    /// Replaces the settings, from the next substep on.
    pub fn set_settings(&mut self, settings: ContactSettings) {
        self.settings = settings;
    }

    /// Returns the current settings.
    pub fn settings(&self) -> &ContactSettings {
        &self.settings
    }

    /// Returns the folds of the body as they were found last.
    pub fn folds(&self) -> &Folds {
        &self.folds
    }

    /// Returns the body's surface at the start of the interval, for other closest-point queries.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Clears the contact caches. Needed when particles or body are moved discontinuously.
    pub fn reset(&mut self) {
        self.caches.fill(ContactCache::UNKNOWN);
        for (cache, home) in self.caches.iter_mut().zip(&self.fold_filter.home_faces) {
            *cache = ContactCache::at_home(*home);
        }
        self.intervals = 0;
        self.folds_age_s = f32::INFINITY;
    }

    /// Detects what each particle can touch in an interval of `seconds`, from the positions and
    /// velocities at its start.
    ///
    /// # Panics
    /// Panics when the number of particles or of body vertices differs from that given to
    /// [`BodyContacts::new`].
    pub fn begin_interval(&mut self, interval: &BodyInterval, particles: &Particles, seconds: f32) {
        assert_eq!(particles.positions.len(), self.caches.len(), "particles");
        self.surface.refit(interval.start());
        // The tolerance absorbs the rounding of summed interval lengths, which would otherwise
        // delay an update by an interval now and then.
        if self.folds_age_s >= FOLD_PERIOD_S * 0.999 {
            self.folds.find(&self.surface);
            self.limb_filter
                .update(&self.surface, &self.folds, interval.start(), &particles.positions);
            self.folds_age_s = 0.0;
        }
        self.folds_age_s += seconds;
        self.interval_s = seconds;
        // NaN equals no fraction, so that the first substep poses the body anew.
        self.posed_at = f32::NAN;
        let motion = BodyMotion::of(interval);
        let detection = Detection {
            surface: &self.surface,
            adjacency: &self.adjacency,
            limb_filter: &self.limb_filter,
            fold_filter: &self.fold_filter,
            folds: &self.folds,
            start: interval.start(),
            // Clearances shrink by the motion of the previous interval.
            before: std::mem::replace(&mut self.motion, motion),
            motion,
            thickness_m: self.settings.thickness_m,
            seconds,
            interval: self.intervals,
        };
        self.intervals = self.intervals.wrapping_add(1);
        (self.caches.par_chunks_mut(CHUNK))
            .zip(particles.positions.par_chunks(CHUNK))
            .zip(particles.velocities.par_chunks(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((caches, positions), velocities))| {
                let each = caches.iter_mut().zip(positions).zip(velocities).enumerate();
                for (k, ((cache, &p), &v)) in each {
                    detection.update(cache, chunk * CHUNK + k, p, v);
                }
            });
    }

    /// Returns whether a particle is in contact with a fold of the body in this interval.
    pub(crate) fn is_in_fold(&self, particle: usize) -> bool {
        let cache = &self.caches[particle];
        cache.passes_foreign || (cache.is_within_reach && self.folds.is_face_folded(cache.face))
    }

    /// Projects contacts: moves particles out of the body and the ground in the substep from
    /// `fraction_before` to `fraction_after` of the interval. Pinned particles do not move.
    ///
    /// # Panics
    /// Panics when the number of particles differs from that given to [`BodyContacts::new`].
    pub fn project(
        &mut self,
        interval: &BodyInterval,
        fraction_before: f32,
        fraction_after: f32,
        particles: &mut Particles,
    ) {
        assert_eq!(particles.positions.len(), self.caches.len(), "particles");
        self.pose(interval, fraction_before, fraction_after);
        let seconds = self.interval_s * (fraction_after - fraction_before);
        let substep = BodySubstep {
            settings: &self.settings,
            adjacency: &self.adjacency,
            folds: &self.folds,
            before: &self.before,
            after: &self.after,
            recovery_m: self.settings.recovery_m_per_s * seconds,
            max_sink_m: SINK_M_PER_S * seconds,
            motion: &self.motion,
            fraction: fraction_after,
        };
        (self.caches.par_chunks_mut(CHUNK))
            .zip(particles.positions.par_chunks_mut(CHUNK))
            .zip(particles.previous.par_chunks_mut(CHUNK))
            .zip(particles.inverse_masses.par_chunks(CHUNK))
            .for_each(|(((caches, positions), previous), inverse_masses)| {
                let each = caches.iter_mut().zip(positions).zip(previous).zip(inverse_masses);
                for (((cache, position), previous), _) in each.filter(|(_, w)| **w > 0.0) {
                    substep.project(cache, position, previous);
                }
            });
    }

    /// Poses the body at two fractions of the interval.
    fn pose(&mut self, interval: &BodyInterval, before: f32, after: f32) {
        // Substeps follow one another, so that the last end is usually the next start.
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
