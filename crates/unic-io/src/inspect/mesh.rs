//! Summaries of meshes.

use super::report::{FileKind, Inspection};
use crate::{
    check::{self, bounds},
    obj,
};
use glam::Vec3;
use serde_json::json;
use std::{collections::HashMap, path::Path};
use unic_core::{
    mesh::TriMesh,
    topology::{components, edges, weld},
};

pub(super) fn inspect(path: &Path) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Mesh);
    if let Some(mesh) = report.ok_or_problem(obj::read_obj(path)) {
        describe(&mut report, "mesh", &mesh);
        report.findings(check::mesh("mesh", &mesh));
    }
    report
}

/// Adds counts and sizes of a mesh; `what` begins the name of each fact.
pub(super) fn describe(report: &mut Inspection, what: &str, mesh: &TriMesh) {
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    let uvs = if mesh.uvs.is_some() { "with UVs" } else { "no UVs" };
    report.measured(
        what,
        format!("{vertices} vertices, {faces} triangles, {uvs}"),
        json!({ "vertices": vertices, "triangles": faces, "uvs": mesh.uvs.is_some() }),
    );
    if let Some((low, high)) = bounds(&mesh.vertices) {
        extent(report, format!("{what} extent"), low, high);
    }
    let panels = components(vertices, &mesh.faces).count;
    let distinct = distinct_places(&mesh.vertices);
    report.measured(
        format!("{what} parts"),
        format!("{panels}, {distinct} distinct places"),
        json!({ "parts": panels, "distinct_places": distinct }),
    );
    if let Some(length) = median_edge(mesh) {
        report.measured(
            format!("{what} edges"),
            format!("{:.1} mm (median)", 1e3 * length),
            json!({ "median_m": length }),
        );
    }
    let open = open_edges(mesh);
    report.measured(
        format!("{what} rim"),
        format!("{open} open edges"),
        json!({ "open_edges": open }),
    );
}

/// Number of different positions: vertices at one place count once.
fn distinct_places(vertices: &[Vec3]) -> usize {
    // Meshes from texture tools repeat vertices at seams.
    let first = weld(vertices);
    first
        .iter()
        .enumerate()
        .filter(|(v, first)| **first as usize == *v)
        .count()
}

fn median_edge(mesh: &TriMesh) -> Option<f32> {
    let length = |[a, b]: [u32; 2]| mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    let mut lengths: Vec<f32> = edges(&mesh.faces).into_iter().map(length).collect();
    lengths.sort_by(f32::total_cmp);
    // The median ignores a few long edges of a coarse panel.
    lengths.get(lengths.len() / 2).copied()
}

/// Number of edges that belong to one face only.
fn open_edges(mesh: &TriMesh) -> usize {
    let mut faces_at: HashMap<(u32, u32), u32> = HashMap::new();
    // Ordered pairs, so that both directions of an edge are one key.
    for &[a, b, c] in &mesh.faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *faces_at.entry((from.min(to), from.max(to))).or_default() += 1;
        }
    }
    faces_at.values().filter(|count| **count == 1).count()
}

/// Adds the size and height of the box between two corners.
pub(super) fn extent(report: &mut Inspection, name: String, low: Vec3, high: Vec3) {
    let size = high - low;
    report.measured(
        name,
        format!(
            "{:.3} x {:.3} x {:.3} m, y from {:.3} to {:.3}",
            size.x, size.y, size.z, low.y, high.y
        ),
        json!({ "low_m": low.to_array(), "high_m": high.to_array() }),
    );
}
