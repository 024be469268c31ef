//! Farthest-point sampling of a mesh's vertices.

use super::NEIGHBOURS;
use crate::{
    mesh::TriMesh,
    topology::{components, weld},
};
use glam::Vec3;

/// Smallest number of samples of a connected component, unless it has fewer vertices. Four points
/// determine a linear function in space.
const MIN_SAMPLES: usize = NEIGHBOURS / 2;

/// Returns `share` of the vertices of every connected component in farthest-point order (Gonzalez
/// 1985).
///
/// The components alternate in proportion to their size, so that the samples of a smaller share are
/// a prefix.
pub(super) fn farthest_point_samples(rest: &TriMesh, share: f32) -> Vec<u32> {
    let welded = weld(&rest.vertices);
    let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(|v| welded[v as usize])).collect();
    let components = components(rest.vertices.len(), &faces);
    let mut vertices_of_components = vec![Vec::new(); components.count];
    for v in 0..rest.vertices.len() as u32 {
        // A copy of a seam vertex has no welded faces of its own, so it takes the component of the
        // first.
        let component = components.of_vertex[welded[v as usize] as usize];
        vertices_of_components[component as usize].push(v);
    }
    let mut ranked: Vec<(f32, u32)> = Vec::new();
    let not_empty = vertices_of_components.iter().filter(|part| !part.is_empty());
    for component in not_empty {
        let wanted = ((component.len() as f32 * share).round() as usize)
            .max(MIN_SAMPLES)
            .min(component.len());
        let order = farthest_first(&rest.vertices, component, wanted);
        let size = component.len() as f32;
        // The smallest numbers of samples of all components come before any others.
        let rank = |i: usize| if i < MIN_SAMPLES { 0.0 } else { i as f32 / size };
        ranked.extend(order.into_iter().enumerate().map(|(i, v)| (rank(i), v)));
    }
    // A stable sort: samples of equal rank stay in the order of the components.
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, v)| v).collect()
}

/// Returns `count` vertices of a component: the first, then always the one farthest from all
/// before.
// Each sample costs one pass over the component; this runs once, when a model is made or loaded.
fn farthest_first(vertices: &[Vec3], component: &[u32], count: usize) -> Vec<u32> {
    let positions: Vec<Vec3> = component.iter().map(|&v| vertices[v as usize]).collect();
    // Squared distance of each vertex to the nearest chosen one.
    let mut squared_distances = vec![f32::INFINITY; component.len()];
    let mut chosen = Vec::with_capacity(count);
    let mut next = 0;
    while chosen.len() < count {
        chosen.push(component[next]);
        let from = positions[next];
        // Below zero, the distance of unchosen copies at the same place, so that these come first.
        squared_distances[next] = f32::NEG_INFINITY;
        let mut farthest = (f32::NEG_INFINITY, 0);
        for (i, (squared, position)) in squared_distances.iter_mut().zip(&positions).enumerate() {
            *squared = squared.min(position.distance_squared(from));
            if *squared > farthest.0 {
                farthest = (*squared, i);
            }
        }
        next = farthest.1;
    }
    chosen
}
