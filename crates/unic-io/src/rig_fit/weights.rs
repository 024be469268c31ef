//! Skinning weights of given bones: the point of a simplex that is nearest to the data.

use glam::Vec3;
use unic_core::transform::Rigid;

/// Number of joints that are tried for a vertex: those that follow it best alone.
const CANDIDATES: usize = 16;
/// Weight of the squared distance between vertex and bone beside the squared error of the positions.
/// It decides between joints that move alike, as fingers do that are held still. 1e-5 costs exact data
/// 0.05 mm at most.
const NEARNESS: f64 = 1e-5;
/// Smallest gain of another joint, relative to the error.
const TOLERANCE: f64 = 1e-9;

/// Weights of one vertex whose position in frame t is `positions[t]`. `predicted(joint, t)` is where a
/// joint alone would have it. `distances` has the distance of each joint's bones from the vertex.
pub(super) fn fit_vertex(
    positions: &[Vec3],
    predicted: impl Fn(usize, usize) -> Vec3,
    distances: &[f32],
) -> Vec<(usize, f32)> {
    let errors = |joint: usize| -> Vec<Vec3> {
        let frames = positions.iter().enumerate();
        frames.map(|(t, x)| *x - predicted(joint, t)).collect()
    };
    let nearness = |joint: usize| NEARNESS * f64::from(distances[joint] * distances[joint]);
    let mut joints: Vec<(f64, usize, Vec<Vec3>)> = (0..distances.len())
        .map(|joint| {
            let errors = errors(joint);
            (mean_product(&errors, &errors) + nearness(joint), joint, errors)
        })
        .collect();
    joints.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    joints.truncate(CANDIDATES);
    let count = joints.len();
    let mut gram = vec![0.0; count * count];
    for i in 0..count {
        for k in 0..=i {
            let product = match i == k {
                true => joints[i].0,
                false => mean_product(&joints[i].2, &joints[k].2),
            };
            (gram[i * count + k], gram[k * count + i]) = (product, product);
        }
    }
    let weights = nearest_on_simplex(&gram, count);
    let rows = joints.iter().zip(weights);
    rows.map(|((_, joint, _), weight)| (*joint, weight as f32))
        .collect()
}

/// Mean over frames of the inner products.
fn mean_product(a: &[Vec3], b: &[Vec3]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum();
    sum / a.len().max(1) as f64
}

/// Minimises wᵀ G w over w ≥ 0 with Σ w = 1: the point of least norm of a polytope whose corners have the
/// Gram matrix G, by Wolfe 1976, "Finding the nearest point in a polytope".
fn nearest_on_simplex(gram: &[f64], count: usize) -> Vec<f64> {
    let of = |i: usize, k: usize| gram[i * count + k];
    let start = (0..count).min_by(|a, b| of(*a, *a).total_cmp(&of(*b, *b)));
    let mut weights = vec![0.0; count];
    let Some(start) = start else { return weights };
    weights[start] = 1.0;
    let mut corners = vec![start];
    // Every pass lowers the norm, so that no set of corners returns; the bound is for rounding.
    for _ in 0..4 * count {
        let slope = |i: usize| (corners.iter()).map(|k| of(i, *k) * weights[*k]).sum::<f64>();
        let norm: f64 = corners.iter().map(|i| slope(*i) * weights[*i]).sum();
        let outside = (0..count).filter(|i| !corners.contains(i));
        let best = outside.map(|i| (slope(i), i)).min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((least, corner)) if least < norm - TOLERANCE * of(start, start) => corners.push(corner),
            _ => break,
        }
        descend(gram, count, &mut corners, &mut weights);
    }
    weights
}

/// Moves to the point of least norm in the affine hull of the corners, dropping those that it would leave
/// behind.
fn descend(gram: &[f64], count: usize, corners: &mut Vec<usize>, weights: &mut [f64]) {
    while corners.len() > 1 {
        let target = affine_minimum(gram, count, corners);
        let step = |(i, t): (&usize, &f64)| match *t < 0.0 {
            true => weights[*i] / (weights[*i] - t),
            false => 1.0,
        };
        let step = corners.iter().zip(&target).map(step).fold(1.0, f64::min);
        for (i, t) in corners.iter().zip(&target) {
            weights[*i] += step * (t - weights[*i]);
        }
        if step >= 1.0 {
            return;
        }
        // At least the corner that has limited the step is at zero, up to rounding.
        let least = corners.iter().map(|i| weights[*i]).fold(f64::INFINITY, f64::min);
        let is_left = |i: &usize| weights[*i] <= least.max(1e-12);
        let left: Vec<usize> = corners.iter().copied().filter(is_left).collect();
        corners.retain(|i| !left.contains(i));
        left.iter().for_each(|i| weights[*i] = 0.0);
        let sum: f64 = corners.iter().map(|i| weights[*i]).sum();
        corners.iter().for_each(|i| weights[*i] /= sum);
    }
}

/// Coefficients of the point of least norm in the affine hull of some corners.
fn affine_minimum(gram: &[f64], count: usize, corners: &[usize]) -> Vec<f64> {
    let size = corners.len();
    let mut matrix: Vec<f64> = Vec::with_capacity(size * size);
    for i in corners {
        matrix.extend(corners.iter().map(|k| gram[i * count + k]));
    }
    let mut solution = vec![1.0; size];
    super::linear::solve(&mut matrix, &mut solution);
    let sum: f64 = solution.iter().sum();
    solution.iter().map(|y| y / sum).collect()
}

/// Distance of a point from the segments of a bone.
pub(super) fn distance(point: Vec3, bones: &[[Vec3; 2]]) -> f32 {
    let from = |[a, b]: &[Vec3; 2]| {
        let along = *b - *a;
        let share = ((point - *a).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        point.distance(*a + share * along)
    };
    bones.iter().map(from).fold(f32::INFINITY, f32::min)
}

/// Where each joint alone would have a vertex: `rest` moved with it, or its position in the first frame
/// while no rest shape is known.
pub(super) fn prediction<'a>(
    first: Vec3,
    rest: Option<Vec3>,
    transforms: &'a [Vec<Rigid>],
) -> impl Fn(usize, usize) -> Vec3 + 'a {
    move |joint, t| {
        let at_rest = rest.unwrap_or_else(|| transforms[0][joint].inverse().point(first));
        transforms[t][joint].point(at_rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gram matrix of points in the plane.
    fn gram(points: &[[f64; 2]]) -> Vec<f64> {
        let products = points
            .iter()
            .flat_map(|a| points.iter().map(move |b| a[0] * b[0] + a[1] * b[1]));
        products.collect()
    }

    fn close(found: &[f64], expected: &[f64]) {
        let far = found.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-9);
        assert!(!far, "{found:?}, expected {expected:?}");
    }

    #[test]
    fn the_nearest_point_of_a_polytope() {
        // A corner, an edge's middle, and the origin inside of a triangle.
        close(
            &nearest_on_simplex(&gram(&[[1.0, 1.0], [2.0, 1.5]]), 2),
            &[1.0, 0.0],
        );
        close(
            &nearest_on_simplex(&gram(&[[1.0, 1.0], [5.0, 5.0], [1.0, -1.0]]), 3),
            &[0.5, 0.0, 0.5],
        );
        let inside = gram(&[[2.0, 0.0], [-1.0, 1.0], [-1.0, -1.0], [3.0, 3.0]]);
        let weights = nearest_on_simplex(&inside, 4);
        let norm: f64 = (0..16).map(|i| inside[i] * weights[i / 4] * weights[i % 4]).sum();
        assert!(
            norm.abs() < 1e-12 && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12,
            "{weights:?}"
        );
    }

    #[test]
    fn distances_from_bones() {
        let bone = [[Vec3::ZERO, Vec3::Y]];
        assert_eq!(distance(Vec3::new(1.0, 0.5, 0.0), &bone), 1.0);
        assert_eq!(distance(Vec3::new(0.0, 3.0, 0.0), &bone), 2.0);
        assert_eq!(distance(Vec3::X, &[[Vec3::ZERO; 2]]), 1.0);
    }
}
