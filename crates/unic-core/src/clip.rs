//! Motion clips.

use crate::skeleton::Pose;
use glam::Vec3;
use std::ops::Range;

/// Poses at a uniform frame rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Name, without folder or extension.
    pub name: String,
    /// Frames per second.
    pub fps: f32,
    /// One a frame, all of one skeleton.
    pub poses: Vec<Pose>,
    /// Height of the ground, metres, world space.
    pub ground_height: f32,
    /// Velocity of the air, m/s, world space: one a frame, or none in still air.
    pub wind: Vec<Vec3>,
}

impl Clip {
    /// Velocity of the air in a frame, m/s, world space.
    pub fn wind_at(&self, frame: usize) -> Vec3 {
        self.wind.get(frame).copied().unwrap_or_default()
    }

    /// Number of frames T.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// No frames at all.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// Length in seconds, from the first frame to the last.
    pub fn seconds(&self) -> f32 {
        self.len().saturating_sub(1) as f32 / self.fps
    }

    /// Does the character do the same as far as both go, whatever the air does?
    pub fn has_motion_of(&self, other: &Clip) -> bool {
        let both = self.len().min(other.len());
        both > 1 && self.poses[..both] == other.poses[..both]
    }

    /// Some of the frames.
    ///
    /// # Panics
    /// Of frames that the clip does not have.
    pub fn part(mut self, frames: Range<usize>) -> Clip {
        if !self.wind.is_empty() {
            self.wind = frames.clone().map(|t| self.wind_at(t)).collect();
        }
        self.poses = self.poses[frames].to_vec();
        self
    }

    /// The same motion at another frame rate, interpolated between frames; the first frame stays.
    pub fn resampled(&self, fps: f32) -> Clip {
        let step = f64::from(self.fps) / f64::from(fps);
        let last = self.len().saturating_sub(1);
        // A thousandth of a frame of slack keeps the last frame when the rates divide each other.
        let count = if self.is_empty() {
            0
        } else {
            ((last as f64 / step) + 1e-3).floor() as usize + 1
        };
        let between = |frame: usize| {
            let at = (frame as f64 * step).min(last as f64);
            let before = at.floor() as usize;
            (before, (before + 1).min(last), (at - before as f64) as f32)
        };
        let pose_at = |frame: usize| {
            let (before, after, share) = between(frame);
            self.poses[before].interpolate(&self.poses[after], share)
        };
        let wind_at = |frame: usize| {
            let (before, after, share) = between(frame);
            self.wind_at(before).lerp(self.wind_at(after), share)
        };
        let windy = if self.wind.is_empty() { 0 } else { count };
        Clip {
            name: self.name.clone(),
            fps,
            poses: (0..count).map(pose_at).collect(),
            ground_height: self.ground_height,
            wind: (0..windy).map(wind_at).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

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
    fn a_steady_turn_is_the_same_at_any_rate() {
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
