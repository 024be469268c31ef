//! The simulation of one garment: its state and its time steps.

mod animated_character;
mod pre_roll;
mod settings;

pub use settings::{SettleSettings, SimulationSettings};

use crate::{
    Cloth, Particles, SimulationError,
    air::Drag,
    contact::{ContactSettings, Friction},
    long_range::LongRangeScratch,
    self_contact::SelfContacts,
};
use animated_character::AnimatedCharacter;
use glam::Vec3;
use pre_roll::PreRoll;
pub(crate) use pre_roll::heading;
use rayon::prelude::*;
use std::{ops::Range, sync::Arc};
use unic_core::{Pose, character::Character};

/// Fewest particles that one rayon task updates. The work per particle is so small that smaller
/// tasks would cost more in scheduling than they gain.
const CHUNK: usize = 2048;

/// A simulation of one garment.
///
/// Owns the state; the [`Cloth`] and the [`Character`] are shared. Every step gives the same bytes
/// for any number of threads in the current rayon pool.
#[derive(Debug, Clone)]
pub struct Simulation {
    cloth: Arc<Cloth>,
    settings: SimulationSettings,
    /// The character that wears the garment, if there is one.
    character: Option<AnimatedCharacter>,
    self_contacts: Option<SelfContacts>,
    particles: Particles,
    /// Pin positions at the end of the current frame, in the order of `ClothSpec::pins`, metres.
    pin_targets: Vec<Vec3>,
    /// Pin positions at the start of the current frame, metres.
    pin_starts: Vec<Vec3>,
    seconds: f64,
    drag: Drag,
    long_range: LongRangeScratch,
    /// Vertex positions after the last frame, metres.
    vertices: Vec<Vec3>,
}

impl Simulation {
    /// Creates a simulation of cloth alone, at rest in its rest shape.
    ///
    /// # Errors
    /// Returns an error when a setting is out of range, or when the cloth has attachments, which
    /// need a character.
    pub fn new(cloth: Arc<Cloth>, settings: SimulationSettings) -> Result<Self, SimulationError> {
        if !cloth.attachments.is_empty() {
            return Err(SimulationError::NoCharacter {
                what: "an attached vertex",
            });
        }
        Self::with_character(cloth, None, settings)
    }

    /// Creates a simulation of cloth on a character in its bind pose. Call [`Simulation::settle`]
    /// to begin a clip.
    ///
    /// # Errors
    /// Returns an error when a setting is out of range, or when an attachment names a face that the
    /// body does not have.
    pub fn on_character(
        cloth: Arc<Cloth>,
        character: Arc<Character>,
        settings: SimulationSettings,
    ) -> Result<Self, SimulationError> {
        let faces = character.body.faces.len();
        if let Some(bad) = cloth.attachments.iter().find(|a| a.face as usize >= faces) {
            return Err(SimulationError::Attachment {
                found: bad.face,
                faces,
            });
        }
        let contact = settings.contact.unwrap_or_else(|| default_contact(&cloth));
        let animated = AnimatedCharacter::new(character, cloth.rest(), contact);
        Self::with_character(cloth, Some(animated), settings)
    }

    fn with_character(
        cloth: Arc<Cloth>,
        character: Option<AnimatedCharacter>,
        settings: SimulationSettings,
    ) -> Result<Self, SimulationError> {
        settings.check()?;
        let self_contacts = settings
            .self_contact
            .map(|self_contact| SelfContacts::new(&cloth.rest, self_contact));
        let mut simulation = Self {
            self_contacts,
            particles: Particles {
                inverse_masses: cloth.inverse_masses.clone(),
                ..Default::default()
            },
            pin_targets: Vec::new(),
            pin_starts: Vec::new(),
            seconds: 0.0,
            drag: Drag::default(),
            long_range: LongRangeScratch::default(),
            vertices: Vec::new(),
            cloth,
            settings,
            character,
        };
        simulation.place(|rest| rest);
        Ok(simulation)
    }

    /// Returns the garment that is simulated.
    pub fn cloth(&self) -> &Arc<Cloth> {
        &self.cloth
    }

    /// Returns the settings of the simulation.
    pub fn settings(&self) -> &SimulationSettings {
        &self.settings
    }

    /// Returns the state: positions, velocities and inverse masses of all particles.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Returns the body's vertices after the last step, world space, metres; `None` without a
    /// character.
    pub fn body(&self) -> Option<&[Vec3]> {
        self.character.as_ref().map(AnimatedCharacter::vertices)
    }

    /// Returns the positions of the garment's vertices, world space, metres.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Returns the simulated time since the garment was placed, seconds.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Places the garment at rest, each point of its rest shape where `world_from_rest` maps it.
    pub fn place(&mut self, world_from_rest: impl Fn(Vec3) -> Vec3) {
        let positions = &mut self.particles.positions;
        positions.clear();
        positions.extend(self.cloth.rest.vertices.iter().map(|&v| world_from_rest(v)));
        self.particles.previous.clone_from(positions);
        self.particles.velocities.clear();
        self.particles.velocities.resize(positions.len(), Vec3::ZERO);
        let pins = self.cloth.pins.iter();
        self.pin_targets = pins.map(|&particle| positions[particle as usize]).collect();
        self.pin_starts.clone_from(&self.pin_targets);
        if let Some(self_contacts) = &mut self.self_contacts {
            self_contacts.reset();
        }
        self.seconds = 0.0;
        self.cloth
            .vertex_positions(&self.particles.positions, &mut self.vertices);
    }

    /// Sets the velocity of each particle that is not pinned, m/s. `velocity` maps a particle's
    /// position in metres to its velocity.
    pub fn set_velocities(&mut self, velocity: impl Fn(Vec3) -> Vec3) {
        let Particles {
            positions,
            velocities,
            inverse_masses,
            ..
        } = &mut self.particles;
        for ((v, &p), &w) in velocities.iter_mut().zip(&*positions).zip(&*inverse_masses) {
            *v = if w > 0.0 { velocity(p) } else { Vec3::ZERO };
        }
    }

    /// Sets the pin positions at the end of the next frame, in the order of
    /// [`ClothSpec::pins`](crate::ClothSpec::pins), metres. Pins move there at constant velocity
    /// and then stay.
    ///
    /// # Panics
    /// Panics when the number of positions is not the number of pins.
    pub fn move_pins(&mut self, positions: &[Vec3]) {
        assert_eq!(positions.len(), self.cloth.pins.len(), "positions of pins");
        self.pin_targets.copy_from_slice(positions);
    }

    /// Brings the garment from its rest shape to the first frame of a clip and returns the vertex
    /// positions there.
    ///
    /// The rest shape is placed on the bind pose, turned to the clip's heading, and leaves the body
    /// where it intersects it. The character then moves to the clip's first pose and arrives with
    /// the velocity that leads to `second`. The earlier state has no influence, so that clips can
    /// be simulated in any order.
    ///
    /// # Errors
    /// Returns an error when there is no character, when a pose does not fit it, or when a position
    /// becomes infinite or NaN.
    pub fn settle(&mut self, first: &Pose, second: &Pose) -> Result<&[Vec3], SimulationError> {
        self.settle_while(first, second, Vec3::ZERO, || true)?;
        Ok(&self.vertices)
    }

    /// Runs [`Simulation::settle`] in a wind, in m/s, for as long as `keep_going` returns true.
    ///
    /// `keep_going` is called before each frame. Returns whether settling has finished.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::settle`], and an error for a wind that is not finite.
    pub fn settle_while(
        &mut self,
        first: &Pose,
        second: &Pose,
        wind: Vec3,
        mut keep_going: impl FnMut() -> bool,
    ) -> Result<bool, SimulationError> {
        let Some(character) = &mut self.character else {
            return Err(SimulationError::NoCharacter { what: "settling" });
        };
        character.check(first)?;
        character.check(second)?;
        let fps = self.settings.fps;
        let skeleton = &character.asset().skeleton;
        let pre_roll = PreRoll::new(skeleton, first, second, fps, self.settings.settle);
        let world_from_rest = pre_roll.world_from_rest(skeleton);
        character.reset(&pre_roll.pose(-pre_roll.seconds()));
        self.place(|rest| world_from_rest.point(rest));
        let frames = (pre_roll.seconds() * fps).ceil() as i32;
        // Counted backwards from the clip's first frame, so that the last frame is at time zero
        // exactly, whatever the duration is.
        for frame in 1 - frames..=0 {
            if !keep_going() {
                return Ok(false);
            }
            let time = frame as f32 / fps;
            let damping = pre_roll.damping_per_s(time, self.settings.damping_per_s);
            self.advance_frame(Some(&pre_roll.pose(time)), wind, damping)?;
        }
        Ok(true)
    }

    /// Advances by one frame, in which the character moves to the pose `next`, in a wind in m/s.
    /// Returns the positions of the garment's vertices.
    ///
    /// # Errors
    /// Returns an error when there is no character, when the pose does not fit it, or when the wind
    /// or a resulting position is not finite.
    pub fn step_frame(&mut self, next: &Pose, wind: Vec3) -> Result<&[Vec3], SimulationError> {
        let Some(character) = &self.character else {
            return Err(SimulationError::NoCharacter { what: "a pose" });
        };
        character.check(next)?;
        self.advance_frame(Some(next), wind, self.settings.damping_per_s)?;
        Ok(&self.vertices)
    }

    /// Advances by one frame in which the character, if there is one, keeps its pose. The wind is
    /// in m/s. Returns the positions of the garment's vertices.
    ///
    /// # Errors
    /// Returns an error when the wind or a resulting position is not finite.
    pub fn step_still(&mut self, wind: Vec3) -> Result<&[Vec3], SimulationError> {
        self.advance_frame(None, wind, self.settings.damping_per_s)?;
        Ok(&self.vertices)
    }

    fn advance_frame(
        &mut self,
        next: Option<&Pose>,
        wind: Vec3,
        damping_per_s: f32,
    ) -> Result<(), SimulationError> {
        if !wind.is_finite() {
            return Err(SimulationError::Wind);
        }
        let intervals = self.settings.intervals_per_frame;
        if let Some(character) = &mut self.character {
            character.begin_frame(next);
        }
        for interval in 0..intervals {
            let fraction = |i: u32| i as f32 / intervals as f32;
            self.advance_interval(fraction(interval)..fraction(interval + 1), wind, damping_per_s);
        }
        self.pin_starts.clone_from(&self.pin_targets);
        self.seconds += f64::from(self.settings.fps.recip());
        self.cloth
            .vertex_positions(&self.particles.positions, &mut self.vertices);
        match self.vertices.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(vertex) => Err(SimulationError::NotFinite {
                vertex,
                seconds: self.seconds,
            }),
        }
    }

    /// Advances through one interval, given as a range of fractions of the frame.
    fn advance_interval(&mut self, of_frame: Range<f32>, wind: Vec3, damping_per_s: f32) {
        let seconds = self.settings.interval_s();
        let substeps = self.settings.substeps_per_interval;
        // Clamped: a factor above one would reverse the motion instead of damping it.
        self.damp((damping_per_s * seconds).min(1.0));
        let air = &self.settings.air;
        self.drag.update(air, &self.cloth, &self.particles, wind, seconds);
        if let Some(character) = &mut self.character {
            character.begin_interval(of_frame.end, &self.particles, seconds);
        }
        if let Some(self_contacts) = &mut self.self_contacts {
            self_contacts.begin_interval(&self.particles, seconds);
            if let Some(character) = &self.character {
                // Body contact decides first: where cloth lies in a fold of the body there is no
                // room for layers, and self-contact would only push them apart in vain.
                self_contacts.disable_vertices(|particle| character.is_in_fold(particle));
            }
        }
        for substep in 0..substeps {
            let fraction = |s: u32| s as f32 / substeps as f32;
            let of_interval = fraction(substep)..fraction(substep + 1);
            self.predict(of_frame.start + (of_frame.end - of_frame.start) * of_interval.end);
            self.project_constraints(of_interval);
            self.update_velocities();
        }
    }

    /// Damps velocities relative to the garment's mean velocity by the factor `1 - share`. Total
    /// momentum is conserved.
    fn damp(&mut self, share: f32) {
        if share == 0.0 {
            return;
        }
        // Summed in f64 on one thread: the order is fixed, and rounding does not grow with the
        // number of particles.
        let (mut momentum, mut mass) = (glam::DVec3::ZERO, 0.0);
        for (v, m) in self.particles.velocities.iter().zip(&self.cloth.masses) {
            momentum += v.as_dvec3() * f64::from(*m);
            mass += f64::from(*m);
        }
        let mean = (momentum / mass).as_vec3();
        let (velocities, inverse_masses) = (&mut self.particles.velocities, &self.particles.inverse_masses);
        for (v, _) in velocities
            .iter_mut()
            .zip(inverse_masses)
            .filter(|(_, w)| **w > 0.0)
        {
            *v += (mean - *v) * share;
        }
    }

    /// Moves free particles under gravity and drag for one substep, and pins to their positions at
    /// `fraction` of the frame.
    fn predict(&mut self, fraction: f32) {
        let seconds = self.settings.substep_s();
        let gravity = self.settings.gravity;
        let p = &mut self.particles;
        (p.positions.par_iter_mut().zip(&mut p.previous))
            .zip(&mut p.velocities)
            .zip(&p.inverse_masses)
            .zip(&self.drag.accelerations)
            .with_min_len(CHUNK)
            .for_each(|((((position, previous), velocity), &w), &drag)| {
                *previous = *position;
                if w > 0.0 {
                    // Velocity first: symplectic Euler, which does not gain energy as explicit
                    // Euler does.
                    *velocity += (gravity + drag) * seconds;
                    *position += *velocity * seconds;
                }
            });
        let paths = self.pin_starts.iter().zip(&self.pin_targets);
        for (&particle, (start, target)) in self.cloth.pins.iter().zip(paths) {
            p.positions[particle as usize] = start.lerp(*target, fraction);
        }
    }

    /// Projects all constraints once, in the substep between two fractions of the interval.
    fn project_constraints(&mut self, of_interval: Range<f32>) {
        let seconds = self.settings.substep_s();
        let particles = &mut self.particles;
        // The order matters: each projection partly undoes the ones before it (Gauss-Seidel).
        // Coarse constraints come before fine ones. Body contact comes last, so that no other
        // constraint leaves a particle inside the body.
        self.cloth.long_range.solve(particles, &mut self.long_range);
        self.cloth.bend.solve(particles, seconds);
        self.cloth.stretch.solve(particles, seconds);
        if let Some(character) = &mut self.character {
            character.project_attachments(&self.cloth.attachments, of_interval.end, seconds, particles);
        }
        if let Some(self_contacts) = &mut self.self_contacts {
            self_contacts.project(seconds, particles);
        }
        if let Some(character) = &mut self.character {
            character.project_contacts(of_interval, particles);
        }
    }

    /// Computes velocities from the displacement in the substep.
    fn update_velocities(&mut self) {
        let per_second = self.settings.substep_s().recip();
        let max_speed = self.settings.max_speed;
        let p = &mut self.particles;
        (p.velocities.par_iter_mut().zip(&p.positions))
            .zip(&p.previous)
            .with_min_len(CHUNK)
            .for_each(|((velocity, position), previous)| {
                // A failed projection may move a particle far. The clamp keeps that error from
                // growing in the next substep.
                *velocity = ((position - previous) * per_second).clamp_length_max(max_speed);
            });
    }
}

/// Returns contact settings with the thickness and friction of the cloth's main material.
fn default_contact(cloth: &Cloth) -> ContactSettings {
    let material = cloth.material();
    ContactSettings {
        thickness_m: material.thickness,
        body_friction: Friction {
            r#static: material.static_friction,
            dynamic: material.sliding_friction,
        },
        ..Default::default()
    }
}
