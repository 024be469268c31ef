//! Summaries of glTF files.

use super::{
    arrays,
    report::{FileKind, Inspection},
};
use crate::gltf::{contents, read_gltf_character, summarise_animation};
use serde_json::json;
use std::path::Path;

pub(super) fn inspect(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Character);
    let Some(contents) = report.ok_or_problem(contents(path)) else {
        return report;
    };
    report.fact("layout", "glTF");
    if let Some(generator) = &contents.generator {
        report.fact("written by", generator.as_str());
    }
    report.fact("unit and up axis", "metres, Y up, by the format");
    let skinned = &contents.skinned;
    report.measured("skinned meshes", counted(skinned), json!(skinned));
    report.fact("other meshes", contents.other_meshes);
    let animations = &contents.animations;
    report.measured("animations", counted(animations), json!(animations));
    match (skinned.is_empty(), animations.is_empty()) {
        (true, true) => report.problem("expected a skinned mesh or an animation, found neither"),
        (true, false) => report.kind = FileKind::Motion,
        (false, _) => character(&mut report, path),
    }
    if !animations.is_empty() {
        animation(&mut report, path);
    }
    report
}

fn character(report: &mut Inspection, path: &Path) {
    if let Some(read) = report.ok_or_problem(read_gltf_character(path)) {
        report.fact("mesh", read.name.as_str());
        read.notes
            .iter()
            .for_each(|note| report.fact("note", note.as_str()));
        report.fact("vertices in the file", read.vertex_of_file.len());
        arrays::describe_character(report, &read.character);
    }
}

fn animation(report: &mut Inspection, path: &Path) {
    if let Some(read) = report.ok_or_problem(summarise_animation(path)) {
        report.fact("frames", read.frames);
        report.fact("frames per second", read.fps);
        let seconds = (read.frames - 1) as f32 / read.fps;
        report.measured("seconds", format!("{seconds:.2}"), json!(seconds));
        read.notes
            .iter()
            .for_each(|note| report.fact("note", note.as_str()));
    }
}

/// Number of names, and the names.
fn counted(names: &[String]) -> String {
    match names {
        [] => "0".to_owned(),
        names => format!("{}: {}", names.len(), names.join(", ")),
    }
}
