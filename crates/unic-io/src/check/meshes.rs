//! Checks of a single mesh.

use crate::{
    counted,
    finding::{
        Finding,
        units::{Diagnosis, diagnose},
    },
};
use glam::Vec3;
use std::collections::HashMap;
use unic_core::mesh::TriMesh;

/// Plausible extents of garments and bodies, metres.
const EXTENTS: std::ops::RangeInclusive<f32> = 0.05..=10.0;
/// Extent of a usual garment or body, metres.
const USUAL_EXTENT: f32 = 1.0;

/// Largest number of triangles around a vertex of a mesh that is made for simulation. Readers turn
/// a polygon of many corners into a fan around one vertex.
const MAX_FACES_AT_VERTEX: usize = 64;

/// Smallest area of a triangle whose normal is not rounding error, square metres.
const MIN_AREA: f32 = 1e-12;

/// Checks the unit, triangles and vertices of a mesh; `what` is its name in messages.
pub fn mesh(what: &str, mesh: &TriMesh) -> Vec<Finding> {
    let found = [
        unit(what, mesh),
        degenerate_faces(what, mesh),
        unused_vertices(what, mesh),
        fans(what, mesh),
    ];
    found.into_iter().flatten().collect()
}

/// Returns the lowest and the highest corner of the bounding box; `None` without points.
pub(crate) fn bounds(vertices: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *vertices.first()?;
    let grow = |(low, high): (Vec3, Vec3), v: &Vec3| (low.min(*v), high.max(*v));
    Some(vertices.iter().fold((first, first), grow))
}

fn unit(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let (low, high) = bounds(&mesh.vertices)?;
    // The largest side of the bounding box: flat panels are thin in one direction.
    let extent = (high - low).max_element();
    if EXTENTS.contains(&extent) {
        return None;
    }
    let Diagnosis { probably, remedy } = diagnose(extent / USUAL_EXTENT, "the mesh");
    Some(Finding::new(
        what,
        format!("an extent of {extent:.3} m"),
        probably,
        remedy,
    ))
}

fn degenerate_faces(what: &str, mesh: &TriMesh) -> Option<Finding> {
    let area = |face: &&[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    // Exact and nearly exact duplicates of vertices both make such triangles.
    let count = mesh.faces.iter().filter(|face| area(face) < MIN_AREA).count();
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
        .filter(|most| *most > MAX_FACES_AT_VERTEX)?;
    Some(Finding::new(
        what,
        format!("{most} triangles around one vertex"),
        "a polygon of many corners, such as a cap",
        "triangulate it evenly, or remove it",
    ))
}
