//! Checks of a motion on a skeleton.

use crate::finding::{
    Finding,
    units::{Diagnosis, diagnose, median},
};
use glam::Vec3;
use unic_core::{Pose, clip::Clip, skeleton::Skeleton};

/// Largest plausible speed of the root joint, m/s. Runners stay below 13 m/s.
const MAX_ROOT_SPEED: f32 = 15.0;
/// Largest plausible median height of the root joint, in sizes of the skeleton. People also stand
/// on roofs.
const MAX_ROOT_HEIGHT: f32 = 20.0;
/// Distance from the root joint of a usual skeleton to its farthest joint, metres.
const USUAL_SIZE: f32 = 0.9;
/// Smallest size that heights are divided by, metres: a skeleton of one joint has no size.
const MIN_SIZE: f32 = 1e-3;
/// Largest plausible rotation of a joint between frames of [`FRAME_S`] seconds, radians: 90
/// degrees.
const MAX_TURN: f32 = 1.57;
/// Frame time that [`MAX_TURN`] belongs to, seconds.
const FRAME_S: f32 = 1.0 / 30.0;
/// Lower limit of the factor on [`MAX_TURN`] for high frame rates, reached at 120 fps: the jitter
/// of motion capture does not shrink with the frame time.
const MIN_TURN_SHARE: f32 = 0.25;
/// Rotation below which a joint counts as motionless, radians. The computed angle between equal
/// rotations is up to 3e-4, because the arc cosine is steep near 1.
const MOTIONLESS_TURN: f32 = 1e-3;
/// Displacement below which the root counts as motionless, metres.
const MOTIONLESS_DISTANCE: f32 = 1e-4;

/// Largest plausible share of rotation vectors that are longer than a whole turn.
const MAX_TURNS_SHARE: f32 = 0.05;

/// Reports rotation vectors in degrees, by the share of them that is longer than a whole turn.
pub(super) fn degrees(share: f32) -> Option<Finding> {
    (share > MAX_TURNS_SHARE).then(|| {
        Finding::new(
            "motion",
            format!("{:.0} % of the rotations longer than a whole turn", 100.0 * share),
            "degrees instead of radians",
            "scale the rotation vectors by 0.01745",
        )
    })
}

/// Checks the units, speed and rotations of a motion, and whether it moves at all.
///
/// Without a `skeleton` the size of a person is assumed.
pub fn check_motion(clip: &Clip, skeleton: Option<&Skeleton>) -> Vec<Finding> {
    match motionless(clip) {
        Some(finding) => vec![finding],
        None => {
            // A wrong unit also makes the root too fast: one finding for one mistake.
            let translation = unit(clip, skeleton).or_else(|| jump(clip));
            [translation, wild_rotations(clip)]
                .into_iter()
                .flatten()
                .collect()
        }
    }
}

/// The largest speed of the root joint between two frames of a clip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RootSpeed {
    /// Index of the earlier frame.
    pub(crate) frame: usize,
    /// Speed, m/s.
    pub(crate) speed: f32,
}

/// Returns the largest speed of the root joint; `None` for a clip of fewer than two frames.
pub(crate) fn max_root_speed(clip: &Clip) -> Option<RootSpeed> {
    let speeds = clip
        .poses
        .windows(2)
        .map(|p| p[0].trans.distance(p[1].trans) * clip.fps);
    let fastest = speeds.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    fastest.map(|(frame, speed)| RootSpeed { frame, speed })
}

/// Checks the unit of the translation by the median height of the root joint.
fn unit(clip: &Clip, skeleton: Option<&Skeleton>) -> Option<Finding> {
    let root = skeleton.map_or(Vec3::ZERO, |s| s.joints()[s.root()]);
    let far = |s: &Skeleton| s.joints().iter().map(|j| j.distance(root)).fold(0.0, f32::max);
    let size = skeleton.map_or(USUAL_SIZE, far);
    let height = |pose: &Pose| (pose.trans.y + root.y - clip.ground_height).abs();
    let size = size.max(MIN_SIZE);
    let highest = median(clip.poses.iter().map(height).collect())?;
    if highest < MAX_ROOT_HEIGHT * size {
        return None;
    }
    let Diagnosis { probably, remedy } = diagnose(highest / size, "the translation");
    let found = format!("a root joint {highest:.1} m above the ground (median)");
    Some(Finding::new("motion", found, probably, remedy))
}

/// Checks the speed of the root joint.
fn jump(clip: &Clip) -> Option<Finding> {
    let RootSpeed { frame, speed } = max_root_speed(clip).filter(|fastest| fastest.speed > MAX_ROOT_SPEED)?;
    Some(Finding::new(
        "motion",
        format!("a root joint at {speed:.1} m/s in frame {frame}"),
        "a jump between two takes, or another unit than metres",
        "cut the motion there, or scale its translation to metres",
    ))
}

/// Returns the median over frames of the largest rotation of a joint from frame to frame, radians.
fn median_turn(clip: &Clip) -> f32 {
    let largest = |pair: &[Pose]| {
        let turned = pair[0]
            .local
            .iter()
            .zip(&pair[1].local)
            .map(|(a, b)| a.angle_between(*b));
        turned.fold(0.0, f32::max)
    };
    median(clip.poses.windows(2).map(largest).collect()).unwrap_or(0.0)
}

/// Checks that joints turn at plausible rates.
fn wild_rotations(clip: &Clip) -> Option<Finding> {
    let turn = median_turn(clip);
    let most = MAX_TURN * (1.0 / (clip.fps * FRAME_S)).max(MIN_TURN_SHARE);
    (turn > most).then(|| {
        Finding::new(
            "motion",
            format!(
                "joints that turn by {:.0} degrees from frame to frame (median)",
                turn.to_degrees()
            ),
            "rotations in degrees, Euler angles or quaternions instead of axis-angle in radians",
            "store axis-angle vectors in radians",
        )
    })
}

/// Checks that any frame differs from the first.
fn motionless(clip: &Clip) -> Option<Finding> {
    let first = clip.poses.first()?;
    let moves = clip.poses.iter().any(|pose| {
        let turns = first
            .local
            .iter()
            .zip(&pose.local)
            .any(|(a, b)| a.angle_between(*b) > MOTIONLESS_TURN);
        turns || first.trans.distance(pose.trans) > MOTIONLESS_DISTANCE
    });
    (!moves).then(|| {
        Finding::new(
            "motion",
            format!("{} frames that are all the same", clip.len()),
            "channels of constant keys, as an export without baking leaves them",
            "bake the animation, and export every frame",
        )
    })
}
