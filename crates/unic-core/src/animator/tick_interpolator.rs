//! Interpolation of the garment between ticks, for displays that are faster than the model.

use super::{Animator, AnimatorError, GarmentFrame, StepInput, tiles::for_each_tile};
use crate::{
    features::PointFrame, mesh::vertex_normals, model::Model, parallel::install_if_some, skeleton::Pose,
    transform::Rigid,
};
use glam::Vec3;

/// Interpolates an animator's garment between its last two ticks, on any pose.
///
/// It interpolates displacements from skinning, in the vertices' own rotated frames, and adds them
/// to the garment skinned to the shown pose. Interpolated positions would lag behind a fast body
/// and cut into it. It runs on the threads of the animator.
#[derive(Clone, Debug, Default)]
pub struct TickInterpolator {
    /// Vertex displacements after the previous tick, in metres.
    before: Vec<Vec3>,
    /// Vertex displacements after the last tick, in metres.
    now: Vec<Vec3>,
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl TickInterpolator {
    /// Records the garment after a step of the animator; call it after every step.
    pub fn tick(&mut self, animator: &Animator) {
        // The older buffer is overwritten.
        std::mem::swap(&mut self.before, &mut self.now);
        let (positions, histories) = (&animator.scratch.positions, &animator.scratch.histories);
        self.now.resize(positions.len(), Vec3::ZERO);
        install_if_some(animator.threads.clone(), || {
            for_each_tile(&mut self.now, |first, tile| {
                for (vertex, displacement) in (first..).zip(tile) {
                    // Of the shown positions, so that corrections of intersections are interpolated
                    // too.
                    *displacement = histories[vertex].now.displacement(positions[vertex]);
                }
            });
        });
        // The first garment that is recorded, or one of another mesh.
        if self.before.len() != self.now.len() {
            self.before.clone_from(&self.now);
        }
    }

    /// Records the garment after a reset and forgets what was recorded before.
    pub fn cut(&mut self, animator: &Animator) {
        self.tick(animator);
        self.before.clone_from(&self.now);
    }

    /// Returns the garment on `pose`, with displacements between those of the previous tick
    /// (`share` 0) and the last one (1).
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or beyond
    /// [`FARTHEST`](super::FARTHEST); a garment that was never recorded.
    pub fn show(
        &mut self,
        animator: &Animator,
        pose: &Pose,
        share: f32,
    ) -> Result<GarmentFrame<'_>, AnimatorError> {
        let model = &animator.model;
        let input = StepInput {
            pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        input.check(model)?;
        let (expected, found) = (model.vertex_count(), self.now.len());
        if expected != found {
            return Err(AnimatorError::Vertices { expected, found });
        }
        install_if_some(animator.threads.clone(), || self.interpolate(model, pose, share));
        Ok(GarmentFrame {
            positions: &self.positions,
            normals: &self.normals,
        })
    }

    /// Writes positions and normals for a checked pose.
    fn interpolate(&mut self, model: &Model, pose: &Pose, share: f32) {
        let skeleton = &model.character.skeleton;
        skeleton.forward_kinematics(pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
        let (before, now, transforms) = (&self.before, &self.now, &self.world_from_rest);
        self.positions.resize(now.len(), Vec3::ZERO);
        for_each_tile(&mut self.positions, |first, tile| {
            for (vertex, position) in (first..).zip(tile) {
                // Extrapolated displacements would overshoot.
                let displacement = before[vertex].lerp(now[vertex], share.clamp(0.0, 1.0));
                *position = PointFrame::new(&model.garment, vertex, transforms).position(displacement);
            }
        });
        vertex_normals(&self.positions, &model.garment.rest.faces, &mut self.normals);
    }
}
