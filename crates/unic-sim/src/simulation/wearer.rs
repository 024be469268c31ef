//! The character that wears the garment, posed along the way.

use crate::{
    Attachment, Particles, SimulationError,
    body::BodyInterval,
    contact::{BodyContacts, ContactSettings, Limbs},
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{character::Character, mesh::TriMesh, skeleton::Pose, transform::Rigid};

/// A character, where it is, and what of it the cloth touches.
#[derive(Debug, Clone)]
pub(super) struct Wearer {
    character: Arc<Character>,
    /// At the start and at the end of the frame.
    pose: Pose,
    next: Pose,
    body: BodyInterval,
    contacts: BodyContacts,
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
    vertices: Vec<Vec3>,
}

impl Wearer {
    /// In the bind pose, wearing particles that are there at `rest`.
    pub(super) fn new(character: Arc<Character>, rest: &TriMesh, contact: ContactSettings) -> Self {
        let pose = character.skeleton.bind_pose();
        let contacts = BodyContacts::new(&character.body, rest.vertices.len(), contact);
        Self {
            next: pose.clone(),
            pose,
            body: BodyInterval::new(&character.body),
            contacts: contacts.with_limbs(Limbs::new(&character, rest)),
            world_from_joint: Vec::new(),
            world_from_rest: Vec::new(),
            vertices: character.body.vertices.clone(),
            character,
        }
    }

    pub(super) fn character(&self) -> &Character {
        &self.character
    }

    /// The body as it is now.
    pub(super) fn vertices(&self) -> &[Vec3] {
        self.body.end()
    }

    /// # Errors
    /// A pose of another skeleton, or one that is not finite.
    pub(super) fn check(&self, pose: &Pose) -> Result<(), SimulationError> {
        let (expected, found) = (self.character.skeleton.len(), pose.local.len());
        if expected == found && pose.is_valid() {
            return Ok(());
        }
        Err(SimulationError::Pose { expected, found })
    }

    /// Stands still in a pose, with no memory of contacts.
    pub(super) fn reset(&mut self, pose: &Pose) {
        self.pose.clone_from(pose);
        self.next.clone_from(pose);
        self.skin(0.0);
        self.body.reset(&self.vertices);
        self.contacts.reset();
    }

    /// Sets out for the pose at the end of a frame; none stays.
    pub(super) fn begin_frame(&mut self, next: Option<&Pose>) {
        std::mem::swap(&mut self.pose, &mut self.next);
        match next {
            Some(next) => self.next.clone_from(next),
            None => self.next.clone_from(&self.pose),
        }
    }

    /// Goes on to `fraction` of the frame and looks for what the cloth can touch on the way.
    pub(super) fn begin_interval(&mut self, fraction: f32, particles: &Particles, seconds: f32) {
        self.skin(fraction);
        self.body.advance(&self.vertices);
        self.contacts.begin_interval(&self.body, particles, seconds);
    }

    /// Whether a particle touches a fold of the body in this interval.
    pub(super) fn is_caught(&self, particle: usize) -> bool {
        self.contacts.is_caught(particle)
    }

    /// Draws attached particles to their places at `fraction` of the interval, each as a spring of
    /// its compliance in a step of `seconds`.
    pub(super) fn attach(
        &self,
        attachments: &[Attachment],
        fraction: f32,
        seconds: f32,
        particles: &mut Particles,
    ) {
        for attachment in attachments {
            let particle = attachment.vertex as usize;
            let w = particles.inverse_masses[particle];
            if w > 0.0 {
                let share = w / (w + attachment.compliance / (seconds * seconds));
                let place = self.place(attachment, fraction);
                let position = &mut particles.positions[particle];
                *position += (place - *position) * share;
            }
        }
    }

    /// Keeps particles out of the body between two fractions of the interval.
    pub(super) fn keep_out(&mut self, [before, after]: [f32; 2], particles: &mut Particles) {
        self.contacts.project(&self.body, before, after, particles);
    }

    fn place(&self, attachment: &Attachment, fraction: f32) -> Vec3 {
        let corner = |weights: Vec3| self.body.point(attachment.face, weights, fraction);
        let [a, b, c] = Vec3::AXES.map(corner);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        corner(attachment.barycentric) + normal * attachment.offset
    }

    /// Skins the body at `fraction` of the frame.
    fn skin(&mut self, fraction: f32) {
        let Character {
            body,
            skeleton,
            weights,
        } = &*self.character;
        let pose = self.pose.interpolate(&self.next, fraction);
        skeleton.forward_kinematics(&pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
        weights.skin(&body.vertices, &self.world_from_rest, &mut self.vertices);
    }
}
