//! Motion files.

use super::{Kind, Report};
use crate::{
    bvh::Bvh,
    check,
    motion::{Joints, MotionArrays, POSE_NAMES, UpAxis},
    npz::Npz,
    retarget::{BoneMap, Source},
};
use glam::Vec3;
use serde_json::json;
use std::path::Path;
use unic_core::clip::Clip;

pub(super) fn describe(report: &mut Report, npz: &mut Npz) {
    let name = npz.first_of(&POSE_NAMES).unwrap_or(POSE_NAMES[0]);
    let Some(header) = report.take(npz.header(name)) else {
        return;
    };
    let numbers = header
        .shape
        .iter()
        .skip(1)
        .try_fold(1_usize, |n, &e| n.checked_mul(e));
    let numbers = numbers.unwrap_or(0);
    report.fact("layout", layout_text(numbers));
    // 75 numbers are 24 joints and a translation.
    let joints = if numbers == 75 { 24 } else { numbers / 3 };
    if let Some(arrays) = report.take(MotionArrays::read(npz, &Joints::Count(joints))) {
        let notes = arrays.notes.clone();
        notes.iter().for_each(|note| report.fact("note", note.as_str()));
        report.findings(arrays.findings.clone());
        describe_clip(report, &arrays.into_clip(String::new()));
    }
}

/// A BVH file: its skeleton, and what an import would take it for.
pub(super) fn bvh(path: &Path) -> Report {
    let mut report = Report::new(path, Kind::Motion);
    let Some(bvh) = report.take(Bvh::read(path)) else {
        return report;
    };
    report.fact("layout", "BVH");
    report.fact("joints", bvh.joints().len());
    report.fact("channels", bvh.channel_count());
    report.fact("frames", bvh.len());
    report.fact("frames per second", bvh.fps());
    seconds(&mut report, bvh.len().saturating_sub(1) as f32 / bvh.fps());
    let source = Source::new(path, &bvh, &BoneMap::default(), UpAxis::Auto);
    if let Some(source) = report.take(source) {
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

fn describe_clip(report: &mut Report, clip: &Clip) {
    report.fact("frames", clip.len());
    report.fact("frames per second", clip.fps);
    seconds(report, clip.seconds());
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
    let steps = clip
        .poses
        .windows(2)
        .map(|p| p[0].trans.distance(p[1].trans) * clip.fps);
    let fastest = steps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((t, speed)) = fastest {
        report.measured(
            "fastest root",
            format!("{speed:.2} m/s at frame {t}"),
            json!({ "m_per_s": speed, "frame": t }),
        );
    }
    report.findings(check::motion(clip, None));
}

fn seconds(report: &mut Report, seconds: f32) {
    report.measured("seconds", format!("{seconds:.2}"), json!(seconds));
}
