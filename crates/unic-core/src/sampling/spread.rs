//! Vertices far from one another.

use super::NEIGHBOURS;
use crate::{
    mesh::TriMesh,
    topology::{components, weld},
};
use glam::Vec3;

/// Fewest samples of a connected part that has as many vertices: with less a linear function is not
/// determined.
const FEWEST: usize = NEIGHBOURS / 2;

/// `share` of the vertices of every connected part, farthest point first (Gonzalez 1985); parts take turns in
/// proportion, so that the beginning of a list is the list of a smaller share.
pub(super) fn spread(rest: &TriMesh, share: f32) -> Vec<u32> {
    let welded = weld(&rest.vertices);
    let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(|v| welded[v as usize])).collect();
    let (labels, count) = components(rest.vertices.len(), &faces);
    let mut parts = vec![Vec::new(); count];
    for v in 0..rest.vertices.len() as u32 {
        // Copies of a vertex belong together, and one of them stands for all.
        parts[labels[welded[v as usize] as usize] as usize].push(v);
    }
    let mut ranked: Vec<(f32, u32)> = Vec::new();
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let wanted = ((part.len() as f32 * share).round() as usize)
            .max(FEWEST)
            .min(part.len());
        let order = farthest_first(&rest.vertices, part, wanted);
        let size = part.len() as f32;
        // The first few of every part come before all others.
        let rank = |i: usize| if i < FEWEST { 0.0 } else { i as f32 / size };
        ranked.extend(order.into_iter().enumerate().map(|(i, v)| (rank(i), v)));
    }
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, v)| v).collect()
}

/// The first of `part`, then always the vertex farthest from all before.
fn farthest_first(vertices: &[Vec3], part: &[u32], count: usize) -> Vec<u32> {
    let places: Vec<Vec3> = part.iter().map(|&v| vertices[v as usize]).collect();
    let mut gaps = vec![f32::INFINITY; part.len()];
    let mut chosen = Vec::with_capacity(count);
    let mut next = 0;
    while chosen.len() < count {
        chosen.push(part[next]);
        let from = places[next];
        // Chosen ones, and copies of them at the same place, come last.
        gaps[next] = f32::NEG_INFINITY;
        let mut farthest = (f32::NEG_INFINITY, 0);
        for (i, (gap, place)) in gaps.iter_mut().zip(&places).enumerate() {
            *gap = gap.min(place.distance_squared(from));
            if *gap > farthest.0 {
                farthest = (*gap, i);
            }
        }
        next = farthest.1;
    }
    chosen
}
