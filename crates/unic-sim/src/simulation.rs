//! The simulation of one garment: state, and its steps.

mod approach;
mod settings;
mod wearer;

pub use settings::{SettleSettings, SimulationSettings};

use crate::{
    Cloth, Particles, SimulationError,
    aggregate::AggregateScratch,
    air::Drag,
    contact::{ContactSettings, Friction},
    self_contact::SelfContacts,
};
use approach::Approach;
pub(crate) use approach::heading;
use glam::Vec3;
use rayon::prelude::*;
use std::sync::Arc;
use unic_core::{character::Character, skeleton::Pose};
use wearer::Wearer;

/// Particles that one thread takes at a time when each costs little.
const CHUNK: usize = 2048;

/// One garment in motion.
///
/// Owns the state; the [`Cloth`] and the [`Character`] are shared. Every step gives the same bytes
/// for any number of threads of the rayon pool that it is called in.
#[derive(Debug, Clone)]
pub struct Simulation {
    cloth: Arc<Cloth>,
    settings: SimulationSettings,
    wearer: Option<Wearer>,
    self_contacts: Option<SelfContacts>,
    particles: Particles,
    /// Where pins are on their way to, and where they come from.
    pin_targets: Vec<Vec3>,
    pin_starts: Vec<Vec3>,
    seconds: f64,
    drag: Drag,
    aggregates: AggregateScratch,
    vertices: Vec<Vec3>,
}

impl Simulation {
    /// Cloth alone, at rest in its rest shape.
    ///
    /// # Errors
    /// Settings out of range; attachments, which need a character.
    pub fn new(cloth: Arc<Cloth>, settings: SimulationSettings) -> Result<Self, SimulationError> {
        if !cloth.attachments.is_empty() {
            return Err(SimulationError::NoCharacter {
                what: "an attached vertex",
            });
        }
        Self::with_wearer(cloth, None, settings)
    }

    /// Cloth on a character, which stands in its bind pose; [`Simulation::settle`] begins a clip.
    ///
    /// # Errors
    /// Settings out of range; attachments to faces that the body does not have.
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
        let wearer = Wearer::new(character, cloth.rest(), contact);
        Self::with_wearer(cloth, Some(wearer), settings)
    }

    fn with_wearer(
        cloth: Arc<Cloth>,
        wearer: Option<Wearer>,
        settings: SimulationSettings,
    ) -> Result<Self, SimulationError> {
        settings.check()?;
        let self_contacts = settings
            .self_contact
            .map(|own| SelfContacts::new(&cloth.rest, own));
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
            aggregates: AggregateScratch::default(),
            vertices: Vec::new(),
            cloth,
            settings,
            wearer,
        };
        simulation.place(|rest| rest);
        Ok(simulation)
    }

    /// The garment that is simulated.
    pub fn cloth(&self) -> &Arc<Cloth> {
        &self.cloth
    }

    /// How it is simulated.
    pub fn settings(&self) -> &SimulationSettings {
        &self.settings
    }

    /// The state.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The body as it was at the last step; none without a character.
    pub fn body(&self) -> Option<&[Vec3]> {
        self.wearer.as_ref().map(Wearer::vertices)
    }

    /// Positions of the garment's vertices, world space, metres.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Simulated time since the garment was placed, seconds.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Puts the garment where `world_from_rest` maps its rest shape, at rest.
    pub fn place(&mut self, world_from_rest: impl Fn(Vec3) -> Vec3) {
        let positions = &mut self.particles.positions;
        positions.clear();
        positions.extend(self.cloth.rest.vertices.iter().map(|&v| world_from_rest(v)));
        self.particles.previous.clone_from(positions);
        self.particles.velocities.clear();
        self.particles.velocities.resize(positions.len(), Vec3::ZERO);
        let pins = self.cloth.pins.iter();
        self.pin_targets = pins.map(|&(_, p)| positions[p as usize]).collect();
        self.pin_starts.clone_from(&self.pin_targets);
        if let Some(own) = &mut self.self_contacts {
            own.reset();
        }
        self.seconds = 0.0;
        self.cloth.spread(&self.particles.positions, &mut self.vertices);
    }

    /// Sets the velocity of each particle that is not pinned, m/s.
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

    /// Where the pins are to be at the end of the next frame, in the order of
    /// [`ClothSpec::pins`](crate::ClothSpec::pins), metres. They move there evenly, then stay.
    ///
    /// # Panics
    /// When the number of places is not that of the pins.
    pub fn move_pins(&mut self, places: &[Vec3]) {
        assert_eq!(places.len(), self.cloth.pins.len(), "places of pins");
        self.pin_targets.copy_from_slice(places);
    }

    /// Begins a clip: places the rest shape on the bind pose, turned to the clip's heading, lets it
    /// leave the body that it cuts into, and moves the character into the clip's first pose, which it
    /// reaches with the velocity that leads to `second`. What it returns is the shape at `first`.
    ///
    /// Nothing of what was before plays a part: clips can be simulated in any order.
    ///
    /// # Errors
    /// No character, poses that do not fit it, an explosion.
    pub fn settle(&mut self, first: &Pose, second: &Pose) -> Result<&[Vec3], SimulationError> {
        self.settle_while([first, second], Vec3::ZERO, || true)?;
        Ok(&self.vertices)
    }

    /// [`Simulation::settle`] on the way to the first two poses of a clip, in a wind of m/s, which asks
    /// before each of its frames whether to go on. Returns whether it came to its end.
    ///
    /// # Errors
    /// Those of [`Simulation::settle`]; a wind that is not finite.
    pub fn settle_while(
        &mut self,
        [first, second]: [&Pose; 2],
        wind: Vec3,
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<bool, SimulationError> {
        let Some(wearer) = &mut self.wearer else {
            return Err(SimulationError::NoCharacter { what: "settling" });
        };
        wearer.check(first)?;
        wearer.check(second)?;
        let fps = self.settings.fps;
        let skeleton = &wearer.character().skeleton;
        let approach = Approach::new(skeleton, [first, second], fps, self.settings.settle);
        let world_from_rest = approach.world_from_rest(skeleton);
        wearer.reset(&approach.pose(-approach.seconds()));
        self.place(|rest| world_from_rest.point(rest));
        let frames = (approach.seconds() * fps).ceil() as i32;
        for frame in 1 - frames..=0 {
            if !goes_on() {
                return Ok(false);
            }
            let time = frame as f32 / fps;
            let damping = approach.damping_per_s(time, self.settings.damping_per_s);
            self.frame(Some(&approach.pose(time)), wind, damping)?;
        }
        Ok(true)
    }

    /// One frame: the character goes over to `next`, in a wind of m/s. Returns the positions of the
    /// garment's vertices.
    ///
    /// # Errors
    /// No character, a pose that does not fit it, a wind or a result that is not finite.
    pub fn step_frame(&mut self, next: &Pose, wind: Vec3) -> Result<&[Vec3], SimulationError> {
        let Some(wearer) = &self.wearer else {
            return Err(SimulationError::NoCharacter { what: "a pose" });
        };
        wearer.check(next)?;
        self.frame(Some(next), wind, self.settings.damping_per_s)?;
        Ok(&self.vertices)
    }

    /// One frame in which the character, if there is one, stays as it is.
    ///
    /// # Errors
    /// A wind or a result that is not finite.
    pub fn step_still(&mut self, wind: Vec3) -> Result<&[Vec3], SimulationError> {
        self.frame(None, wind, self.settings.damping_per_s)?;
        Ok(&self.vertices)
    }

    fn frame(&mut self, next: Option<&Pose>, wind: Vec3, damping_per_s: f32) -> Result<(), SimulationError> {
        if !wind.is_finite() {
            return Err(SimulationError::Wind);
        }
        let intervals = self.settings.intervals_per_frame;
        if let Some(wearer) = &mut self.wearer {
            wearer.begin_frame(next);
        }
        for interval in 0..intervals {
            let part = |i: u32| i as f32 / intervals as f32;
            self.interval([part(interval), part(interval + 1)], wind, damping_per_s);
        }
        self.pin_starts.clone_from(&self.pin_targets);
        self.seconds += f64::from(self.settings.fps.recip());
        self.cloth.spread(&self.particles.positions, &mut self.vertices);
        match self.vertices.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(vertex) => Err(SimulationError::NotFinite {
                vertex,
                seconds: self.seconds,
            }),
        }
    }

    /// The part of a frame between two fractions of it.
    fn interval(&mut self, [from, to]: [f32; 2], wind: Vec3, damping_per_s: f32) {
        let seconds = self.settings.interval_s();
        let substeps = self.settings.substeps_per_interval;
        self.damp((damping_per_s * seconds).min(1.0));
        let air = &self.settings.air;
        self.drag.update(air, &self.cloth, &self.particles, wind, seconds);
        if let Some(wearer) = &mut self.wearer {
            wearer.begin_interval(to, &self.particles, seconds);
        }
        if let Some(own) = &mut self.self_contacts {
            own.begin_interval(&self.particles, seconds);
            if let Some(wearer) = &self.wearer {
                own.leave_out(|particle| wearer.is_caught(particle));
            }
        }
        for substep in 0..substeps {
            let part = |s: u32| s as f32 / substeps as f32;
            let fractions = [part(substep), part(substep + 1)];
            self.predict(from + (to - from) * fractions[1]);
            self.constrain(fractions);
            self.conclude();
        }
    }

    /// Takes a share of the motion relative to the mean, whose momentum stays.
    fn damp(&mut self, share: f32) {
        if share == 0.0 {
            return;
        }
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

    /// Free motion under gravity and drag; pins to where they are at `fraction` of the frame.
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
                    *velocity += (gravity + drag) * seconds;
                    *position += *velocity * seconds;
                }
            });
        let places = self.pin_starts.iter().zip(&self.pin_targets);
        for (&(_, particle), (start, target)) in self.cloth.pins.iter().zip(places) {
            p.positions[particle as usize] = start.lerp(*target, fraction);
        }
    }

    /// All constraints once, contact last, so that nothing ends up inside the body.
    fn constrain(&mut self, fractions: [f32; 2]) {
        let seconds = self.settings.substep_s();
        let particles = &mut self.particles;
        self.cloth.aggregates.solve(particles, &mut self.aggregates);
        self.cloth.bend.solve(particles, seconds);
        self.cloth.stretch.solve(particles, seconds);
        if let Some(wearer) = &mut self.wearer {
            wearer.attach(&self.cloth.attachments, fractions[1], seconds, particles);
        }
        if let Some(own) = &mut self.self_contacts {
            own.project(seconds, particles);
        }
        if let Some(wearer) = &mut self.wearer {
            wearer.keep_out(fractions, particles);
        }
    }

    /// Velocities from what the substep did.
    fn conclude(&mut self) {
        let per_second = self.settings.substep_s().recip();
        let max_speed = self.settings.max_speed;
        let p = &mut self.particles;
        (p.velocities.par_iter_mut().zip(&p.positions))
            .zip(&p.previous)
            .with_min_len(CHUNK)
            .for_each(|((velocity, position), previous)| {
                *velocity = ((position - previous) * per_second).clamp_length_max(max_speed);
            });
    }
}

/// Contact with what the cloth is made of.
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
