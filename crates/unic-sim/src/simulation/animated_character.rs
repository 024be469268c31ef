//! The character that wears the garment, posed over time.

use crate::{
    Attachment, Particles, SimulationError,
    body::BodyInterval,
    contact::{BareLimbs, BodyContacts, ContactSettings, FoldFilter, hits_in_bind_pose},
};
use glam::Vec3;
use std::{ops::Range, sync::Arc};
use unic_core::{Pose, character::Character, mesh::TriMesh, transform::Rigid};

/// A character with its current poses and its contacts with the cloth.
#[derive(Debug, Clone)]
pub(super) struct AnimatedCharacter {
    character: Arc<Character>,
    /// Pose at the start of the frame.
    pose: Pose,
    /// Pose at the end of the frame.
    next: Pose,
    body: BodyInterval,
    contacts: BodyContacts,
    // Scratch of `skin`.
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
    vertices: Vec<Vec3>,
}

impl AnimatedCharacter {
    /// Creates a character in its bind pose. `rest` holds the garment's particles and faces on that
    /// pose.
    pub(super) fn new(character: Arc<Character>, rest: &TriMesh, contact: ContactSettings) -> Self {
        let pose = character.skeleton.bind_pose();
        let contacts = BodyContacts::new(&character.body, rest.vertices.len(), contact);
        let hits = hits_in_bind_pose(&character.body, rest);
        Self {
            next: pose.clone(),
            pose,
            body: BodyInterval::new(&character.body),
            contacts: contacts
                .with_limbs(BareLimbs::new(&character, rest, &hits))
                .with_fold_filter(FoldFilter::new(&character.body, &hits)),
            world_from_joint: Vec::new(),
            world_from_rest: Vec::new(),
            vertices: character.body.vertices.clone(),
            character,
        }
    }

    /// Returns the character's asset: body, skeleton and skinning weights.
    pub(super) fn asset(&self) -> &Character {
        &self.character
    }

    /// Returns the body's vertices at the end of the current interval, world space, metres.
    pub(super) fn vertices(&self) -> &[Vec3] {
        self.body.end()
    }

    /// Checks that a pose belongs to this skeleton and is finite.
    pub(super) fn check(&self, pose: &Pose) -> Result<(), SimulationError> {
        let (expected, found) = (self.character.skeleton.len(), pose.local.len());
        if expected == found && pose.is_valid() {
            return Ok(());
        }
        Err(SimulationError::Pose { expected, found })
    }

    /// Places the character in a pose, without motion, and forgets all contacts.
    pub(super) fn reset(&mut self, pose: &Pose) {
        self.pose.clone_from(pose);
        self.next.clone_from(pose);
        self.skin(0.0);
        self.body.reset(&self.vertices);
        self.contacts.reset();
    }

    /// Starts a frame that ends in the pose `next`; `None` keeps the current pose.
    pub(super) fn begin_frame(&mut self, next: Option<&Pose>) {
        std::mem::swap(&mut self.pose, &mut self.next);
        match next {
            Some(next) => self.next.clone_from(next),
            None => self.next.clone_from(&self.pose),
        }
    }

    /// Poses the body at `fraction` of the frame and detects contacts for the interval that ends
    /// there and lasts `seconds`.
    pub(super) fn begin_interval(&mut self, fraction: f32, particles: &Particles, seconds: f32) {
        self.skin(fraction);
        self.body.advance(&self.vertices);
        self.contacts.begin_interval(&self.body, particles, seconds);
    }

    /// Returns whether a particle is in contact with a fold of the body in this interval.
    pub(super) fn is_in_fold(&self, particle: usize) -> bool {
        self.contacts.is_in_fold(particle)
    }

    /// Projects attachments: moves particles to their targets at `fraction` of the interval, as
    /// XPBD springs in a substep of `seconds`.
    pub(super) fn project_attachments(
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
                let target = self.target(attachment, fraction);
                let position = &mut particles.positions[particle];
                *position += (target - *position) * share;
            }
        }
    }

    /// Projects body and ground contacts in the substep between two fractions of the interval.
    pub(super) fn project_contacts(&mut self, of_interval: Range<f32>, particles: &mut Particles) {
        self.contacts
            .project(&self.body, of_interval.start, of_interval.end, particles);
    }

    /// Returns the position that an attachment prescribes at `fraction` of the interval, metres.
    fn target(&self, attachment: &Attachment, fraction: f32) -> Vec3 {
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
            ..
        } = &*self.character;
        // Joint rotations are interpolated, not vertices: within a frame limbs move on arcs. Within
        // an interval vertices move on straight lines, see `BodyInterval`.
        let pose = self.pose.interpolate(&self.next, fraction);
        skeleton.forward_kinematics(&pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
        weights.skin(&body.vertices, &self.world_from_rest, &mut self.vertices);
    }
}
