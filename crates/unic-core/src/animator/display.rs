//! The garment between ticks, on a body that is shown more often than the garment moves.

use super::{Animator, AnimatorError, GarmentFrame, StepInput, tiles::for_each_tile};
use crate::{features::PointFrame, mesh::vertex_normals, skeleton::Pose, transform::Rigid};
use glam::Vec3;

/// Shows an animator's garment in poses between its ticks.
///
/// Displacements from where the skeleton carries each vertex, in the vertex's own rotated frame, are
/// interpolated between the last two ticks and put on the pose that is shown: cloth neither lags behind a
/// fast body nor cuts into it, as positions that are interpolated would.
#[derive(Clone, Debug, Default)]
pub struct Display {
    /// Of the tick before, of the last one; metres.
    before: Vec<Vec3>,
    now: Vec<Vec3>,
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Display {
    /// Looks at the garment after every reset ([`Display::cut`]) and step.
    pub fn tick(&mut self, animator: &Animator) {
        std::mem::swap(&mut self.before, &mut self.now);
        let (positions, histories) = (&animator.scratch.positions, &animator.scratch.histories);
        self.now.resize(positions.len(), Vec3::ZERO);
        for_each_tile(&mut self.now, |first, tile| {
            for (vertex, displacement) in (first..).zip(tile) {
                *displacement = histories[vertex].now.displacement(positions[vertex]);
            }
        });
        if self.before.len() != self.now.len() {
            self.before.clone_from(&self.now);
        }
    }

    /// Looks at the garment after a reset: nothing before it counts.
    pub fn cut(&mut self, animator: &Animator) {
        self.tick(animator);
        self.before.clone_from(&self.now);
    }

    /// The garment on `pose`, `share` of the way from the tick before (0) to the last one (1).
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or far off; a garment that has not been
    /// looked at.
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
        let skeleton = &model.character.skeleton;
        skeleton.forward_kinematics(pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
        let (before, now, transforms) = (&self.before, &self.now, &self.world_from_rest);
        self.positions.resize(now.len(), Vec3::ZERO);
        for_each_tile(&mut self.positions, |first, tile| {
            for (vertex, position) in (first..).zip(tile) {
                let displacement = before[vertex].lerp(now[vertex], share.clamp(0.0, 1.0));
                *position = PointFrame::new(&model.garment, vertex, transforms).position(displacement);
            }
        });
        vertex_normals(&self.positions, &model.garment.rest.faces, &mut self.normals);
        Ok(GarmentFrame {
            positions: &self.positions,
            normals: &self.normals,
        })
    }
}
