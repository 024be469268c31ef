//! Motion clips: poses at a uniform frame rate.
//!
//! For tools and offline engines. A live engine makes each pose when it needs it.

use crate::skeleton::Pose;
use glam::Vec3;
use std::ops::Range;

/// Motion clip: poses of one skeleton at a uniform frame rate, with ground and wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Name, without folder or extension.
    pub name: String,
    /// Frames per second.
    pub fps: f32,
    /// Poses, one a frame.
    pub poses: Vec<Pose>,
    /// Height of the ground, metres, world space.
    pub ground_height: f32,
    /// Velocity of the air, m/s, world space, one a frame; empty in still air.
    pub wind: Vec<Vec3>,
}

impl Clip {
    /// Returns the velocity of the air in a frame, m/s, world space.
    pub fn wind_at(&self, frame: usize) -> Vec3 {
        self.wind.get(frame).copied().unwrap_or_default()
    }

    /// Number of frames T.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Returns true if the clip has no frames.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Length in seconds, from the first frame to the last.
    pub fn seconds(&self) -> f32 {
        self.len().saturating_sub(1) as f32 / self.fps
    }

    /// Returns true if both clips have the same poses, as far as the shorter one goes.
    ///
    /// Wind, ground and frame rate are not compared. A single common frame is no motion.
    pub fn has_motion_of(&self, other: &Clip) -> bool {
        let both = self.len().min(other.len());
        both > 1 && self.poses[..both] == other.poses[..both]
    }

    /// Returns the part of the clip with these frames.
    ///
    /// # Panics
    /// When the clip does not have the frames.
    pub fn part(mut self, frames: Range<usize>) -> Clip {
        if !self.wind.is_empty() {
            self.wind = frames.clone().map(|t| self.wind_at(t)).collect();
        }
        self.poses = self.poses[frames].to_vec();
        self
    }

    /// Returns the motion at another frame rate, interpolated between frames; the first frame
    /// stays.
    pub fn resampled(&self, fps: f32) -> Clip {
        // In f64: in f32, frame times of long clips are off by a share of a frame.
        let step = f64::from(self.fps) / f64::from(fps);
        let last = self.len().saturating_sub(1);
        // The tolerance of a thousandth of a frame keeps the last frame where the quotient of the
        // rates is rounded down.
        let count = if self.is_empty() {
            0
        } else {
            ((last as f64 / step) + 1e-3).floor() as usize + 1
        };
        let between = |frame: usize| {
            let at = (frame as f64 * step).min(last as f64);
            let before = at.floor() as usize;
            Between {
                before,
                after: (before + 1).min(last),
                share: (at - before as f64) as f32,
            }
        };
        let pose_at = |frame: usize| {
            let at = between(frame);
            self.poses[at.before].interpolate(&self.poses[at.after], at.share)
        };
        let wind_at = |frame: usize| {
            let at = between(frame);
            self.wind_at(at.before).lerp(self.wind_at(at.after), at.share)
        };
        let wind_count = if self.wind.is_empty() { 0 } else { count };
        Clip {
            name: self.name.clone(),
            fps,
            poses: (0..count).map(pose_at).collect(),
            ground_height: self.ground_height,
            wind: (0..wind_count).map(wind_at).collect(),
        }
    }
}

/// Time between two frames of a clip.
struct Between {
    /// Last frame at or before the time.
    before: usize,
    /// Frame after it, or the last one.
    after: usize,
    /// Share of the way from `before` to `after`, 0 to 1.
    share: f32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    /// A joint that moves at 1 m/s and turns at 1 rad/s.
    fn turning(frames: usize, fps: f32) -> Clip {
        let pose = |f: usize| Pose {
            trans: Vec3::X * f as f32 / fps,
            local: vec![Quat::from_rotation_y(f as f32 / fps)],
        };
        Clip {
            name: "turn".into(),
            fps,
            poses: (0..frames).map(pose).collect(),
            ground_height: 0.0,
            wind: Vec::new(),
        }
    }

    #[test]
    fn resampling_keeps_a_steady_motion() {
        for (from, to) in [(120.0, 30.0), (30.0, 60.0), (100.0, 30.0)] {
            let clip = turning(121, from).resampled(to);
            assert_eq!(clip.len(), (120.0 / from * to + 1e-3).floor() as usize + 1);
            for (f, pose) in clip.poses.iter().enumerate() {
                let seconds = f as f32 / to;
                assert!((pose.trans.x - seconds).abs() < 1e-5);
                assert!(pose.local[0].angle_between(Quat::from_rotation_y(seconds)) < 2e-3);
            }
        }
    }

    #[test]
    fn empty_clips_stay_empty() {
        assert!(turning(0, 30.0).resampled(60.0).is_empty());
    }
}
