//! Summaries of numpy files and vertex animations.

use super::{
    mesh, motion,
    report::{FileKind, Inspection},
};
use crate::{
    cache::read_vertex_cache,
    character::{import_character, read_character},
    check,
    frames::{FrameVertex, VertexFrames},
    npy::{self, Header},
    npz::Npz,
    pc2,
    rigged::CharacterOptions,
    smpl_model,
};
use glam::Vec3;
use serde_json::json;
use std::path::Path;
use unic_core::character::Character;

pub(super) fn npz(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Npz);
    let Some(mut npz) = report.ok_or_problem(Npz::open(path)) else {
        return report;
    };
    let kind = kind_of(&npz);
    report.kind = kind;
    for name in npz.names().to_vec() {
        if let Some(header) = report.ok_or_problem(npz.header(&name)) {
            array(&mut report, &name, &header);
        }
    }
    match kind {
        FileKind::Character => {
            if let Some(character) = report.ok_or_problem(read_character(path)) {
                describe_character(&mut report, &character);
            }
        }
        FileKind::Motion => motion::describe(&mut report, &mut npz),
        FileKind::VertexAnimation => vertex_cache(&mut report),
        _ => {}
    }
    report
}

/// Summarises a pickle, which is read as a body model of SMPL.
pub(super) fn body_model(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Unknown);
    if let Some(import) = report.ok_or_problem(import_character(path, &CharacterOptions::default())) {
        report.kind = FileKind::Character;
        import
            .notes
            .iter()
            .for_each(|note| report.fact("note", note.as_str()));
        describe_character(&mut report, &import.character);
    }
    report
}

/// Classifies an npz by the names of its arrays.
fn kind_of(npz: &Npz) -> FileKind {
    let has = |names: &[&str]| names.iter().all(|n| npz.contains(n));
    // The most specific kind first: a character also has vertices.
    if has(&["vertices", "joints", "weights"]) || smpl_model::is_model(npz) {
        FileKind::Character
    } else if has(&["poses"]) || has(&["pose"]) {
        FileKind::Motion
    } else if has(&["vertices", "fps"]) {
        FileKind::VertexAnimation
    } else if has(&["weights"]) || has(&["pinned"]) || has(&["mask"]) {
        FileKind::Garment
    } else {
        FileKind::Npz
    }
}

fn array(report: &mut Inspection, name: &str, header: &Header) {
    let order = if header.fortran_order {
        ", Fortran order"
    } else {
        ""
    };
    let shape = npy::shape_text(&header.shape);
    report.measured(
        format!("array {name}"),
        format!("{} {shape}{order}", header.dtype),
        json!({ "type": header.dtype.to_string(), "shape": header.shape }),
    );
    // Such arrays make a file that numpy opens only with `allow_pickle`.
    if matches!(header.dtype.kind, npy::DtypeKind::Object | npy::DtypeKind::Other) {
        let dtype = header.dtype;
        report.problem(format!("array `{name}`: expected numbers or text, found {dtype}"));
    }
}

pub(super) fn describe_character(report: &mut Inspection, character: &Character) {
    let Character {
        body,
        skeleton,
        weights,
        ..
    } = character;
    mesh::describe(report, "body", body);
    let names = skeleton.names().join(" ");
    report.measured(
        "joints",
        format!("{} ({names})", skeleton.len()),
        json!({ "count": skeleton.len(), "names": skeleton.names() }),
    );
    let posed = skeleton.rest_pose().iter().any(|r| r.length() > 1e-4);
    report.fact("bind pose", if posed { "posed (rest_pose)" } else { "zero" });
    let most = (0..weights.len())
        .map(|v| weights.row(v).len())
        .max()
        .unwrap_or(0);
    report.measured(
        "joints a vertex",
        format!("at most {most}"),
        json!({ "most": most }),
    );
    report.findings(check::character(character));
}

pub(super) fn npy(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Npy);
    if let Some(header) = report.ok_or_problem(npy::read_npy_header(path)) {
        array(&mut report, "data", &header);
        // Other shapes are arrays of no known meaning.
        if header.shape.len() == 3 && header.shape[2] == 3 {
            vertex_cache(&mut report);
        }
    }
    report
}

pub(super) fn mesh_sequence(folder: &Path) -> Inspection {
    let mut report = Inspection::new(folder, FileKind::MeshSequence);
    vertex_cache(&mut report);
    report
}

pub(super) fn point_cache(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::PointCache);
    if let Some(cache) = report.ok_or_problem(pc2::read_pc2(path)) {
        report.fact("layout", "PC2");
        report.fact("start frame", cache.start_frame);
        report.fact("frames a sample", cache.frames_per_sample);
        describe_frames(&mut report, &cache.frames);
    }
    report
}

pub(super) fn mdd(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::PointCache);
    report.fact("layout", "MDD");
    vertex_cache(&mut report);
    report
}

fn vertex_cache(report: &mut Inspection) {
    let path = report.path.clone();
    let Some(cache) = report.ok_or_problem(read_vertex_cache(&path)) else {
        return;
    };
    describe_frames(report, &cache.frames);
    if let Some(fps) = cache.fps {
        report.fact("frames per second", fps);
        match fps.is_finite() && fps > 0.0 {
            true => report.fact("seconds", cache.frames.len().saturating_sub(1) as f32 / fps),
            false => report.problem(format!("fps: expected a frame rate above 0, found {fps}")),
        }
    }
    if let Some(mesh) = &cache.mesh {
        mesh::describe(report, "mesh", mesh);
        report.findings(check::mesh("mesh", mesh));
    }
}

fn describe_frames(report: &mut Inspection, frames: &VertexFrames) {
    report.fact("frames", frames.len());
    report.fact("vertices", frames.vertex_count());
    if let Some(FrameVertex { frame, vertex }) = frames.first_non_finite() {
        let found = frames.frame(frame)[vertex];
        let place = format!("frame {frame}, vertex {vertex}");
        report.problem(format!("{place}: expected a finite position, found {found}"));
        return;
    }
    // Bounds over all frames only after the check: minima and maxima skip NaN silently.
    let all = frames.iter().flatten().copied();
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = all.fold(start, |(low, high), v| (low.min(v), high.max(v)));
    if !frames.is_empty() {
        mesh::extent(report, "extent".to_owned(), low, high);
    }
}
