//! Does a garment forget what has happened once its character stands?

use super::{
    random_motion::{End, ease, placed, placeless},
    subject::{Subject, refused},
};
use crate::{error::Result, metrics::Squared};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::{cmp::Ordering, iter::repeat_n};
use unic_core::{
    animator::Start,
    clip::Clip,
    heading::Heading,
    skeleton::{Pose, Skeleton},
};
use unic_io::{Capture, Split};

/// From the last pose of the motion to the one that is stood in, seconds.
const STOPPING_S: f32 = 0.5;
/// Of standing still, seconds.
const STANDING_S: f32 = 3.0;

/// The garment three seconds after random motion has ended in half a second, against one that has
/// started as it hangs on average and has stood for the same three seconds.
///
/// The motion is cut short in ten places. The pose is that of the training frame in which the fastest
/// joint is slowest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standing {
    /// RMSE between the two, one an end of the motion, mm.
    pub rmse_mm: Vec<f64>,
    /// The largest of them, mm.
    pub worst_mm: f64,
}

pub(super) fn measure(subject: &mut Subject, ends: &[End]) -> Result<Standing> {
    let stance = stance(subject.capture)?;
    let at = |seconds: f32| (seconds * subject.fps()).round() as usize;
    let (stopping, standing) = (at(STOPPING_S), at(STANDING_S));
    subject.begin("standing still", ends.len() * (stopping + 2 * standing));
    let mut rmse_mm = Vec::new();
    for end in ends {
        let clip = halt(subject, &end.pose, &stance, [stopping, standing]);
        let restored = subject.animator.restore(end.state.clone());
        restored.map(|_| ()).map_err(|e| refused(&clip, e))?;
        subject.go_on(&clip, 1..clip.len(), &mut |_, _| {})?;
        let shaken = subject.animator.garment().positions.to_vec();
        subject.run(&clip, stopping..clip.len(), Start::MeanShape, &mut |_, _| {})?;
        let sums = Squared::between(&shaken, subject.animator.garment().positions);
        rmse_mm.push(sums.rmse_mm().unwrap_or(f64::NAN));
    }
    // What is no number is worse than any.
    let worst_mm = rmse_mm.iter().copied().max_by(f64::total_cmp);
    Ok(Standing {
        rmse_mm,
        worst_mm: worst_mm.unwrap_or(f64::NAN),
    })
}

/// Frame 0 is `from`; frame `stopping` and all that follow are the stance, where `from` is and faces.
fn halt(subject: &Subject, from: &Pose, stance: &Pose, [stopping, standing]: [usize; 2]) -> Clip {
    let skeleton = subject.skeleton();
    let forward = Heading::start(from.local[skeleton.root()]).rotation() * Vec3::Z;
    let at = Vec2::new(from.trans.x, from.trans.z);
    let to = placed(skeleton, stance, forward.x.atan2(forward.z), at);
    let blend = |t: usize| from.interpolate(&to, ease(t as f32 / stopping as f32));
    let mut poses: Vec<Pose> = (0..stopping).map(blend).collect();
    poses.extend(repeat_n(to.clone(), standing + 1));
    Clip {
        name: "standing still".into(),
        fps: subject.fps(),
        poses,
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

/// The training frame whose fastest joint is slowest, the bind pose without any.
fn stance(capture: &Capture) -> Result<Pose> {
    let skeleton = &capture.character.skeleton;
    let mut slowest: Option<(f32, Pose)> = None;
    for name in capture.clip_names(Split::Train) {
        let clip = capture.load_clip(name)?.clip;
        let steps = steps(skeleton, &clip);
        let frame =
            (0..steps.len()).min_by(|&a, &b| steps[a].partial_cmp(&steps[b]).unwrap_or(Ordering::Equal));
        if let Some(frame) = frame
            && slowest.as_ref().is_none_or(|(step, _)| steps[frame] < *step)
        {
            let pose = placeless(skeleton, &clip.poses[frame], clip.ground_height);
            slowest = Some((steps[frame], pose));
        }
    }
    Ok(slowest.map_or_else(|| skeleton.bind_pose(), |(_, pose)| pose))
}

/// How far the fastest joint moves from each frame to the next, metres.
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
