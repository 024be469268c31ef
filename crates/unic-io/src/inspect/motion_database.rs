//! Summaries of motion databases.

use super::report::{FileKind, Inspection};
use crate::{error::Error, motion_database::read_motion_database};
use serde_json::json;
use std::path::Path;
use unic_core::{
    motion_matching::{Database, Feature, FeatureGroup, StoredClip, View},
    skeleton::Skeleton,
};

pub(super) fn inspect(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::MotionDatabase);
    let Some(database) = report.ok_or_problem(read_motion_database(path)) else {
        return report;
    };
    let fps = database.fps();
    let seconds = database.len() as f32 / fps;
    report.fact("frames", database.len());
    report.fact("frames per second", fps);
    report.measured("seconds", format!("{seconds:.2}"), json!(seconds));
    report.fact("joints", database.skeleton().len());
    report.fact("mirrored", database.settings().mirror.is_some());
    report.fact("clips", database.clips().len());
    for (index, clip) in database.clips().iter().enumerate() {
        describe_clip(&mut report, index, clip, fps);
    }
    for tag in database.tag_names() {
        describe_tag(&mut report, &database, tag);
    }
    for (index, group) in database.settings().groups.iter().enumerate() {
        let text = format!(
            "{}, weight {}",
            feature_text(&group.feature, database.skeleton()),
            group.weight
        );
        report.measured(format!("feature {index}"), text, feature_value(group));
    }
    if let Some(file) = report.ok_or_problem(path.metadata().map_err(Error::io(path, "read"))) {
        let megabytes = file.len() as f64 / 1e6;
        report.measured(
            "size",
            format!("{megabytes:.1} MB"),
            json!({ "bytes": file.len() }),
        );
    }
    report
}

// Numbered, because clips of two folders may have one name, and a mirrored clip has that of its
// original.
fn describe_clip(report: &mut Inspection, index: usize, clip: &StoredClip, fps: f32) {
    let seconds = clip.len as f32 / fps;
    let view = match clip.view {
        View::Direct => "as captured",
        View::Mirrored => "mirrored",
    };
    report.measured(
        format!("clip {index}"),
        format!("{}, {view}, {} frames, {seconds:.2} s", clip.name, clip.len),
        json!({ "name": clip.name, "view": clip.view, "frames": clip.len, "seconds": seconds }),
    );
}

fn describe_tag(report: &mut Inspection, database: &Database, tag: &str) {
    let bit = database.tag_bit(tag).unwrap_or(0);
    let frames = (0..database.len())
        .filter(|&frame| database.tags(frame) & bit != 0)
        .count();
    let text = format!("{frames} frames");
    report.measured(format!("tag {tag}"), text, json!({ "frames": frames }));
}

fn feature_text(feature: &Feature, skeleton: &Skeleton) -> String {
    let joint = |joint: &usize| match skeleton.names().get(*joint) {
        Some(name) => format!("joint {joint} ({name})"),
        None => format!("joint {joint}"),
    };
    let times = |seconds: &[f32]| {
        let seconds: Vec<String> = seconds.iter().map(|s| format!("{s:.2}")).collect();
        format!("{} s ahead", seconds.join(", "))
    };
    match feature {
        Feature::JointPosition(j) => format!("position of {}", joint(j)),
        Feature::JointVelocity(j) => format!("velocity of {}", joint(j)),
        Feature::TrajectoryPositions(seconds) => format!("positions of the root {}", times(seconds)),
        Feature::TrajectoryDirections(seconds) => format!("directions of the root {}", times(seconds)),
    }
}

fn feature_value(group: &FeatureGroup) -> serde_json::Value {
    json!({ "feature": group.feature, "weight": group.weight, "numbers": group.feature.len() })
}
