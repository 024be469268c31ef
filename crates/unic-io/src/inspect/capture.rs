//! Captures.

use super::{Kind, Report, arrays, mesh};
use crate::capture::{Capture, CapturedClip, Split, WeightsSource};
use std::path::Path;
use unic_core::surface::Surface;

/// Frames of a clip whose garment is compared with its skinning.
const FRAMES_COMPARED: usize = 20;

/// A garment this far from its skinned rest shape on average does not belong to the motion.
const FAR_FROM_SKINNING: f32 = 0.5;

/// A rest shape with more of its vertices inside the body is probably not in its bind pose.
const MOSTLY_INSIDE: f32 = 0.3;

pub(super) fn inspect(root: &Path) -> Report {
    let mut report = Report::new(root, Kind::Capture);
    let Some(capture) = report.take(Capture::open(root)) else {
        return report;
    };
    let manifest = &capture.manifest;
    report.fact("name", &manifest.name);
    report.fact("frames per second", manifest.fps);
    report.fact("provenance", manifest.provenance.trim());
    if manifest.provenance.trim().is_empty() {
        report.problem("capture.toml: expected provenance (source and licence), found none");
    }
    arrays::describe_character(&mut report, &capture.character);
    contacts(&mut report, &capture);
    garment(&mut report, &capture);
    clips(&mut report, &capture);
    report
}

fn contacts(report: &mut Report, capture: &Capture) {
    let names = capture.character.skeleton.names();
    let contacts: Vec<&str> = (capture.contact_joints.iter())
        .filter_map(|&j| names.get(j).map(String::as_str))
        .collect();
    report.fact("contact joints", contacts.join(" "));
}

fn garment(report: &mut Report, capture: &Capture) {
    let rest = &capture.garment.rest;
    mesh::describe(report, "garment", rest);
    report.fact(
        "garment weights",
        match capture.weights_source {
            WeightsSource::File => "garment.npz",
            WeightsSource::Diffused => "nearest body vertex's, diffused over the garment",
        },
    );
    if let Some(mask) = &capture.garment.mask {
        describe_mask(report, mask);
    }
    let body = Surface::build(&capture.character.body);
    let depths: Vec<f32> = (rest.vertices.iter())
        .filter_map(|&v| Some(-body.closest(v)?.signed_distance))
        .collect();
    let inside = depths.iter().filter(|d| **d > 0.0).count();
    let deepest = depths.iter().copied().fold(0.0, f32::max);
    let share = inside as f32 / depths.len().max(1) as f32;
    let text = format!(
        "{:.1} % of the vertices, at most {:.1} mm deep",
        100.0 * share,
        1e3 * deepest
    );
    report.fact("garment inside the body at rest", text);
    if share > MOSTLY_INSIDE {
        report.problem(format!(
            "garment.obj: expected a rest shape around the body in its bind pose, found {:.0} % of \
             its vertices inside",
            100.0 * share
        ));
    }
}

fn clips(report: &mut Report, capture: &Capture) {
    let Some(on_disk) = report.take(capture.clips_on_disk()) else {
        return;
    };
    let (mut frames, mut seconds) = (0, 0.0);
    for name in &on_disk {
        let split = capture.manifest.splits.split_of(name);
        if split.is_none() {
            report.problem(format!("clip `{name}`: expected it in a split, found it in none"));
        }
        let Some(clip) = report.take(capture.load_clip(name)) else {
            continue;
        };
        frames += clip.clip.len();
        seconds += clip.clip.seconds();
        describe_clip(report, capture, &clip, split);
    }
    report.fact(
        "clips",
        format!("{}, {frames} frames, {seconds:.1} s", on_disk.len()),
    );
    for split in Split::ALL {
        let names = capture.clip_names(split);
        if !names.is_empty() {
            report.fact(split.name(), format!("{}: {}", names.len(), names.join(" ")));
        } else if split != Split::Validation {
            report.problem(format!(
                "[splits]: expected clips in {}, found none",
                split.name()
            ));
        }
    }
}

fn describe_mask(report: &mut Report, mask: &[f32]) {
    let count = |share: f32| mask.iter().filter(|m| **m == share).count();
    let (skinned, whole) = (count(0.0), count(1.0));
    let between = mask.len() - skinned - whole;
    let text = format!("{skinned} vertices follow skinning alone, {between} in part, {whole} the model");
    report.fact("mask", text);
}

fn describe_clip(report: &mut Report, capture: &Capture, clip: &CapturedClip, split: Option<Split>) {
    let distance = distance_to_skinning(capture, clip);
    let name = &clip.clip.name;
    let mut extras = String::new();
    if clip.body.is_some() {
        extras.push_str(", body");
    }
    if !clip.clip.wind.is_empty() {
        extras.push_str(", wind");
    }
    report.fact(
        format!("clip {name}"),
        format!(
            "{} frames, {:.2} s, {}, {}{extras}, RMS distance to skinning {:.0} mm",
            clip.clip.len(),
            clip.clip.seconds(),
            split.map_or("no split", Split::name),
            if clip.garment.is_mapped() {
                "mapped"
            } else {
                "packed"
            },
            1e3 * distance
        ),
    );
    if distance > FAR_FROM_SKINNING {
        report.problem(format!(
            "clip `{name}`: expected the garment near the posed body, found it {distance:.2} m (RMS) \
             from the skinned rest shape: another unit, axis, vertex order or first frame?"
        ));
    }
}

/// RMS distance between the garment and its skinned rest shape, metres.
fn distance_to_skinning(capture: &Capture, clip: &CapturedClip) -> f32 {
    let (skeleton, garment) = (&capture.character.skeleton, &capture.garment);
    let stride = clip.clip.len().div_ceil(FRAMES_COMPARED).max(1);
    let (mut joints, mut transforms, mut skinned) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sum, mut count) = (0.0_f64, 0_usize);
    for (t, pose) in clip.clip.poses.iter().enumerate().step_by(stride) {
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        garment
            .weights
            .skin(&garment.rest.vertices, &transforms, &mut skinned);
        let pairs = skinned.iter().zip(clip.garment.frame(t));
        sum += pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum::<f64>();
        count += skinned.len();
    }
    (sum / count.max(1) as f64).sqrt() as f32
}
