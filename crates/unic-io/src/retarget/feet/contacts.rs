//! Measuring and holding the standing feet of a clip.

use super::{
    flat::flatten_toes,
    foot::{Foot, FootTrack, tracks},
    held::held_track,
    pelvis::lower_pelvis,
    phases::phases,
};
use glam::Vec3;
use std::ops::Range;
use unic_core::leg::FootTarget;
use unic_core::{clip::Clip, skeleton::Skeleton, transform::Rigid};

/// Slide and depth of standing feet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FootMeasure {
    /// Time that the feet stand, summed over both feet, seconds.
    pub standing_seconds: f32,
    /// Mean horizontal speed of standing balls of the foot, m/s.
    pub slide: f32,
    /// Largest depth of a ball of the foot below its height when it stands, metres; all frames
    /// count.
    pub deepest: f32,
    /// Mean distance of standing balls of the foot from their height when they stand, metres.
    pub height_error: f32,
}

/// The phases in which each foot of a clip stands.
pub(super) struct Contacts {
    feet: Vec<Foot>,
    phases: Vec<Vec<Range<usize>>>,
}

impl Contacts {
    /// Finds the phases of a clip that stands on its `ground_height`.
    pub(super) fn find(clip: &Clip, skeleton: &Skeleton, feet: Vec<Foot>) -> Self {
        let tracks = tracks(clip, skeleton, &feet);
        let phases = (tracks.iter().zip(&feet))
            .map(|(track, foot)| phases(&track.balls, foot.ball_height + clip.ground_height, clip.fps))
            .collect();
        Self { feet, phases }
    }

    /// Measures the feet of a clip in these phases.
    pub(super) fn measure(&self, clip: &Clip, skeleton: &Skeleton) -> FootMeasure {
        let tracks = tracks(clip, skeleton, &self.feet);
        let (mut measure, mut steps, mut frames) = (FootMeasure::default(), 0, 0);
        for ((track, foot), phases) in tracks.iter().zip(&self.feet).zip(&self.phases) {
            // Signed height of the ball above its height when it stands.
            let above = |p: &Vec3| p.y - clip.ground_height - foot.ball_height;
            let depth = track.balls.iter().map(|p| -above(p)).fold(0.0, f32::max);
            measure.deepest = measure.deepest.max(depth);
            for standing in phases.iter().filter_map(|p| track.balls.get(p.clone())) {
                let moved = standing
                    .windows(2)
                    .map(|p| (p[1] - p[0]).reject_from(Vec3::Y).length());
                measure.slide += moved.sum::<f32>();
                measure.height_error += standing.iter().map(|p| above(p).abs()).sum::<f32>();
                steps += standing.len() - 1;
                frames += standing.len();
            }
        }
        measure.standing_seconds = steps as f32 / clip.fps;
        measure.slide /= measure.standing_seconds.max(f32::MIN_POSITIVE);
        measure.height_error /= frames.max(1) as f32;
        measure
    }

    /// Holds the feet of a clip in these phases.
    pub(super) fn hold(&self, clip: &mut Clip, skeleton: &Skeleton) {
        let tracks = tracks(clip, skeleton, &self.feet);
        let targets: Vec<FootTrack> = (tracks.iter().zip(&self.feet).zip(&self.phases))
            .map(|((track, foot), phases)| held_track(track, foot, phases, clip.fps))
            .collect();
        // The pelvis first: inverse kinematics can only bend a leg that reaches its target.
        lower_pelvis(clip, skeleton, &self.feet, &targets);
        let mut world: Vec<Rigid> = Vec::new();
        for (frame, pose) in clip.poses.iter_mut().enumerate() {
            // One forward kinematics for both feet: the legs do not influence each other.
            skeleton.forward_kinematics(pose, &mut world);
            for (foot, target) in self.feet.iter().zip(&targets) {
                let target = FootTarget {
                    ankle: target.ankles[frame],
                    toe: target.balls[frame],
                };
                foot.leg.reach(skeleton, pose, &world, target);
            }
        }
        // The toes last, because they depend on the final height of the ball.
        for foot in &self.feet {
            flatten_toes(clip, skeleton, foot);
        }
    }
}
