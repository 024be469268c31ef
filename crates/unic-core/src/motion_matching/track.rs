//! Track of a clip: where its joints and its root frame are in each frame.

use super::root::{RootFrame, root_frames};
use crate::{clip::Clip, skeleton::Skeleton, transform::Rigid};
use glam::{Vec2, Vec3};

/// World transforms and root frames of a clip, above ground height 0.
pub(super) struct Track {
    pub(super) roots: Vec<RootFrame>,
    pub(super) world: Vec<Vec<Rigid>>,
}

impl Track {
    pub(super) fn new(clip: &Clip, skeleton: &Skeleton) -> Self {
        let world = |pose| {
            let mut world = Vec::new();
            skeleton.forward_kinematics(pose, &mut world);
            for joint in &mut world {
                joint.translation.y -= clip.ground_height;
            }
            world
        };
        Self {
            roots: root_frames(clip, skeleton),
            world: clip.poses.iter().map(world).collect(),
        }
    }

    /// Velocity of a joint, m/s: the backward difference; in the first frame that of the second.
    pub(super) fn velocity(&self, joint: usize, t: usize, fps: f32) -> Vec3 {
        let t = t.max(1);
        (self.world[t][joint].translation - self.world[t - 1][joint].translation) * fps
    }

    /// Velocity of a joint from the frame before to the frame after, m/s.
    pub(super) fn central_velocity(&self, joint: usize, t: usize, fps: f32) -> Vec3 {
        let (before, after) = (t.saturating_sub(1), (t + 1).min(self.world.len() - 1));
        let way = self.world[after][joint].translation - self.world[before][joint].translation;
        way * (fps / (after - before).max(1) as f32)
    }

    /// Root frame a number of frames from `t`. Beyond the ends of the clip the root goes straight
    /// on, without turning.
    pub(super) fn root_at(&self, t: usize, frames: isize) -> RootFrame {
        let last = self.roots.len() as isize - 1;
        let wanted = t as isize + frames;
        let inside = wanted.clamp(0, last);
        let root = self.roots[inside as usize];
        // Speed over several frames: that of a single one is noisy.
        let near = (inside - 3 * (wanted - inside).signum()).clamp(0, last);
        let beyond = match inside - near {
            0 => Vec2::ZERO,
            gap => {
                (root.position - self.roots[near as usize].position) * ((wanted - inside) as f32 / gap as f32)
            }
        };
        RootFrame {
            position: root.position + beyond,
            yaw: root.yaw,
        }
    }
}
