//! Summaries of glTF, FBX and USD files.

use super::{
    arrays, mesh,
    report::{FileKind, Inspection},
};
use crate::{
    check::bounds,
    rigged::{
        CharacterOptions, OtherMesh, RiggedFormat, contents, read_rigged_character, read_scene_points,
        summarise_animation,
    },
};
use serde_json::json;
use std::path::Path;
use unic_scene::Assumed;

/// Number of meshes of a kind that are read. Each reads the file again.
const DESCRIBED_MESHES: usize = 4;

pub(super) fn inspect(path: &Path, format: RiggedFormat) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Character);
    let Some(contents) = report.ok_or_problem(contents(path, format)) else {
        return report;
    };
    report.fact("layout", format.name());
    if let Some(generator) = &contents.generator {
        report.fact("written by", generator.as_str());
    }
    report.fact("unit and up axis", contents.units.as_str());
    let skinned = &contents.skinned;
    report.measured("skinned meshes", counted(skinned), json!(skinned));
    report.fact("other meshes", contents.others.len());
    let animations = &contents.animations;
    report.measured("animations", counted(animations), json!(animations));
    notes(&mut report, &contents.notes);
    let animated: Vec<&OtherMesh> = contents.others.iter().filter(|mesh| mesh.samples > 1).collect();
    match (skinned.is_empty(), animations.is_empty(), animated.is_empty()) {
        (true, true, true) if contents.others.is_empty() => {
            report.problem("expected a mesh, a skeleton or an animation, found none");
        }
        (true, true, true) => {
            report.problem("expected a skinned mesh or an animation, found neither");
        }
        (true, false, true) => report.kind = FileKind::Motion,
        (true, _, false) => report.kind = FileKind::VertexAnimation,
        (false, _, _) => {
            for body in skinned.iter().take(DESCRIBED_MESHES) {
                character(&mut report, path, format, body);
            }
        }
    }
    if !animations.is_empty() {
        animation(&mut report, path, format);
    }
    for mesh in animated.iter().take(DESCRIBED_MESHES) {
        points(&mut report, path, format, mesh);
    }
    if animated.len() > DESCRIBED_MESHES {
        report.fact("more animated meshes", animated.len() - DESCRIBED_MESHES);
    }
    report
}

/// Describes a skinned mesh, which is a character.
fn character(report: &mut Inspection, path: &Path, format: RiggedFormat, body: &str) {
    let options = CharacterOptions {
        body: Some(body),
        ..CharacterOptions::default()
    };
    let read = read_rigged_character(path, format, &options);
    if let Some(read) = report.ok_or_problem(read) {
        report.fact("mesh", read.name.as_str());
        notes(report, &read.notes);
        let (body, mesh) = (&read.character.body, &read.character.file_mesh);
        let in_file = mesh
            .as_ref()
            .map_or(body.vertices.len(), |mesh| mesh.body_vertices.len());
        report.fact("vertices in the file", in_file);
        arrays::describe_character(report, &read.character);
    }
}

fn animation(report: &mut Inspection, path: &Path, format: RiggedFormat) {
    if let Some(read) = report.ok_or_problem(summarise_animation(path, format)) {
        report.fact("frames", read.frames);
        report.fact("frames per second", read.fps);
        let seconds = (read.frames - 1) as f32 / read.fps;
        report.measured("seconds", format!("{seconds:.2}"), json!(seconds));
        notes(report, &read.notes);
    }
}

/// Describes a mesh whose points change.
fn points(report: &mut Inspection, path: &Path, format: RiggedFormat, other: &OtherMesh) {
    let name = &other.name;
    let read = read_scene_points(path, format, Some(name), 0, &Assumed::default());
    let Some(read) = report.ok_or_problem(read) else {
        return;
    };
    let rate = read
        .fps
        .map_or("no uniform frame rate".to_owned(), |fps| format!("{fps} fps"));
    report.measured(
        format!("animated mesh {name}"),
        format!(
            "{} frames of {} vertices, {rate}",
            read.frames.len(),
            other.vertices
        ),
        json!({ "frames": read.frames.len(), "vertices": other.vertices, "fps": read.fps }),
    );
    let corners = read
        .frames
        .iter()
        .filter_map(bounds)
        .flat_map(|(low, high)| [low, high]);
    if let Some((low, high)) = bounds(&corners.collect::<Vec<_>>()) {
        mesh::extent(report, format!("{name} extent"), low, high);
    }
}

/// Adds notes that are not there yet: each reading of a file repeats those of the file.
fn notes(report: &mut Inspection, notes: &[String]) {
    for note in notes {
        if !report.facts.iter().any(|fact| fact.text == *note) {
            report.fact("note", note.as_str());
        }
    }
}

/// Number of names, and the names.
fn counted(names: &[String]) -> String {
    match names {
        [] => "0".to_owned(),
        names => format!("{}: {}", names.len(), names.join(", ")),
    }
}
