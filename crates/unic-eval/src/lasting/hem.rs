//! The hem of a garment, where it swings most.

use glam::Vec3;
use unic_core::{
    mesh::TriMesh,
    topology::{components, weld},
};

/// Number of vertices for each vertex of the hem, where the mesh has no boundary.
const LOWEST_SHARE: usize = 20;

/// Returns the vertices of the hem in ascending order.
///
/// The hem is the boundary with the lowest mean height in the rest shape. Of a closed mesh it is
/// the lowest twentieth of the vertices.
pub(super) fn hem(rest: &TriMesh) -> Vec<usize> {
    let height = |&vertex: &usize| rest.vertices[vertex].y;
    let mean = |hem: &[usize]| hem.iter().map(height).sum::<f32>() / hem.len() as f32;
    let boundaries = boundaries(rest).into_iter();
    boundaries
        .min_by(|a, b| mean(a).total_cmp(&mean(b)))
        .unwrap_or_else(|| lowest(&rest.vertices))
}

/// Returns the lowest twentieth of the vertices in ascending order.
fn lowest(vertices: &[Vec3]) -> Vec<usize> {
    let mut all: Vec<usize> = (0..vertices.len()).collect();
    all.sort_by(|&a, &b| vertices[a].y.total_cmp(&vertices[b].y));
    all.truncate(vertices.len().div_ceil(LOWEST_SHARE));
    all.sort_unstable();
    all
}

/// Returns the connected boundaries of a mesh. Seams between panels, where vertices are doubled,
/// are no boundaries.
fn boundaries(rest: &TriMesh) -> Vec<Vec<usize>> {
    // Seams double their vertices. Welded, their two sides are one edge with two faces.
    let first = weld(&rest.vertices);
    let corners = |face: &[u32; 3]| face.map(|vertex| first[vertex as usize]);
    let mut sides: Vec<[u32; 2]> = (rest.faces.iter().map(corners))
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    sides.sort_unstable();
    // A side of one face alone lies on a boundary.
    let open = sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    // `components` takes faces: an edge is a face with one corner twice.
    let edges: Vec<[u32; 3]> = open.map(|side| [side[0][0], side[0][1], side[0][1]]).collect();
    let components = components(rest.vertices.len(), &edges);
    let mut boundaries = vec![Vec::new(); components.count];
    let mut vertices: Vec<u32> = edges.iter().flat_map(|&[a, b, _]| [a, b]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    for vertex in vertices {
        boundaries[components.of_vertex[vertex as usize] as usize].push(vertex as usize);
    }
    boundaries.retain(|boundary| !boundary.is_empty());
    boundaries
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_testdata::Figure;

    #[test]
    fn the_hem_of_a_tube_is_its_lowest_ring() {
        let rest = Figure::tube().garment.rest;
        let lowest = rest.vertices.iter().map(|v| v.y).fold(f32::INFINITY, f32::min);
        let expected: Vec<usize> = (0..rest.vertices.len())
            .filter(|&v| rest.vertices[v].y == lowest)
            .collect();
        assert_eq!(hem(&rest), expected);
    }

    #[test]
    fn the_hem_of_a_closed_mesh_is_its_lowest_twentieth() {
        let body = crate::synthetic::cube().body;
        assert_eq!(hem(&body).len(), 1);
        assert_eq!(body.vertices[hem(&body)[0]].y, -1.0);
    }
}
