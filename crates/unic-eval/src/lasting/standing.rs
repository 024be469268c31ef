//! Standing still: whether a garment forgets past motion once its character stands.

use super::{
    random_motion::{StoppingPoint, at_origin, moved_to, smootherstep},
    runner::{Runner, refused},
};
use crate::{error::Result, metrics::SquaredErrors};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::{cmp::Ordering, iter::repeat_n};
use unic_core::{Pose, Start, clip::Clip, heading::Heading, skeleton::Skeleton};
use unic_io::{Capture, Split};

/// Time from the last pose of the motion to the standing pose, seconds.
const STOPPING_S: f32 = 0.5;
/// Time of standing still, seconds.
const STANDING_S: f32 = 3.0;

/// Difference between two garments after three seconds of standing still.
///
/// One has gone through random motion, which ends within half a second. The other has started at
/// the mean displacement. The motion is cut short in ten places. The standing pose is the training
/// frame whose fastest joint is slowest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standing {
    /// RMSE between the two garments for each end of the motion, mm.
    pub rmse_mm: Vec<f64>,
    /// Largest of these errors, mm.
    pub worst_mm: f64,
}

/// Measures the difference after each end of the random motion.
pub(super) fn measure(runner: &mut Runner, stopping_points: &[StoppingPoint]) -> Result<Standing> {
    let stance = stance(runner.capture)?;
    let at = |seconds: f32| (seconds * runner.fps()).round() as usize;
    let (stopping, standing) = (at(STOPPING_S), at(STANDING_S));
    runner.begin_measure(
        "standing still",
        stopping_points.len() * (stopping + 2 * standing),
    );
    let mut rmse_mm = Vec::new();
    for end in stopping_points {
        let clip = halting_clip(runner, &end.pose, &stance, stopping, standing);
        let restored = runner.animator.restore(end.state.clone());
        restored.map(|_| ()).map_err(|e| refused(&clip, e))?;
        runner.step_through(&clip, 1..clip.len(), &mut |_, _| {})?;
        let shaken = runner.animator.garment().positions.to_vec();
        // The reference stands for the same time, but has no past.
        runner.run(&clip, stopping..clip.len(), Start::MeanShape, &mut |_, _| {})?;
        let sums = SquaredErrors::between(&shaken, runner.animator.garment().positions);
        rmse_mm.push(sums.rmse_mm().unwrap_or(f64::NAN));
    }
    // `total_cmp` orders NaN above all numbers: a diverged run is the worst.
    let worst_mm = rmse_mm.iter().copied().max_by(f64::total_cmp);
    Ok(Standing {
        rmse_mm,
        worst_mm: worst_mm.unwrap_or(f64::NAN),
    })
}

/// Returns the motion from the pose `from` into the standing pose, at the place and in the
/// direction of `from`.
///
/// Frame 0 is `from`. Frame `stopping` and the `standing` frames that follow are the standing pose.
fn halting_clip(runner: &Runner, from: &Pose, stance: &Pose, stopping: usize, standing: usize) -> Clip {
    let skeleton = runner.skeleton();
    let forward = Heading::start(from.local[skeleton.root()]).rotation() * Vec3::Z;
    let at = Vec2::new(from.trans.x, from.trans.z);
    let to = moved_to(skeleton, stance, forward.x.atan2(forward.z), at);
    // Blending with smootherstep starts and ends without acceleration.
    let blend = |t: usize| from.interpolate(&to, smootherstep(t as f32 / stopping as f32));
    let mut poses: Vec<Pose> = (0..stopping).map(blend).collect();
    poses.extend(repeat_n(to.clone(), standing + 1));
    Clip {
        name: "standing still".into(),
        fps: runner.fps(),
        poses,
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

/// Returns the training pose whose fastest joint is slowest, or the bind pose without training
/// clips.
fn stance(capture: &Capture) -> Result<Pose> {
    let skeleton = &capture.character.skeleton;
    let mut slowest: Option<(f32, Pose)> = None;
    for name in capture.clip_names(Split::Train) {
        let clip = capture.load_clip(name)?.clip;
        let steps = steps(skeleton, &clip);
        let frame =
            // NaN compares as equal, so that it is never a reason to choose a frame.
            (0..steps.len()).min_by(|&a, &b| steps[a].partial_cmp(&steps[b]).unwrap_or(Ordering::Equal));
        if let Some(frame) = frame
            && slowest.as_ref().is_none_or(|(step, _)| steps[frame] < *step)
        {
            let pose = at_origin(skeleton, &clip.poses[frame], clip.ground_height);
            slowest = Some((steps[frame], pose));
        }
    }
    Ok(slowest.map_or_else(|| skeleton.bind_pose(), |(_, pose)| pose))
}

/// Returns the distance that the fastest joint moves from each frame to the next, metres.
fn steps(skeleton: &Skeleton, clip: &Clip) -> Vec<f32> {
    let mut joints = [Vec::new(), Vec::new()];
    let mut step = |pair: &[Pose]| {
        for (pose, joints) in pair.iter().zip(&mut joints) {
            skeleton.forward_kinematics(pose, joints);
        }
        let moved = joints[0].iter().zip(&joints[1]);
        moved
            .map(|(a, b)| a.translation.distance(b.translation))
            .fold(0.0, f32::max)
    };
    clip.poses.windows(2).map(&mut step).collect()
}
