//! Summaries of captures.

use super::{
    arrays, mesh,
    report::{FileKind, Inspection},
};
use crate::{
    capture::{Capture, CapturedClip, Split, WeightsSource},
    check, counted,
};
use serde_json::json;
use std::path::Path;
use unic_core::surface::Surface;

pub(super) fn inspect(root: &Path) -> Inspection {
    let mut report = Inspection::new(root, FileKind::Capture);
    let Some(capture) = report.ok_or_problem(Capture::open(root)) else {
        return report;
    };
    let manifest = &capture.manifest;
    report.fact("name", manifest.name.as_str());
    report.fact("frames per second", manifest.fps);
    report.fact("provenance", manifest.provenance.trim());
    // The key is optional for reading, but a capture without it cannot be published.
    if manifest.provenance.trim().is_empty() {
        report.problem("capture.toml: expected provenance (source and licence), found none");
    }
    arrays::describe_character(&mut report, &capture.character);
    contacts(&mut report, &capture);
    garment(&mut report, &capture);
    clips(&mut report, &capture);
    report
}

fn contacts(report: &mut Inspection, capture: &Capture) {
    let names = capture.character.skeleton.names();
    let contacts: Vec<&str> = (capture.contact_joints.iter())
        .filter_map(|&j| names.get(j).map(String::as_str))
        .collect();
    report.measured("contact joints", contacts.join(" "), json!(contacts));
}

fn garment(report: &mut Inspection, capture: &Capture) {
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
    // The rest shape is in the bind pose, so that no skinning is needed.
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
    let value = json!({ "percent": 100.0 * share, "deepest_mm": 1e3 * deepest });
    report.measured("garment inside the body at rest", text, value);
    report.findings(check::garment(rest, &capture.character));
}

fn clips(report: &mut Inspection, capture: &Capture) {
    let Some(on_disk) = report.ok_or_problem(capture.clips_on_disk()) else {
        return;
    };
    let (mut frames, mut seconds) = (0, 0.0);
    for name in &on_disk {
        let split = capture.manifest.splits.split_of(name);
        if split.is_none() {
            report.problem(format!("clip `{name}`: expected it in a split, found it in none"));
        }
        // A damaged clip is a problem of its own; the other clips are still reported.
        let Some(clip) = report.ok_or_problem(capture.load_clip(name)) else {
            continue;
        };
        frames += clip.clip.len();
        seconds += clip.clip.seconds();
        describe_clip(report, capture, &clip, split);
    }
    report.measured(
        "clips",
        format!(
            "{}, {}, {seconds:.1} s",
            counted(on_disk.len(), "clip"),
            counted(frames, "frame")
        ),
        json!({ "count": on_disk.len(), "frames": frames, "seconds": seconds }),
    );
    for split in Split::ALL {
        let names = capture.clip_names(split);
        if !names.is_empty() {
            let text = format!("{}: {}", names.len(), names.join(" "));
            report.measured(split.name(), text, json!(names));
        // Validation clips are optional.
        } else if split != Split::Validation {
            report.problem(format!(
                "[splits]: expected clips in {}, found none",
                split.name()
            ));
        }
    }
}

fn describe_mask(report: &mut Inspection, mask: &[f32]) {
    let count = |share: f32| mask.iter().filter(|m| **m == share).count();
    let (skinned, whole) = (count(0.0), count(1.0));
    let between = mask.len() - skinned - whole;
    let text = format!("{skinned} vertices follow skinning alone, {between} in part, {whole} the model");
    let value = json!({ "skinned": skinned, "in_part": between, "whole": whole });
    report.measured("mask", text, value);
}

fn describe_clip(report: &mut Inspection, capture: &Capture, clip: &CapturedClip, split: Option<Split>) {
    let distance = check::distance_to_skinning(capture, clip);
    let (frames, seconds) = (clip.clip.len(), clip.clip.seconds());
    let mut extras = String::new();
    if clip.body.is_some() {
        extras.push_str(", body");
    }
    if !clip.clip.wind.is_empty() {
        extras.push_str(", wind");
    }
    let split = split.map_or("no split", Split::name);
    let stored = if clip.garment.is_mapped() {
        "mapped"
    } else {
        "packed"
    };
    report.measured(
        format!("clip {}", clip.clip.name),
        format!(
            "{frames} frames, {seconds:.2} s, {split}, {stored}{extras}, RMS distance to skinning {:.0} mm",
            1e3 * distance
        ),
        json!({
            "frames": frames,
            "seconds": seconds,
            "split": split,
            "stored": stored,
            "body": clip.body.is_some(),
            "wind": !clip.clip.wind.is_empty(),
            "distance_to_skinning_mm": 1e3 * distance,
        }),
    );
    report.findings(check::clip(capture, clip));
}
