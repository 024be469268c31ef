//! Virtual bones: points of the garment that move the vertices around them.

use glam::Vec3;
use unic_core::{mesh::TriMesh, skinning::SkinningWeights, weights::diffused_weights};
use unic_train::TrainError;

/// Distance over which weights fall off, as a share of the distance between bones.
const REACH: f32 = 0.5;

/// Returns functions of the vertices that span all displacements by affine transforms of the bones,
/// the same for each axis: w_b(i) and w_b(i) (r_i − c_b).
///
/// Weights are patches around bones that are spread as far as possible, diffused over the garment.
/// Pan et al. compute theirs by skinning decomposition of the training data (Le & Deng 2012).
/// Smooth patches span about the same, because the transforms are free.
pub(super) fn bone_functions(rest: &TriMesh, count: usize) -> Result<Vec<Vec<f64>>, TrainError> {
    let centres = spread_points(&rest.vertices, count);
    let nearest = |r: &Vec3| {
        let distances = centres.iter().map(|c| c.distance_squared(*r)).enumerate();
        let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        std::iter::once((nearest.map_or(0, |n| n.0), 1.0))
    };
    let patches = SkinningWeights::from_rows(centres.len(), rest.vertices.iter().map(nearest))?;
    let spacing = (area(rest) / centres.len().max(1) as f32).sqrt();
    let weights = diffused_weights(&patches, rest, REACH * spacing)?;
    let mut functions = vec![vec![0.0; rest.vertices.len()]; 4 * centres.len()];
    for (vertex, r) in rest.vertices.iter().enumerate() {
        for (bone, weight) in weights.row(vertex) {
            // Divided by the spacing, so that all functions have a similar size.
            let arm = (*r - centres[bone]) / spacing.max(f32::MIN_POSITIVE);
            for (k, value) in [1.0, arm.x, arm.y, arm.z].into_iter().enumerate() {
                functions[4 * bone + k][vertex] = f64::from(weight * value);
            }
        }
    }
    Ok(functions)
}

/// Returns up to `count` of the points. The first is the farthest from their mean, each other one
/// the farthest from all before it.
fn spread_points(points: &[Vec3], count: usize) -> Vec<Vec3> {
    let mean = points.iter().sum::<Vec3>() / points.len().max(1) as f32;
    let mut distances: Vec<f32> = points.iter().map(|p| p.distance_squared(mean)).collect();
    let mut chosen: Vec<Vec3> = Vec::new();
    while chosen.len() < count {
        let farthest = (0..points.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let Some(farthest) = farthest.filter(|&f| chosen.is_empty() || distances[f] > 0.0) else {
            break;
        };
        for (distance, p) in distances.iter_mut().zip(points) {
            let to_new = p.distance_squared(points[farthest]);
            *distance = if chosen.is_empty() {
                to_new
            } else {
                distance.min(to_new)
            };
        }
        chosen.push(points[farthest]);
    }
    chosen
}

/// Returns the area of a mesh, square metres.
fn area(mesh: &TriMesh) -> f32 {
    let face = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.faces.iter().map(face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_spread_and_no_point_is_chosen_twice() {
        let line: Vec<Vec3> = (0..=10).map(|i| Vec3::X * i as f32).collect();
        let chosen = spread_points(&line, 3);
        let mut places: Vec<f32> = chosen.iter().map(|p| p.x).collect();
        places.sort_by(f32::total_cmp);
        assert_eq!(places, [0.0, 5.0, 10.0]);
        assert_eq!(spread_points(&[Vec3::X; 4], 3).len(), 1);
        assert_eq!(spread_points(&line, 99).len(), line.len());
    }
}
