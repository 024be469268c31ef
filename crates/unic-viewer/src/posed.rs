//! Shapes of skinned meshes, with normals, at ticks and between them.

use crate::Vertex;
use glam::Vec3;
use unic_core::{
    Pose, character::Character, mesh::vertex_normals, skinning::SkinningWeights, transform::Rigid,
};

/// Shape with normals, at the last two ticks and between them.
///
/// Between ticks positions are interpolated along straight lines. Body and garment are then as far
/// from each other as at the ticks.
#[derive(Clone, Debug, Default)]
pub struct TickedShape {
    before: Vec<Vertex>,
    now: Vec<Vertex>,
    shown: Vec<Vertex>,
}

impl TickedShape {
    /// Takes the shape of a new tick.
    pub fn tick(&mut self, positions: &[Vec3], normals: &[Vec3]) {
        std::mem::swap(&mut self.before, &mut self.now);
        Vertex::join(positions, normals, &mut self.now);
        // The first shape, or one of another mesh.
        if self.before.len() != self.now.len() {
            self.before.clone_from(&self.now);
        }
    }

    /// Takes the shape after a cut, and forgets what was before.
    pub fn cut(&mut self, positions: &[Vec3], normals: &[Vec3]) {
        self.tick(positions, normals);
        self.before.clone_from(&self.now);
    }

    /// Moves to a place between the ticks: `share` 0 is the earlier one, 1 the later one.
    pub fn interpolate(&mut self, share: f32) {
        Vertex::interpolate(&self.before, &self.now, share, &mut self.shown);
    }

    /// Shape at the place of the last [`interpolate`](Self::interpolate).
    pub fn shown(&self) -> &[Vertex] {
        &self.shown
    }

    /// Shape of the last tick.
    pub fn now(&self) -> &[Vertex] {
        &self.now
    }
}

/// Skins meshes to poses; holds the buffers for it.
#[derive(Clone, Debug, Default)]
pub struct Skinning {
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Skinning {
    /// Poses the body of a character. Returns world positions and normals.
    pub fn body(&mut self, character: &Character, pose: &Pose) -> (&[Vec3], &[Vec3]) {
        let body = &character.body;
        self.pose(character, pose);
        self.skin(&character.weights, &body.vertices);
        vertex_normals(&self.positions, &body.faces, &mut self.normals);
        (&self.positions, &self.normals)
    }

    fn pose(&mut self, character: &Character, pose: &Pose) {
        let skeleton = &character.skeleton;
        skeleton.forward_kinematics(pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
    }

    fn skin(&mut self, weights: &SkinningWeights, rest: &[Vec3]) {
        weights.skin(rest, &self.world_from_rest, &mut self.positions);
    }
}
