//! Root frame: where a character stands on the ground and where it faces, without the sway of its
//! steps.

use crate::{clip::Clip, heading::Heading, skeleton::Skeleton, transform::Rigid};
use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::{PI, TAU};

/// Standard deviation of the smoothing of the root's position, seconds: it removes the sway of the
/// pelvis and keeps starts and stops.
const POSITION_SMOOTHING_S: f32 = 0.13;
/// Standard deviation of the smoothing of the root's yaw, seconds: it leaves a fifth of the
/// pelvis's rotation at one stride a second.
const YAW_SMOOTHING_S: f32 = 0.25;
/// Extent of the smoothing kernel in standard deviations.
const KERNEL_EXTENT: f32 = 3.0;

/// Position of a character on the ground and the direction that it faces.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Pod, Zeroable)]
pub struct RootFrame {
    /// World x and z, metres.
    pub position: Vec2,
    /// Yaw about +Y, radians: at 0 the character faces +Z, at π/2 it faces +X.
    pub yaw: f32,
}

impl RootFrame {
    /// Rotation `world_from_root`.
    pub fn rotation(&self) -> Quat {
        Quat::from_rotation_y(self.yaw)
    }

    /// Transform `world_from_root`, with its origin on the ground at height 0.
    pub fn world_from_root(&self) -> Rigid {
        Rigid::new(self.rotation(), Vec3::new(self.position.x, 0.0, self.position.y))
    }

    /// Unit vector (x, z) in which the character faces.
    pub fn direction(&self) -> Vec2 {
        direction_of(self.yaw)
    }

    /// Rotates a horizontal vector (x, z) of the root frame into the world.
    pub fn to_world(&self, local: Vec2) -> Vec2 {
        turned(local, self.yaw)
    }

    /// Rotates a horizontal vector (x, z) of the world into the root frame.
    pub fn to_local(&self, world: Vec2) -> Vec2 {
        turned(world, -self.yaw)
    }

    /// Returns the other frame as seen from this one.
    pub fn local_of(&self, other: &RootFrame) -> RootFrame {
        RootFrame {
            position: self.to_local(other.position - self.position),
            yaw: wrapped(other.yaw - self.yaw),
        }
    }
}

/// Unit vector (x, z) of a yaw.
pub fn direction_of(yaw: f32) -> Vec2 {
    let (sin, cos) = yaw.sin_cos();
    Vec2::new(sin, cos)
}

/// Yaw of a horizontal vector (x, z).
pub fn yaw_of(direction: Vec2) -> f32 {
    direction.x.atan2(direction.y)
}

/// Wraps an angle to −π..=π.
pub fn wrapped(angle: f32) -> f32 {
    angle - TAU * (angle / TAU).round()
}

/// Horizontal part (x, z) of a vector.
pub fn horizontal(v: Vec3) -> Vec2 {
    Vec2::new(v.x, v.z)
}

/// Turns a horizontal vector (x, z) about +Y.
fn turned(v: Vec2, yaw: f32) -> Vec2 {
    let (sin, cos) = yaw.sin_cos();
    Vec2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x)
}

/// Computes the root frame of each frame of a clip: the smoothed position and heading of the root
/// joint.
pub(super) fn root_frames(clip: &Clip, skeleton: &Skeleton) -> Vec<RootFrame> {
    let rest = horizontal(skeleton.joints()[skeleton.root()]);
    let positions: Vec<Vec2> = (clip.poses.iter())
        .map(|pose| rest + horizontal(pose.trans))
        .collect();
    let yaws = unwrapped_yaws(clip, skeleton);
    let positions = smoothed(&positions, POSITION_SMOOTHING_S * clip.fps);
    let yaws = smoothed(&yaws, YAW_SMOOTHING_S * clip.fps);
    (positions.into_iter().zip(yaws))
        .map(|(position, yaw)| RootFrame {
            position,
            yaw: wrapped(yaw),
        })
        .collect()
}

/// Heading of each frame without jumps by a full turn.
fn unwrapped_yaws(clip: &Clip, skeleton: &Skeleton) -> Vec<f32> {
    let roots: Vec<Quat> = clip.poses.iter().map(|p| p.local[skeleton.root()]).collect();
    let Some(&first) = roots.first() else {
        return Vec::new();
    };
    let mut heading = Heading::start(first);
    let mut yaws = vec![heading_yaw(&heading)];
    for pair in roots.windows(2) {
        heading.advance(pair[0], pair[1], 1.0 / clip.fps);
        let last = yaws[yaws.len() - 1];
        yaws.push(last + wrapped(heading_yaw(&heading) - last));
    }
    yaws
}

fn heading_yaw(heading: &Heading) -> f32 {
    yaw_of(horizontal(heading.rotation() * Vec3::Z)).clamp(-PI, PI)
}

/// Smooths a sequence by a Gaussian of `sigma` frames. Beyond its ends the sequence goes on as its
/// own point reflection, which keeps a steady motion unchanged.
fn smoothed<T: super::spring::SpringValue + Default>(values: &[T], sigma: f32) -> Vec<T> {
    let radius = (KERNEL_EXTENT * sigma).ceil() as isize;
    let kernel: Vec<f32> = (-radius..=radius)
        .map(|k| (-0.5 * (k as f32 / sigma.max(1e-6)).powi(2)).exp())
        .collect();
    let total: f32 = kernel.iter().sum();
    let last = values.len() as isize - 1;
    let at = |t: isize| {
        let inside = t.clamp(0, last);
        // Sequences shorter than the kernel stay at their other end.
        let mirror = (2 * inside - t).clamp(0, last);
        values[inside as usize] * 2.0 - values[mirror as usize]
    };
    (0..=last)
        .map(|t| {
            let terms = (-radius..=radius).zip(&kernel);
            terms.fold(T::default(), |sum, (k, weight)| {
                sum + at(t + k) * (*weight / total)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_a_steady_motion() {
        let line: Vec<f32> = (0..40).map(|t| 3.0 + 0.5 * t as f32).collect();
        for (a, b) in smoothed(&line, 4.0).iter().zip(&line) {
            assert!((a - b).abs() < 1e-4);
        }
        assert!((smoothed(&[1.0f32], 4.0)[0] - 1.0).abs() < 1e-5 && smoothed::<f32>(&[], 4.0).is_empty());
    }

    #[test]
    fn local_and_world_vectors_are_inverse() {
        let root = RootFrame {
            position: Vec2::new(1.0, 2.0),
            yaw: 0.7,
        };
        let v = Vec2::new(0.3, -0.8);
        assert!((root.to_local(root.to_world(v)) - v).length() < 1e-6);
        let world = root.world_from_root().vector(Vec3::new(v.x, 0.0, v.y));
        assert!((horizontal(world) - root.to_world(v)).length() < 1e-6);
        assert!((root.to_world(Vec2::Y) - root.direction()).length() < 1e-6);
        assert!((yaw_of(root.direction()) - 0.7).abs() < 1e-6);
    }
}
