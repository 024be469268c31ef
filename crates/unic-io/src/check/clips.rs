//! Captures and their clips.

use super::{Finding, body, fit, lengths, motions, shift};
use crate::capture::{Capture, CapturedClip, Split};
use glam::Vec3;
use unic_core::{
    character::Garment,
    mesh::TriMesh,
    skeleton::{Pose, Skeleton},
    topology::edges,
};

/// Frames of a clip that are compared with the rest shape and with skinning.
const FRAMES: usize = 20;

/// A garment this far from its skinned rest shape on average does not belong to the motion, metres RMS.
const FAR_FROM_SKINNING: f32 = 0.5;

/// Cloth stretches by less than this factor in the median of its edges.
const STRETCH: f32 = 1.6;
/// A tenth of the edges of cloth is not longer by this factor; a part of the vertices in another order makes it so.
const LONGEST: f32 = 2.5;
/// Edges of a garment in another unit are all too long by the same factor, up to this spread of quartiles.
const SAME_FACTOR: f32 = 1.5;

/// Everything about a capture and the clips of these splits; `proceed` is asked before each clip.
///
/// # Errors
/// Clips that cannot be read, and those of `proceed`.
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

/// One clip: its motion, and its garment over time.
pub fn clip(capture: &Capture, clip: &CapturedClip) -> Vec<Finding> {
    let mut findings = clip.findings.clone();
    if findings.is_empty() {
        findings = motions::motion(&clip.clip, Some(&capture.character.skeleton));
    }
    let subject = format!("clip `{}`", clip.clip.name);
    findings
        .iter_mut()
        .for_each(|finding| finding.subject.clone_from(&subject));
    let positions = frames(clip).map(|t| clip.garment.frame(t));
    let garment = stretched(&subject, &capture.garment.rest, positions)
        .or_else(|| still(&subject, clip))
        .or_else(|| shift::shift(capture, clip))
        .or_else(|| elsewhere(&subject, distance_to_skinning(capture, clip)));
    findings.extend(garment);
    findings
}

/// Frames that are looked at.
fn frames(clip: &CapturedClip) -> impl Iterator<Item = usize> + Clone {
    let frames = clip.clip.len();
    (0..frames).step_by(frames.div_ceil(FRAMES).max(1))
}

/// Where an animation is to start: edges against the rest shape, and the distance to the skinned first pose.
pub fn start(positions: &[Vec3], garment: &Garment, skeleton: &Skeleton, pose: &Pose) -> Vec<Finding> {
    let stretched = stretched("start", &garment.rest, std::iter::once(positions));
    let distance = || distance_of(garment, skeleton, std::iter::once((pose, positions)));
    stretched
        .or_else(|| elsewhere("start", distance()))
        .into_iter()
        .collect()
}

/// Edge lengths against the rest shape.
fn stretched<'a>(subject: &str, rest: &TriMesh, frames: impl Iterator<Item = &'a [Vec3]>) -> Option<Finding> {
    let edges: Vec<[usize; 2]> = edges(&rest.faces)
        .into_iter()
        .map(|e| e.map(|v| v as usize))
        .collect();
    let mut ratios: Vec<f32> = Vec::new();
    for frame in frames {
        let ratio = |&[a, b]: &[usize; 2]| {
            let length = rest.vertices[a].distance(rest.vertices[b]);
            (length > 0.0).then(|| frame[a].distance(frame[b]) / length)
        };
        ratios.extend(edges.iter().filter_map(ratio));
    }
    ratios.sort_by(f32::total_cmp);
    let at = |share: f32| ratios.get((share * ratios.len() as f32) as usize).copied();
    let [low, middle, high, longest] = [at(0.25)?, at(0.5)?, at(0.75)?, at(0.9)?];
    if (1.0 / STRETCH..=STRETCH).contains(&middle) && longest < LONGEST {
        return None;
    }
    let is_one_factor = high < SAME_FACTOR * low && longest < LONGEST * middle;
    let (probably, remedy) = match lengths::unit_of(middle).filter(|_| is_one_factor) {
        Some((unit, scale)) => (
            unit,
            format!("scale the garment's positions by {scale} to metres"),
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

/// A body that moves in a garment that does not.
fn still(subject: &str, clip: &CapturedClip) -> Option<Finding> {
    let first = clip.garment.frame(0);
    let is_still = frames(clip).all(|t| clip.garment.frame(t) == first);
    is_still.then(|| {
        Finding::new(
            subject,
            "a garment that does not move",
            "a mesh exported without its simulation",
            "bake the simulation, and export every frame",
        )
    })
}

fn elsewhere(subject: &str, distance: f32) -> Option<Finding> {
    (distance > FAR_FROM_SKINNING).then(|| {
        Finding::new(
            subject,
            format!("a garment {distance:.2} m (RMS) from the skinned rest shape"),
            "another unit, axis or character",
            "export garment and motion of the same character, in metres with Y up",
        )
    })
}

/// RMS distance between the garment and its skinned rest shape, metres.
pub(crate) fn distance_to_skinning(capture: &Capture, clip: &CapturedClip) -> f32 {
    let frames = frames(clip).map(|t| (&clip.clip.poses[t], clip.garment.frame(t)));
    distance_of(&capture.garment, &capture.character.skeleton, frames)
}

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
        sum += pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>();
        count += skinned.len();
    }
    (sum / count.max(1) as f64).sqrt() as f32
}
