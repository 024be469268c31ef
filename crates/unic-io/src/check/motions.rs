//! A motion on a skeleton.

use super::{Finding, lengths};
use glam::Vec3;
use unic_core::{
    clip::Clip,
    skeleton::{Pose, Skeleton},
};

/// Faster than any runner, m/s.
const FASTEST_ROOT: f32 = 15.0;
/// No root joint is so many times the skeleton's size above the ground: people stand on roofs.
const HIGHEST_ROOT: f32 = 20.0;
/// From the root joint of a usual skeleton to its farthest joint, metres.
const USUAL_SIZE: f32 = 0.9;
/// Joints that turn by more between frames of [`FRAME_S`] seconds are not those of a body, radians (90 degrees).
const MOST_TURN: f32 = 1.57;
const FRAME_S: f32 = 1.0 / 30.0;
/// Turns below are those of a motion that does not move, radians: the angle of equal rotations is rounded to 3e-4.
const LEAST_TURN: f32 = 1e-3;
/// Way of a root that does not move, metres.
const LEAST_WAY: f32 = 1e-4;

/// Part of a file's rotations that may be longer than a whole turn.
const MOST_TURNS: f32 = 0.05;

/// Rotation vectors of which so many are longer than a whole turn.
pub(crate) fn degrees(share: f32) -> Option<Finding> {
    (share > MOST_TURNS).then(|| {
        Finding::new(
            "motion",
            format!("{:.0} % of the rotations longer than a whole turn", 100.0 * share),
            "degrees instead of radians",
            "scale the rotation vectors by 0.01745",
        )
    })
}

/// Units, jumps and stillness of a motion; where the skeleton is not known a person's.
pub fn motion(clip: &Clip, skeleton: Option<&Skeleton>) -> Vec<Finding> {
    match still(clip) {
        Some(finding) => vec![finding],
        None => {
            let places = unit(clip, skeleton).or_else(|| jump(clip));
            [places, scrambled(clip)].into_iter().flatten().collect()
        }
    }
}

/// Speed of the root joint between frames, and the frame before; m/s.
fn fastest(clip: &Clip) -> Option<(usize, f32)> {
    let speeds = clip
        .poses
        .windows(2)
        .map(|p| p[0].trans.distance(p[1].trans) * clip.fps);
    speeds.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
}

fn unit(clip: &Clip, skeleton: Option<&Skeleton>) -> Option<Finding> {
    let root = skeleton.map_or(Vec3::ZERO, |s| s.joints()[s.root()]);
    let far = |s: &Skeleton| s.joints().iter().map(|j| j.distance(root)).fold(0.0, f32::max);
    let size = skeleton.map_or(USUAL_SIZE, far);
    let height = |pose: &Pose| (pose.trans.y + root.y - clip.ground_height).abs();
    // A skeleton without size has no unit either.
    let size = size.max(1e-3);
    let highest = lengths::median(clip.poses.iter().map(height).collect())?;
    if highest < HIGHEST_ROOT * size {
        return None;
    }
    let (unit, remedy) = lengths::words(highest / size, "the translation");
    let found = format!("a root joint {highest:.1} m above the ground (median)");
    Some(Finding::new("motion", found, unit, remedy))
}

fn jump(clip: &Clip) -> Option<Finding> {
    let (frame, speed) = fastest(clip).filter(|(_, speed)| *speed > FASTEST_ROOT)?;
    Some(Finding::new(
        "motion",
        format!("a root joint at {speed:.1} m/s in frame {frame}"),
        "a jump between two takes, or another unit than metres",
        "cut the motion there, or scale its translation to metres",
    ))
}

/// Median over frames of the largest turn of a joint.
fn turn(clip: &Clip) -> f32 {
    let largest = |pair: &[Pose]| {
        let turned = pair[0]
            .local
            .iter()
            .zip(&pair[1].local)
            .map(|(a, b)| a.angle_between(*b));
        turned.fold(0.0, f32::max)
    };
    lengths::median(clip.poses.windows(2).map(largest).collect()).unwrap_or(0.0)
}

fn scrambled(clip: &Clip) -> Option<Finding> {
    let turn = turn(clip);
    let most = MOST_TURN * (1.0 / (clip.fps * FRAME_S)).max(0.25);
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

fn still(clip: &Clip) -> Option<Finding> {
    let first = clip.poses.first()?;
    let moves = clip.poses.iter().any(|pose| {
        let turns = first
            .local
            .iter()
            .zip(&pose.local)
            .any(|(a, b)| a.angle_between(*b) > LEAST_TURN);
        turns || first.trans.distance(pose.trans) > LEAST_WAY
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
