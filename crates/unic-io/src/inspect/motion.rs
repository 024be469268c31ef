//! Summaries of motion files.

use super::report::{FileKind, Inspection};
use crate::{
    bvh::Bvh,
    check,
    motion::{JointTarget, MotionArrays, POSE_NAMES, RootSpeed, max_root_speed},
    npz::Npz,
    retarget::{BoneMap, RetargetSource},
    up_axis::UpAxis,
};
use glam::Vec3;
use serde_json::json;
use std::path::Path;
use unic_core::clip::Clip;

/// Adds facts about the motion in an npz, for any number of joints.
pub(super) fn describe(report: &mut Inspection, npz: &mut Npz) {
    let name = npz.first_present(&POSE_NAMES).unwrap_or(POSE_NAMES[0]);
    let Some(header) = report.ok_or_problem(npz.header(name)) else {
        return;
    };
    let numbers = header
        .shape
        .iter()
        .skip(1)
        .try_fold(1_usize, |n, &e| n.checked_mul(e));
    let numbers = numbers.unwrap_or(0);
    report.fact("layout", layout_text(numbers));
    // 75 numbers are SMPL's 24 joints and a translation.
    let joints = if numbers == 75 { 24 } else { numbers / 3 };
    if let Some(arrays) = report.ok_or_problem(MotionArrays::read(npz, &JointTarget::Count(joints))) {
        let notes = arrays.notes.clone();
        notes.iter().for_each(|note| report.fact("note", note.as_str()));
        report.findings(arrays.findings.clone());
        describe_clip(report, &arrays.into_clip(String::new()));
    }
}

/// Summarises a BVH file: its skeleton, and the unit and up axis that an import would assume.
pub(super) fn bvh(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Motion);
    let Some(bvh) = report.ok_or_problem(Bvh::read(path)) else {
        return report;
    };
    report.fact("layout", "BVH");
    report.fact("joints", bvh.joints().len());
    report.fact("channels", bvh.channel_count());
    report.fact("frames", bvh.len());
    report.fact("frames per second", bvh.fps());
    seconds(&mut report, bvh.len().saturating_sub(1) as f32 / bvh.fps());
    let source = RetargetSource::new(path, &bvh, &BoneMap::default(), UpAxis::Auto);
    if let Some(source) = report.ok_or_problem(source) {
        source
            .notes
            .iter()
            .for_each(|note| report.fact("note", note.as_str()));
    }
    report
}

fn layout_text(numbers: usize) -> String {
    let family = match numbers {
        72 => "SMPL, 24 joints".into(),
        75 => "SMPL, 24 joints and the translation".into(),
        156 => "SMPL-H, 52 joints".into(),
        165 => "SMPL-X, 55 joints".into(),
        _ => format!("{} joints", numbers / 3),
    };
    format!("{numbers} numbers a frame: {family}")
}

fn describe_clip(report: &mut Inspection, clip: &Clip) {
    report.fact("frames", clip.len());
    report.fact("frames per second", clip.fps);
    seconds(report, clip.seconds());
    // The root's own up direction, because no character is known here.
    let ups = clip
        .poses
        .iter()
        .filter_map(|p| p.local.first())
        .map(|&q| q * Vec3::Y);
    let up = ups.sum::<Vec3>() / clip.len() as f32;
    let axis = if up.z > up.y { "Z" } else { "Y" };
    report.measured(
        "up axis",
        format!("{axis}, guessed from the root's mean up direction {up:.2}"),
        json!({ "axis": axis, "mean_up": up.to_array() }),
    );
    if let Some(RootSpeed { frame, speed }) = max_root_speed(clip) {
        report.measured(
            "fastest root",
            format!("{speed:.2} m/s at frame {frame}"),
            json!({ "m_per_s": speed, "frame": frame }),
        );
    }
    report.findings(check::motion(clip, None));
}

fn seconds(report: &mut Inspection, seconds: f32) {
    report.measured("seconds", format!("{seconds:.2}"), json!(seconds));
}
