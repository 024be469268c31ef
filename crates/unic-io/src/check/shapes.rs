//! A mesh by itself.

use super::{Finding, lengths};
use crate::counted;
use glam::Vec3;
use std::collections::HashMap;
use unic_core::mesh::TriMesh;

/// Extents of garments and bodies, metres.
const SMALLEST: f32 = 0.05;
const LARGEST: f32 = 10.0;
/// Extent of a usual garment or body, metres.
const USUAL: f32 = 1.0;

/// Triangles around a vertex of a mesh that is made to be simulated; a polygon of many corners becomes a fan.
const MOST_FACES_AT_A_VERTEX: usize = 64;

/// Square metres: smaller triangles have no direction.
const SMALLEST_AREA: f32 = 1e-12;

/// Faults and units of a mesh; `what` it is.
pub fn mesh(what: &str, mesh: &TriMesh) -> Vec<Finding> {
    let found = [
        unit(what, mesh),
        flat_faces(what, mesh),
        unused_vertices(what, mesh),
        fans(what, mesh),
    ];
    found.into_iter().flatten().collect()
}

/// Lowest and highest corner of the box around the points.
pub(crate) fn bounds(vertices: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *vertices.first()?;
    let grow = |(low, high): (Vec3, Vec3), v: &Vec3| (low.min(*v), high.max(*v));
    Some(vertices.iter().fold((first, first), grow))
}

fn unit(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let (low, high) = bounds(&mesh.vertices)?;
    let extent = (high - low).max_element();
    if (SMALLEST..=LARGEST).contains(&extent) {
        return None;
    }
    let (unit, remedy) = lengths::words(extent / USUAL, "the mesh");
    Some(Finding::new(
        what,
        format!("an extent of {extent:.3} m"),
        unit,
        remedy,
    ))
}

fn flat_faces(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let area = |face: &&[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let count = mesh
        .faces
        .iter()
        .filter(|face| area(face) < SMALLEST_AREA)
        .count();
    (count > 0).then(|| {
        Finding::new(
            what,
            format!("{} without an area", counted(count, "triangle")),
            "vertices that lie on each other",
            "merge them, or remove the triangles",
        )
    })
}

fn unused_vertices(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let mut is_used = vec![false; mesh.vertices.len()];
    mesh.faces
        .as_flattened()
        .iter()
        .for_each(|&v| is_used[v as usize] = true);
    let count = is_used.iter().filter(|used| !**used).count();
    (count > 0).then(|| {
        Finding::new(
            what,
            match count {
                1 => "a vertex without a face".to_owned(),
                _ => format!("{count} vertices without a face"),
            },
            "loose points or lines",
            "remove them",
        )
    })
}

fn fans(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let mut counts: HashMap<u32, usize> = HashMap::new();
    mesh.faces
        .as_flattened()
        .iter()
        .for_each(|&v| *counts.entry(v).or_default() += 1);
    let most = counts
        .into_values()
        .max()
        .filter(|most| *most > MOST_FACES_AT_A_VERTEX)?;
    Some(Finding::new(
        what,
        format!("{most} triangles around one vertex"),
        "a polygon of many corners, such as a cap",
        "triangulate it evenly, or remove it",
    ))
}
