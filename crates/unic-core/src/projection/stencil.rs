//! Stencils of the quadratic bending energy, of free edges and of coarse levels.

use glam::Vec3;
use std::collections::HashMap;

/// Largest |cotangent| of an angle in a stencil, that of about three degrees. A sliver's would
/// outweigh everything around it.
const MAX_COTANGENT: f32 = 20.0;

/// Share of a third difference along a free edge that a sweep removes. It smooths the zigzag from
/// vertex to vertex, and leaves waves of eight edges and more, into which the edge may buckle.
const FREE_EDGE_SHARE: f32 = 0.5;

/// Share of a stencil's sum on a coarse level that a sweep removes.
const LEVEL_SHARE: f32 = 0.5;

/// Number of nearest samples among which the stencil of a sample looks for three around it.
const NEAREST_SAMPLES: usize = 10;

/// Least squared sine of the angle at the first of three samples that a stencil uses.
const LEAST_SQUARED_SINE: f32 = 0.03;

/// Largest miss of a free edge's stencil at rest, by the mean length of its edges. Beyond it the free
/// edge turns a corner, and the stencil would see a rotation as a zigzag.
const CORNER_MISS: f32 = 1.0;

/// Factor of the distance between the weighted mean and the place in [`Triple::reach_m`].
const MISS_WEIGHT: f32 = 4.0;

/// Four vertices x_i with coefficients k_i. A sweep reduces the sum Σ k_i x_i over their moves.
///
/// At a hinge the sum is zero for linear moves, and grows with their bending. Along a free edge it is
/// zero for moves that are quadratic in the length of the edge. On a coarse level it is zero for
/// linear moves of flat cloth, and nearly so for those of curved cloth.
#[derive(Clone, Copy, Debug)]
pub(super) struct BendingStencil {
    /// Distinct vertices.
    pub(super) vertices: [u32; 4],
    /// Coefficients, which sum to zero.
    pub(super) coefficients: [f32; 4],
    /// Share of the sum that one sweep removes, 0 to 1.
    pub(super) share: f32,
}

/// Lists the stencils of all hinges and of the free edges of a mesh, given its sorted `edges`. A sweep
/// removes the share `bending` of the sums at hinges.
pub(super) fn bending_stencils(
    rest: &[Vec3],
    faces: &[[u32; 3]],
    edges: &[[u32; 2]],
    bending: f32,
) -> Vec<BendingStencil> {
    let mut opposite: Vec<Vec<u32>> = vec![Vec::new(); edges.len()];
    for &[a, b, c] in faces {
        for (ends, corner) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            // Faces with a repeated vertex have edges that are not in the list.
            if let Ok(edge) = edges.binary_search(&ends) {
                opposite[edge].push(corner);
            }
        }
    }
    let hinges = edges
        .iter()
        .zip(&opposite)
        .filter_map(|(&ends, corners)| match corners[..] {
            [c, d] if c != d => Some(hinge(rest, [ends[0], ends[1], c, d], bending)),
            _ => None,
        });
    let free = edges
        .iter()
        .zip(&opposite)
        .filter(|(_, corners)| corners.len() == 1);
    let free: Vec<[u32; 2]> = free.map(|(&ends, _)| ends).collect();
    hinges.chain(free_edge_stencils(rest, &free)).collect()
}

/// Returns the stencil of an edge (0, 1) and the corners opposite to it (Bergou et al. 2006, "A
/// quadratic bending model for inextensible surfaces", eq. 5).
fn hinge(rest: &[Vec3], vertices: [u32; 4], share: f32) -> BendingStencil {
    let [a, b, c, d] = vertices.map(|v| rest[v as usize]);
    let at_a = [cotangent(a, b, c), cotangent(a, b, d)];
    let at_b = [cotangent(b, a, c), cotangent(b, a, d)];
    BendingStencil {
        vertices,
        coefficients: [
            at_b[0] + at_b[1],
            at_a[0] + at_a[1],
            -(at_a[0] + at_b[0]),
            -(at_a[1] + at_b[1]),
        ],
        share,
    }
}

/// Returns the cotangent of the angle at `corner` between the directions to two points.
fn cotangent(corner: Vec3, p: Vec3, q: Vec3) -> f32 {
    let (u, v) = (p - corner, q - corner);
    let cotangent = u.dot(v) / u.cross(v).length();
    // A corner without an angle gives 0 / 0 or a quotient by zero.
    match cotangent.is_nan() {
        true => 0.0,
        false => cotangent.clamp(-MAX_COTANGENT, MAX_COTANGENT),
    }
}

/// Lists the third differences along free edges, one for each edge with a free edge at both ends and no
/// corner near.
fn free_edge_stencils(rest: &[Vec3], free: &[[u32; 2]]) -> Vec<BendingStencil> {
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    for &[a, b] in free {
        neighbours.entry(a).or_default().push(b);
        neighbours.entry(b).or_default().push(a);
    }
    // The free edge goes on to one vertex alone, unless it branches.
    let beyond = |end: u32, other: u32| match neighbours[&end][..] {
        [a, b] => Some(if a == other { b } else { a }),
        _ => None,
    };
    let stencil = |&[b, c]: &[u32; 2]| {
        let (a, d) = (beyond(b, c)?, beyond(c, b)?);
        let vertices = [a, b, c, d];
        let coefficients = third_difference(vertices.map(|v| rest[v as usize]))?;
        // Around a hole of three edges both are the same vertex.
        (a != d).then_some(BendingStencil {
            vertices,
            coefficients,
            share: FREE_EDGE_SHARE,
        })
    };
    // In the order of the edges: that of a hash map changes from run to run.
    free.iter().filter_map(stencil).collect()
}

/// Returns the coefficients of the third difference along a line through four places, by the lengths
/// between them; 1, −3, 3 and −1 for equal lengths. None at a corner.
fn third_difference(places: [Vec3; 4]) -> Option<[f32; 4]> {
    let [a, b, c, d] = places;
    let lengths = [a.distance(b), b.distance(c), c.distance(d)];
    let along = [
        0.0,
        lengths[0],
        lengths[0] + lengths[1],
        lengths.iter().sum::<f32>(),
    ];
    // Those of Newton's divided difference.
    let divisor = |i: usize| {
        let others = (0..4).filter(|j| *j != i);
        others.map(|j| along[j] - along[i]).product::<f32>()
    };
    let quotients = [0, 1, 2, 3].map(|i| divisor(i).recip());
    let size: f32 = quotients.iter().map(|q| q.abs()).sum();
    let coefficients = quotients.map(|q| 8.0 * q / size);
    let miss: Vec3 = places.iter().zip(coefficients).map(|(&p, k)| p * k).sum();
    // False for NaN, too.
    (miss.length() < CORNER_MISS * along[3] / 3.0).then_some(coefficients)
}

/// Lists the stencils of the samples of a coarse level, given their places at rest, metres, and its
/// chords. A stencil joins a sample to three others with the weights that give its place, or the
/// nearest point of their plane. A sample has none unless three of its nearest neighbours span a
/// plane.
pub(super) fn level_stencils(places: &[Vec3], chords: &[[u32; 2]]) -> Vec<BendingStencil> {
    let mut neighbours = vec![Vec::new(); places.len()];
    for &[a, b] in chords {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let stencil = |(sample, near): (usize, &mut Vec<u32>)| {
        let distance = |other: u32| places[other as usize].distance_squared(places[sample]);
        near.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
        near.truncate(NEAREST_SAMPLES);
        let around = best_triple(places, places[sample], near)?;
        let [a, b, c] = around.samples;
        Some(BendingStencil {
            vertices: [sample as u32, a, b, c],
            coefficients: [1.0, -around.weights[0], -around.weights[1], -around.weights[2]],
            share: LEVEL_SHARE,
        })
    };
    neighbours.iter_mut().enumerate().filter_map(stencil).collect()
}

/// Three samples with the weights that give a place.
struct Triple {
    samples: [u32; 3],
    weights: [f32; 3],
    /// Sum of the distances to the samples times their absolute weights, metres, and
    /// [`MISS_WEIGHT`] times the distance of the weighted mean from the place. It is least where near
    /// samples surround the place.
    reach_m: f32,
}

/// Finds the three of some samples with the least reach from `place`.
fn best_triple(places: &[Vec3], place: Vec3, near: &[u32]) -> Option<Triple> {
    let triples = (0..near.len())
        .flat_map(|c| (0..c).flat_map(move |b| (0..b).map(move |a| [a, b, c])))
        .map(|triple| triple.map(|k| near[k]));
    let triples = triples.filter_map(|samples| {
        let corners = samples.map(|s| places[s as usize]);
        let weights = barycentric_weights(corners, place)?;
        let terms = || weights.iter().zip(&corners);
        let reach: f32 = terms().map(|(w, p)| w.abs() * p.distance(place)).sum();
        let mean: Vec3 = terms().map(|(&w, &p)| p * w).sum();
        Some(Triple {
            samples,
            weights,
            reach_m: reach + MISS_WEIGHT * mean.distance(place),
        })
    });
    // The first of several with the same reach, so that the result does not depend on the iterator.
    (triples.filter(|triple| triple.reach_m.is_finite()))
        .reduce(|best, next| if next.reach_m < best.reach_m { next } else { best })
}

/// Returns the barycentric coordinates of the point of a triangle's plane that is closest to `place`;
/// none for a sliver.
fn barycentric_weights([a, b, c]: [Vec3; 3], place: Vec3) -> Option<[f32; 3]> {
    let (u, v, to_place) = (b - a, c - a, place - a);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (pu, pv) = (to_place.dot(u), to_place.dot(v));
    let determinant = uu * vv - uv * uv;
    // False for NaN, too.
    (determinant > LEAST_SQUARED_SINE * uu * vv).then(|| {
        let second = (pu * vv - pv * uv) / determinant;
        let third = (pv * uu - pu * uv) / determinant;
        [1.0 - second - third, second, third]
    })
}
