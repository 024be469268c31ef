//! Meshes.

use super::{Kind, Report};
use crate::obj;
use glam::Vec3;
use std::{collections::HashMap, path::Path};
use unic_core::{
    mesh::TriMesh,
    topology::{components, edges, weld},
};

pub(super) fn inspect(path: &Path) -> Report {
    let mut report = Report::new(path, Kind::Mesh);
    if let Some(mesh) = report.take(obj::read_obj(path)) {
        describe(&mut report, "mesh", &mesh);
    }
    report
}

/// Counts, size and faults of a mesh, each named after `what` it is.
pub(super) fn describe(report: &mut Report, what: &str, mesh: &TriMesh) {
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    let uvs = if mesh.uvs.is_some() { "with UVs" } else { "no UVs" };
    report.fact(what, format!("{vertices} vertices, {faces} triangles, {uvs}"));
    if let Some((low, high)) = bounds(&mesh.vertices) {
        report.fact(format!("{what} extent"), extent_text(low, high));
        if (high - low).max_element() > 10.0 {
            report.problem(format!(
                "{what}: expected metres, found an extent of {:.1}: centimetres?",
                (high - low).max_element()
            ));
        }
    }
    let (_, panels) = components(vertices, &mesh.faces);
    let distinct = distinct_places(&mesh.vertices);
    report.fact(
        format!("{what} parts"),
        format!("{panels}, {distinct} distinct places"),
    );
    if let Some(length) = median_edge(mesh) {
        report.fact(
            format!("{what} edges"),
            format!("{:.1} mm (median)", 1e3 * length),
        );
    }
    let open = open_edges(mesh);
    report.fact(format!("{what} rim"), format!("{open} open edges"));
    faults(report, what, mesh);
}

fn faults(report: &mut Report, what: &str, mesh: &TriMesh) {
    let degenerate = mesh.faces.iter().filter(|f| area(mesh, f) < 1e-12).count();
    if degenerate > 0 {
        report.problem(format!(
            "{what}: expected triangles with an area, found {degenerate} without"
        ));
    }
    let mut used = vec![false; mesh.vertices.len()];
    mesh.faces.iter().flatten().for_each(|&v| used[v as usize] = true);
    let unused = used.iter().filter(|u| !**u).count();
    if unused > 0 {
        report.problem(format!(
            "{what}: expected a face at every vertex, found {unused} vertices without"
        ));
    }
}

/// Square metres.
fn area(mesh: &TriMesh, face: &[u32; 3]) -> f32 {
    let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
    0.5 * (b - a).cross(c - a).length()
}

fn distinct_places(vertices: &[Vec3]) -> usize {
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
    lengths.get(lengths.len() / 2).copied()
}

/// Edges of one face alone.
fn open_edges(mesh: &TriMesh) -> usize {
    let mut faces_at: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &mesh.faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *faces_at.entry((from.min(to), from.max(to))).or_default() += 1;
        }
    }
    faces_at.values().filter(|count| **count == 1).count()
}

/// Lowest and highest corner of the box around the points.
pub(super) fn bounds(vertices: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *vertices.first()?;
    let grow = |(low, high): (Vec3, Vec3), v: &Vec3| (low.min(*v), high.max(*v));
    Some(vertices.iter().fold((first, first), grow))
}

pub(super) fn extent_text(low: Vec3, high: Vec3) -> String {
    let size = high - low;
    format!(
        "{:.3} x {:.3} x {:.3} m, y from {:.3} to {:.3}",
        size.x, size.y, size.z, low.y, high.y
    )
}
