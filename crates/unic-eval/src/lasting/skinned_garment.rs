//! A garment skinned in one pose after another.

use glam::Vec3;
use unic_core::{Pose, character::Garment, features::PointFrame, skeleton::Skeleton, transform::Rigid};
use unic_io::Capture;

/// Garment on a skeleton in one pose: positions by linear blend skinning, and displacements from
/// them.
pub(super) struct SkinnedGarment<'a> {
    skeleton: &'a Skeleton,
    garment: &'a Garment,
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
}

impl<'a> SkinnedGarment<'a> {
    /// Prepares the garment of a capture. [`pose`](Self::pose) must follow.
    pub(super) fn new(capture: &'a Capture) -> Self {
        Self {
            skeleton: &capture.character.skeleton,
            garment: &capture.garment,
            world_from_joint: Vec::new(),
            world_from_rest: Vec::new(),
        }
    }

    /// Sets the pose.
    pub(super) fn pose(&mut self, pose: &Pose) {
        let Self { skeleton, .. } = self;
        skeleton.forward_kinematics(pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
    }

    /// Returns the coordinate frame of a vertex.
    pub(super) fn frame(&self, vertex: usize) -> PointFrame {
        PointFrame::new(self.garment, vertex, &self.world_from_rest)
    }

    /// Returns the displacement of a vertex from its world position, metres.
    pub(super) fn displacement(&self, vertex: usize, world: Vec3) -> Vec3 {
        self.frame(vertex).displacement(world)
    }

    /// Returns the largest displacement of any vertex, metres. NaN where a position is NaN.
    pub(super) fn largest_displacement(&self, world: &[Vec3]) -> f32 {
        // The rotation R_i changes no length, so that world positions do.
        let length = |(vertex, x): (usize, &Vec3)| {
            let rest = self.garment.rest.vertices[vertex];
            let skinned = self.garment.weights.position(vertex, rest, &self.world_from_rest);
            x.distance(skinned)
        };
        let lengths = world.iter().enumerate().map(length);
        // `f32::max` would drop NaN. A position that is not finite must show in the result.
        lengths.fold(0.0, |most, d| if d > most || d.is_nan() { d } else { most })
    }
}
