//! Checks of captures and their clips.

use super::{body, fit, shift};
use crate::{
    capture::{Capture, CapturedClip, Split},
    finding::{Finding, units::unit_of},
    motion::check_motion,
};
use glam::Vec3;
use unic_core::{Pose, character::Garment, mesh::TriMesh, skeleton::Skeleton, topology::edges};

/// Number of frames of a clip that are compared with the rest shape and with skinning: a wrong
/// unit, axis or vertex order shows in every frame.
const SAMPLED_FRAMES: usize = 20;

/// Largest RMS distance between a garment and its skinned rest shape, metres. A garment farther
/// away belongs to another motion.
const MAX_SKINNING_DISTANCE_M: f32 = 0.5;

/// Largest factor by which the median edge of cloth is stretched or compressed.
const MAX_MEDIAN_STRETCH: f32 = 1.6;
/// Largest factor by which the 90th percentile of the edges is stretched. Garments with some
/// vertices in another order exceed it.
const MAX_TAIL_STRETCH: f32 = 2.5;
/// Largest ratio of the upper and the lower quartile of edge ratios in a garment of another unit,
/// where all edges are scaled by one factor.
const MAX_UNIFORM_SPREAD: f32 = 1.5;

/// Checks a capture and the clips of `splits`. `proceed` runs before each clip and may stop the
/// check.
///
/// # Errors
/// A clip that cannot be read; an error of `proceed`.
pub fn capture<E: From<crate::Error>>(
    capture: &Capture,
    splits: &[Split],
    proceed: &mut dyn FnMut() -> std::result::Result<(), E>,
) -> std::result::Result<Vec<Finding>, E> {
    let mut findings = body::character(&capture.character);
    findings.extend(fit::garment(&capture.garment.rest, &capture.character));
    for name in splits.iter().flat_map(|split| capture.clip_names(*split)) {
        proceed()?;
        findings.extend(clip(capture, &capture.load_clip(name)?));
    }
    Ok(findings)
}

/// Checks one clip of a capture: its motion, and its garment over time.
pub fn clip(capture: &Capture, clip: &CapturedClip) -> Vec<Finding> {
    let mut findings = clip.findings.clone();
    if findings.is_empty() {
        // Rotations in degrees make every further check of the motion fail: one finding for one
        // mistake.
        findings = check_motion(&clip.clip, Some(&capture.character.skeleton));
    }
    let subject = format!("clip `{}`", clip.clip.name);
    findings
        .iter_mut()
        .for_each(|finding| finding.subject.clone_from(&subject));
    let positions = sampled_frames(clip).map(|t| clip.garment.frame(t));
    // At most one finding about the garment: a mistake found first often causes the next.
    let garment = stretched(&subject, &capture.garment.rest, positions)
        .or_else(|| motionless(&subject, clip))
        .or_else(|| shift::time_shift(capture, clip))
        .or_else(|| far_from_skinning(&subject, distance_to_skinning(capture, clip)));
    findings.extend(garment);
    findings
}

/// Returns the indices of up to [`SAMPLED_FRAMES`] frames, evenly spaced.
fn sampled_frames(clip: &CapturedClip) -> impl Iterator<Item = usize> + Clone {
    let frames = clip.clip.len();
    (0..frames).step_by(frames.div_ceil(SAMPLED_FRAMES).max(1))
}

/// Checks the garment that an animation starts from: its edges against the rest shape, and its
/// distance from the skinned first pose.
pub fn start(positions: &[Vec3], garment: &Garment, skeleton: &Skeleton, pose: &Pose) -> Vec<Finding> {
    let stretched = stretched("start", &garment.rest, std::iter::once(positions));
    let distance = || distance_of(garment, skeleton, std::iter::once((pose, positions)));
    stretched
        .or_else(|| far_from_skinning("start", distance()))
        .into_iter()
        .collect()
}

/// Compares the lengths of edges with those of the rest shape.
fn stretched<'a>(subject: &str, rest: &TriMesh, frames: impl Iterator<Item = &'a [Vec3]>) -> Option<Finding> {
    let edges: Vec<[usize; 2]> = edges(&rest.faces)
        .into_iter()
        .map(|e| e.map(|v| v as usize))
        .collect();
    let mut ratios: Vec<f32> = Vec::new();
    for frame in frames {
        let ratio = |&[a, b]: &[usize; 2]| {
            let length = rest.vertices[a].distance(rest.vertices[b]);
            // Edges between vertices at one place have no ratio.
            (length > 0.0).then(|| frame[a].distance(frame[b]) / length)
        };
        ratios.extend(edges.iter().filter_map(ratio));
    }
    ratios.sort_by(f32::total_cmp);
    let quantile = |share: f32| ratios.get((share * ratios.len() as f32) as usize).copied();
    let [low, middle, high, longest] = [quantile(0.25)?, quantile(0.5)?, quantile(0.75)?, quantile(0.9)?];
    if (1.0 / MAX_MEDIAN_STRETCH..=MAX_MEDIAN_STRETCH).contains(&middle) && longest < MAX_TAIL_STRETCH {
        return None;
    }
    let is_one_factor = high < MAX_UNIFORM_SPREAD * low && longest < MAX_TAIL_STRETCH * middle;
    let (probably, remedy) = match unit_of(middle).filter(|_| is_one_factor) {
        Some(unit) => (
            unit.name,
            format!("scale the garment's positions by {} to metres", unit.metres()),
        ),
        None if is_one_factor => (
            "another scale",
            "export garment and rest shape at one scale".to_owned(),
        ),
        None => (
            "vertices in another order than the rest shape's",
            "export rest shape and clips from the same mesh, with its vertex order kept".to_owned(),
        ),
    };
    let found = format!("edges {middle:.3} times as long as at rest (median), a tenth over {longest:.3}");
    Some(Finding::new(subject, found, probably, remedy))
}

/// Checks that the garment moves.
fn motionless(subject: &str, clip: &CapturedClip) -> Option<Finding> {
    let first = clip.garment.frame(0);
    let is_motionless = sampled_frames(clip).all(|t| clip.garment.frame(t) == first);
    is_motionless.then(|| {
        Finding::new(
            subject,
            "a garment that does not move",
            "a mesh exported without its simulation",
            "bake the simulation, and export every frame",
        )
    })
}

/// Checks the RMS distance between a garment and its skinned rest shape, metres.
fn far_from_skinning(subject: &str, distance: f32) -> Option<Finding> {
    (distance > MAX_SKINNING_DISTANCE_M).then(|| {
        Finding::new(
            subject,
            format!("a garment {distance:.2} m (RMS) from the skinned rest shape"),
            "another unit, axis or character",
            "export garment and motion of the same character, in metres with Y up",
        )
    })
}

/// Returns the RMS distance between the garment of a clip and its skinned rest shape, metres.
pub(crate) fn distance_to_skinning(capture: &Capture, clip: &CapturedClip) -> f32 {
    let frames = sampled_frames(clip).map(|t| (&clip.clip.poses[t], clip.garment.frame(t)));
    distance_of(&capture.garment, &capture.character.skeleton, frames)
}

/// Returns the RMS distance between garment positions and the rest shape skinned to the same poses.
fn distance_of<'a>(
    garment: &Garment,
    skeleton: &Skeleton,
    frames: impl Iterator<Item = (&'a Pose, &'a [Vec3])>,
) -> f32 {
    let (mut joints, mut transforms, mut skinned) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sum, mut count) = (0.0_f64, 0_usize);
    for (pose, positions) in frames {
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        garment
            .weights
            .skin(&garment.rest.vertices, &transforms, &mut skinned);
        let pairs = skinned.iter().zip(positions);
        // In f64: twenty frames of a fine garment are millions of addends.
        sum += pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>();
        count += skinned.len();
    }
    (sum / count.max(1) as f64).sqrt() as f32
}
