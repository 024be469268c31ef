//! Summaries of Alembic files.

use super::{
    mesh,
    report::{FileKind, Inspection},
};
use crate::{
    alembic::{AlembicAnimation, AlembicReader},
    check::bounds,
};
use glam::Vec3;
use serde_json::json;
use std::path::Path;

/// Number of meshes that are described. A file of a whole scene has thousands.
const DESCRIBED_MESHES: usize = 20;
/// Number of frames of a mesh that are read.
const SAMPLED_FRAMES: usize = 16;

pub(super) fn inspect(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Alembic);
    let Some(reader) = report.ok_or_problem(AlembicReader::open(path)) else {
        return report;
    };
    if let Some(application) = reader.application() {
        report.fact("written by", application);
    }
    report.fact(
        "unit and up axis",
        "not stated: metres and Y up, unless --scale and --up say otherwise",
    );
    report.fact("meshes", reader.len());
    let count = reader.len();
    for index in 0..count.min(DESCRIBED_MESHES) {
        // An animation owns its file, so that each mesh opens it again.
        let opened = AlembicReader::open(path).and_then(|reader| {
            let about = (reader.name(index), reader.kind(index));
            Ok((about, reader.animation(index)?))
        });
        if let Some(((name, kind), mut animation)) = report.ok_or_problem(opened) {
            describe(&mut report, &format!("{kind} {name}"), &mut animation);
        }
    }
    if count > DESCRIBED_MESHES {
        report.fact("more meshes", count - DESCRIBED_MESHES);
    }
    report
}

fn describe(report: &mut Inspection, what: &str, animation: &mut AlembicAnimation) {
    let (frames, vertices, fps) = (animation.len(), animation.vertex_count(), animation.fps());
    let rate = fps.map_or("no uniform frame rate".to_owned(), |fps| format!("{fps} fps"));
    report.measured(
        what,
        format!("{frames} frames of {vertices} vertices, {rate}"),
        json!({ "frames": frames, "vertices": vertices, "fps": fps }),
    );
    let mut positions = Vec::new();
    let mut corners: Vec<Vec3> = Vec::new();
    for frame in (0..frames).step_by(frames.div_ceil(SAMPLED_FRAMES).max(1)) {
        if (report.ok_or_problem(animation.frame(frame, &mut positions))).is_none() {
            return;
        }
        if let Some(vertex) = positions.iter().position(|v| !v.is_finite()) {
            let found = positions[vertex];
            report.problem(format!(
                "{what}: frame {frame}, vertex {vertex}: expected a finite position, found {found}"
            ));
            return;
        }
        corners.extend(bounds(&positions).into_iter().flat_map(|(low, high)| [low, high]));
    }
    if let Some((low, high)) = bounds(&corners) {
        mesh::extent(report, format!("{what} extent"), low, high);
    }
    if let Some(mesh) = report.ok_or_problem(animation.first_mesh()) {
        let (faces, uvs) = (mesh.faces.len(), mesh.uvs.is_some());
        report.measured(
            format!("{what} faces"),
            format!("{faces} triangles, {}", if uvs { "with UVs" } else { "no UVs" }),
            json!({ "triangles": faces, "uvs": uvs }),
        );
    }
}
