//! Motion of the figure in the tube, and the response of the tube.

use crate::capture::{Figure, Take};
use glam::{Quat, Vec3};
use unic_core::{Pose, clip::Clip};

/// Frames a second of every clip.
pub const FPS: f32 = 30.0;

/// Time constant of the tube's memory, seconds.
const MEMORY_S: f32 = 0.2;

/// Displacement of the lowest ring at a steady speed of 1 m/s, metres: negative, since it trails.
const SWING_M: f32 = -0.1;

/// Clip of a slow walk with bows, leans and turns, in which the arms move independently.
///
/// `seed` shifts it in time.
pub fn clip(name: &str, seed: usize, frames: usize) -> Clip {
    let pose = |t: usize| {
        // Each seed begins 17 frames later than the one before.
        let s = (t + 17 * seed) as f32 / FPS;
        let local = vec![
            Quat::from_rotation_y(0.5 * (2.0 * s).cos()),
            Quat::from_rotation_x(0.4 * (5.0 * s).sin()) * Quat::from_rotation_z(0.3 * (4.0 * s).sin()),
            Quat::from_rotation_z(0.6 * (3.0 * s).sin()),
            Quat::from_rotation_z(0.5 * (7.0 * s).cos()),
            Quat::from_rotation_x(0.5 * (6.0 * s).sin()),
            Quat::from_rotation_x(-0.4 * (6.0 * s).sin()),
        ];
        let trans = Vec3::new(0.1 * (3.0 * s).sin(), 0.02 * (6.0 * s).cos(), 0.4 * s);
        Pose { trans, local }
    };
    Clip {
        name: name.into(),
        fps: FPS,
        poses: (0..frames).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

/// Take of [`clip`] with the tube, whose lower rings follow the hip with a time constant of 0.2 s.
pub fn take(name: &str, seed: usize, frames: usize) -> Take {
    Figure::tube().swung(clip(name, seed, frames))
}

impl Figure {
    /// Take of a clip in which the garment's lower rings follow the hip with a time constant of 0.2
    /// s.
    pub fn swung(&self, clip: Clip) -> Take {
        let (rest, mut swing) = (&self.garment.rest, Vec3::ZERO);
        let mut garment = self.skinned(&clip);
        for (t, positions) in garment.iter_mut().enumerate() {
            let velocity = (clip.poses[t].trans - clip.poses[t.saturating_sub(1)].trans) * FPS;
            // First-order low-pass filter, discretised exactly for a constant velocity in a frame.
            swing += ((velocity * SWING_M) - swing) * (1.0 - f32::exp(-1.0 / (MEMORY_S * FPS)));
            // The tube reaches from y = 0.7 m, where the swing is full, to 1.4 m, where it is zero.
            for (position, rest) in positions.iter_mut().zip(&rest.vertices) {
                *position += swing * (1.4 - rest.y) / 0.7;
            }
        }
        Take { clip, garment }
    }
}
