//! Skinning weights for a garment, made from those of the body under it.
//!
//! For tools that import captures.

use crate::{
    closest::ClosestVertex,
    diffusion::Diffusion,
    mesh::TriMesh,
    skinning::{SkinningWeights, WeightsError},
    surface_map::{SurfaceMap, SurfaceMapError},
    topology::weld,
};
use glam::Vec3;
use std::collections::BTreeMap;

/// Default smoothing length of [`diffused_weights`], metres.
///
/// It is about half of the gap between the thighs, which the front of a skirt spans. It is less
/// than the length of an upper arm, so that a sleeve still follows its own bones.
pub const DIFFUSION_LENGTH_M: f32 = 0.06;

/// Largest number of joints a garment vertex, as many as engines skin with.
const MAX_JOINTS: usize = 8;

/// Smallest weight that is kept: it moves a vertex by 1 mm when its joint moves by 1 m.
const MIN_WEIGHT: f32 = 1e-3;

/// Returns for each garment vertex the weights of its nearest body vertex.
///
/// Body and garment are in bind-pose space, metres.
///
/// # Errors
/// `body_weights` of another number of vertices than `body_rest`, a body without vertices, garment
/// positions that are not finite.
pub fn nearest_body_weights(
    body_rest: &[Vec3],
    body_weights: &SkinningWeights,
    garment_rest: &[Vec3],
) -> Result<SkinningWeights, WeightsError> {
    check_rows(body_weights, body_rest.len())?;
    let tree = ClosestVertex::build(body_rest);
    // Without a nearest vertex the row is empty, which `from_rows` refuses.
    let row = |&p: &Vec3| {
        let nearest = tree.nearest(p).into_iter();
        nearest.flat_map(|(v, _)| body_weights.row(v))
    };
    SkinningWeights::from_rows(body_weights.joint_count(), garment_rest.iter().map(row))
}

/// Smooths weights over the garment by heat diffusion.
///
/// Weights of the nearest body vertex jump where the nearest body part changes, as between the legs
/// under a skirt. Diffused weights vary smoothly: the influence of a vertex falls off as
/// e^(−distance / `length_m`).
///
/// The weights of every joint solve (M + τL) w = M w₀, with the cotangent Laplacian L, lumped
/// vertex areas M and τ = `length_m`². This is one implicit step of diffusion (Desbrun et al. 1999,
/// "Implicit fairing of irregular meshes using diffusion and curvature flow"). Negative cotangent
/// weights count as zero, so that weights stay between zero and one.
///
/// Vertices at the same position count as one and get the same row to the bit. Vertices without a
/// face of nonzero area keep their weights. Rows are cut to 8 joints of at least 0.001.
///
/// # Errors
/// `nearest` of another number of vertices than `rest`.
pub fn diffused_weights(
    nearest: &SkinningWeights,
    rest: &TriMesh,
    length_m: f32,
) -> Result<SkinningWeights, WeightsError> {
    check_rows(nearest, rest.vertices.len())?;
    let welded = WeldedVertices::new(&rest.vertices);
    let mut columns = mean_columns(nearest, &welded);
    diffuse(&mut columns, rest, &welded, length_m);
    // The solver's tolerance may leave weights just below zero.
    Ok(weights_of_columns(&columns, &welded)?.pruned(MAX_JOINTS, MIN_WEIGHT))
}

/// Returns `given` weights plus their change to `changed` ones, smoothed over the garment by the
/// diffusion of [`diffused_weights`].
///
/// Vertices at the same position count as one and get the same row. Where neighbours change alike,
/// their weights differ as much as before, however sharply that is.
/// Nothing changes many lengths away from all changes, up to rounding. Rows have any number of joints.
///
/// # Errors
/// Weights of another number of vertices than `rest`, or of two numbers of joints.
pub fn with_diffused_change(
    given: &SkinningWeights,
    changed: &SkinningWeights,
    rest: &TriMesh,
    length_m: f32,
) -> Result<SkinningWeights, WeightsError> {
    check_rows(given, rest.vertices.len())?;
    if changed.joint_count() != given.joint_count() || changed.len() != given.len() {
        return Err(WeightsError::Shape {
            expected: given.len() * given.joint_count(),
            found: changed.len() * changed.joint_count(),
        });
    }
    let welded = WeldedVertices::new(&rest.vertices);
    let before = mean_columns(given, &welded);
    let mut columns = mean_columns(changed, &welded);
    for (column, before) in columns.iter_mut().zip(&before) {
        column.iter_mut().zip(before).for_each(|(w, before)| *w -= before);
    }
    diffuse(&mut columns, rest, &welded, length_m);
    for (column, before) in columns.iter_mut().zip(&before) {
        column.iter_mut().zip(before).for_each(|(w, before)| *w += before);
    }
    // A row sums to 1, so that its weights above zero come to 1 or more.
    weights_of_columns(&columns, &welded)
}

/// Diffuses the column of each joint over the garment.
fn diffuse(columns: &mut [Vec<f64>], rest: &TriMesh, welded: &WeldedVertices, length_m: f32) {
    let of_vertex = |v: u32| welded.of_vertex[v as usize];
    let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(of_vertex)).collect();
    let mut positions = vec![Vec3::ZERO; welded.count];
    (rest.vertices.iter().zip(&welded.of_vertex)).for_each(|(&v, &id)| positions[id as usize] = v);
    let diffusion = Diffusion::new(&positions, &faces, f64::from(length_m).powi(2));
    // The columns of joints that move no part of the garment stay zero.
    let used = columns.iter_mut().filter(|c| c.iter().any(|w| *w != 0.0));
    used.for_each(|column| diffusion.solve(column));
}

/// Makes weights of columns. Those below zero count as zero.
fn weights_of_columns(
    columns: &[Vec<f64>],
    welded: &WeldedVertices,
) -> Result<SkinningWeights, WeightsError> {
    let row = |&id: &u32| {
        let weight = |column: &Vec<f64>| column[id as usize].max(0.0) as f32;
        let row: Vec<_> = columns.iter().map(weight).enumerate().collect();
        row.into_iter()
    };
    SkinningWeights::from_rows(columns.len(), welded.of_vertex.iter().map(row))
}

/// Returns the weights at `points`, interpolated at the closest points of a garment's rest shape.
///
/// The points are usually the vertices of another mesh of the same garment.
///
/// # Errors
/// A garment without faces, points that are not finite, weights of another number of vertices.
pub fn transferred_weights(
    rest: &TriMesh,
    weights: &SkinningWeights,
    points: &[Vec3],
) -> Result<SkinningWeights, SurfaceMapError> {
    SurfaceMap::new(rest, points)?.interpolate_weights(weights)
}

/// Averages the weights of vertices at the same position of the rest shape.
///
/// Panels whose seams are not welded then stay closed in every pose. Vertices with a position of
/// their own keep their rows to the bit.
///
/// # Errors
/// Weights of another number of vertices.
pub fn sewn_weights(weights: &SkinningWeights, rest: &[Vec3]) -> Result<SkinningWeights, WeightsError> {
    check_rows(weights, rest.len())?;
    let welded = WeldedVertices::new(rest);
    let sewn: Vec<Vec<(usize, f32)>> = (welded.members().iter())
        .map(|vertices| mean_row(weights, vertices))
        .collect();
    let rows = welded.of_vertex.iter();
    let rows = rows.map(|&id| sewn[id as usize].iter().copied());
    SkinningWeights::from_rows(weights.joint_count(), rows)
}

/// Averages one number a vertex over the vertices at the same position of the rest shape.
pub fn sewn_numbers(numbers: &[f32], rest: &[Vec3]) -> Vec<f32> {
    let mut sewn = numbers.to_vec();
    for vertices in WeldedVertices::new(rest).members() {
        let first = numbers[vertices[0]];
        // Equal numbers stay the same bits; their computed mean may not.
        if vertices.iter().any(|&v| numbers[v] != first) {
            let mean = vertices.iter().map(|&v| numbers[v]).sum::<f32>() / vertices.len() as f32;
            vertices.iter().for_each(|&v| sewn[v] = mean);
        }
    }
    sewn
}

/// Returns the mean row of `vertices`, or the row of the first one to the bit if all are equal.
///
/// The sum stands for the mean, for `SkinningWeights` scales rows to a sum of 1.
fn mean_row(weights: &SkinningWeights, vertices: &[usize]) -> Vec<(usize, f32)> {
    let first: Vec<(usize, f32)> = weights.row(vertices[0]).collect();
    if vertices.iter().all(|&v| weights.row(v).eq(first.iter().copied())) {
        return first;
    }
    // Sorted by joint, so that the row does not depend on hashing.
    let mut sums = BTreeMap::new();
    for (joint, weight) in vertices.iter().flat_map(|&v| weights.row(v)) {
        *sums.entry(joint).or_insert(0.0) += weight;
    }
    sums.into_iter().collect()
}

fn check_rows(weights: &SkinningWeights, vertices: usize) -> Result<(), WeightsError> {
    if weights.len() == vertices {
        return Ok(());
    }
    Err(WeightsError::Shape {
        expected: vertices * weights.joint_count(),
        found: weights.len() * weights.joint_count(),
    })
}

/// Vertices of a mesh, welded where they have the same position.
struct WeldedVertices {
    /// Index of the welded vertex of each vertex, without gaps.
    of_vertex: Vec<u32>,
    /// Number of welded vertices.
    count: usize,
}

impl WeldedVertices {
    fn new(vertices: &[Vec3]) -> Self {
        let first_at = weld(vertices);
        let mut of_vertex = vec![0; vertices.len()];
        let mut count = 0;
        for vertex in 0..vertices.len() {
            let first = first_at[vertex] as usize;
            if first == vertex {
                of_vertex[vertex] = count;
                count += 1;
            } else {
                of_vertex[vertex] = of_vertex[first];
            }
        }
        Self {
            of_vertex,
            count: count as usize,
        }
    }

    /// Lists the vertices of each welded vertex.
    fn members(&self) -> Vec<Vec<usize>> {
        let mut members = vec![Vec::new(); self.count];
        for (vertex, &id) in self.of_vertex.iter().enumerate() {
            members[id as usize].push(vertex);
        }
        members
    }
}

/// Returns one column a joint: its mean weight at each welded vertex.
fn mean_columns(weights: &SkinningWeights, welded: &WeldedVertices) -> Vec<Vec<f64>> {
    let mut members = vec![0.0; welded.count];
    let ids = &welded.of_vertex;
    ids.iter().for_each(|&id| members[id as usize] += 1.0);
    let mut columns = vec![vec![0.0; welded.count]; weights.joint_count()];
    for (vertex, &id) in ids.iter().enumerate() {
        for (joint, weight) in weights.row(vertex) {
            columns[joint][id as usize] += f64::from(weight) / members[id as usize];
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{point, sheet};
    use proptest::{collection::vec, prelude::*};

    /// Weights of two joints: each share is that of joint 1.
    fn of_two(shares: impl Iterator<Item = f32>) -> SkinningWeights {
        SkinningWeights::from_rows(2, shares.map(|s| [(0, 1.0 - s), (1, s)].into_iter())).unwrap()
    }

    /// Weight of joint 1.
    fn share(weights: &SkinningWeights, vertex: usize) -> f32 {
        weights.row(vertex).filter(|(j, _)| *j == 1).map(|(_, w)| w).sum()
    }

    #[test]
    fn each_vertex_takes_the_row_of_its_nearest_body_vertex() {
        let body = [Vec3::ZERO, Vec3::X];
        let weights = of_two([0.25, 1.0].into_iter());
        let garment = [Vec3::X * 0.6, Vec3::X * 0.4, Vec3::X * 9.0];
        let found = nearest_body_weights(&body, &weights, &garment).unwrap();
        assert_eq!(found.to_dense(), [0.0, 1.0, 0.75, 0.25, 0.0, 1.0]);
        let refused = nearest_body_weights(&body[..1], &weights, &garment);
        assert!(matches!(refused, Err(WeightsError::Shape { .. })));
        let refused = nearest_body_weights(&body, &weights, &[Vec3::X, Vec3::NAN]);
        assert_eq!(refused, Err(WeightsError::Empty { vertex: 1 }));
    }

    #[test]
    fn a_step_diffuses_to_the_exact_exponential() {
        // On a line w − τ w'' = step has the solution e^(x/l) / 2 for x < 0, 1 − e^(−x/l) / 2
        // above.
        let (mesh, length) = (sheet(200, 2, 0.005), 0.06);
        let step = of_two(mesh.vertices.iter().map(|v| match v.x - 0.5 {
            x if x.abs() < 1e-4 => 0.5,
            x => f32::from(x > 0.0),
        }));
        let smooth = diffused_weights(&step, &mesh, length).unwrap();
        for (i, v) in mesh.vertices.iter().enumerate() {
            let x = v.x - 0.5;
            let half = 0.5 * (-x.abs() / length).exp();
            let exact = if x > 0.0 { 1.0 - half } else { half };
            assert!(
                (share(&smooth, i) - exact).abs() < 2e-3,
                "at {x}: {}",
                share(&smooth, i)
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn rows_sum_to_one_and_obey_the_maximum_principle(
            shares in vec(0.2f32..0.7, 81), dents in vec(point(0.09), 81), length in 0.0f32..0.5,
        ) {
            // A crumpled sheet is not Delaunay: it has many negative cotangents.
            let mut mesh = sheet(8, 8, 0.1);
            mesh.vertices.iter_mut().zip(&dents).for_each(|(v, d)| *v += *d);
            let given = of_two(shares.iter().copied());
            let smooth = diffused_weights(&given, &mesh, length).unwrap();
            let (low, high) = shares.iter().fold((1f32, 0f32), |(l, h), &s| (l.min(s), h.max(s)));
            for v in 0..81 {
                let sum: f32 = smooth.row(v).map(|(_, w)| w).sum();
                prop_assert!((sum - 1.0).abs() < 1e-6);
                prop_assert!(share(&smooth, v) >= low - 1e-6 && share(&smooth, v) <= high + 1e-6);
            }
        }
    }

    #[test]
    fn weights_diffuse_across_unwelded_seams() {
        let sewn = sheet(10, 4, 0.02);
        let vertices = sewn
            .faces
            .iter()
            .flatten()
            .map(|&v| sewn.vertices[v as usize])
            .collect();
        let faces = (0..sewn.faces.len() as u32)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect();
        let cut = TriMesh::new(vertices, faces).unwrap();
        let step = |mesh: &TriMesh| of_two(mesh.vertices.iter().map(|v| f32::from(v.x > 0.1)));
        let whole = diffused_weights(&step(&sewn), &sewn, 0.06).unwrap();
        let panels = diffused_weights(&step(&cut), &cut, 0.06).unwrap();
        for (corner, &v) in sewn.faces.iter().flatten().enumerate() {
            assert!((share(&panels, corner) - share(&whole, v as usize)).abs() < 1e-6);
            let first = sewn.faces.iter().flatten().position(|&u| u == v).unwrap();
            assert!(panels.row(corner).eq(panels.row(first)));
        }
    }

    #[test]
    fn rows_are_averaged_at_seams_and_unchanged_elsewhere() {
        let rest = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X, Vec3::X];
        let given = of_two([0.3, 0.1, 0.7, 0.2, 0.6].into_iter());
        let sewn = sewn_weights(&given, &rest).unwrap();
        for alone in [0, 2] {
            assert!(sewn.row(alone).eq(given.row(alone)));
        }
        assert!((share(&sewn, 1) - 0.3).abs() < 1e-6);
        assert!(sewn.row(3).eq(sewn.row(1)) && sewn.row(4).eq(sewn.row(1)));
        assert_eq!(sewn_weights(&sewn, &rest).unwrap(), sewn);
        assert_eq!(
            sewn_numbers(&[0.1, 0.0, 0.9, 1.0, 0.5], &rest),
            [0.1, 0.5, 0.9, 0.5, 0.5]
        );
        assert!(sewn_weights(&given, &rest[1..]).is_err());
    }

    #[test]
    fn vertices_without_a_face_of_nonzero_area_keep_their_weights() {
        let mut mesh = sheet(2, 2, 0.1);
        mesh.vertices
            .extend([Vec3::X * 5.0, Vec3::X * 6.0, Vec3::X * 7.0]);
        // The first of the three has no face, the others one without area.
        mesh.faces.push([10, 11, 10]);
        let given = of_two((0..12).map(|i| if i < 9 { 0.0 } else { 0.5 + 0.01 * i as f32 }));
        let smooth = diffused_weights(&given, &mesh, 0.06).unwrap();
        for i in 0..12 {
            assert!((share(&smooth, i) - share(&given, i)).abs() < 1e-6);
        }
    }

    #[test]
    fn a_change_is_smoothed_and_weights_that_do_not_change_keep_their_jumps() {
        let mesh = sheet(20, 2, 0.01);
        let right = |v: usize| mesh.vertices[v].x > 0.095;
        let all = || 0..mesh.vertices.len();
        let jump = of_two(all().map(|v| if right(v) { 0.8 } else { 0.2 }));
        assert_close(&with_diffused_change(&jump, &jump, &mesh, 0.03).unwrap(), &jump);
        let half = of_two(all().map(|_| 0.5));
        let smooth = with_diffused_change(&half, &jump, &mesh, 0.03).unwrap();
        assert_close(&smooth, &diffused_weights(&jump, &mesh, 0.03).unwrap());
        // The change takes more from joint 1 than some vertices have.
        let more = of_two(all().map(|v| if right(v) { 1.0 } else { 0.0 }));
        let less = of_two(all().map(|_| 0.0));
        let clamped = with_diffused_change(&more, &less, &mesh, 0.03).unwrap();
        for row in clamped.to_dense().chunks_exact(2) {
            assert!(row[1] >= 0.0 && (row[0] + row[1] - 1.0).abs() < 1e-6, "{row:?}");
        }
    }

    #[test]
    fn a_change_to_other_joints_or_vertices_is_refused() {
        let mesh = sheet(2, 2, 0.1);
        let weights = of_two(mesh.vertices.iter().map(|_| 0.5));
        let fewer = of_two([0.5].into_iter());
        let joints = SkinningWeights::from_rows(3, mesh.vertices.iter().map(|_| [(2, 1.0)].into_iter()));
        assert!(with_diffused_change(&weights, &fewer, &mesh, 0.03).is_err());
        assert!(with_diffused_change(&fewer, &weights, &mesh, 0.03).is_err());
        assert!(with_diffused_change(&weights, &joints.unwrap(), &mesh, 0.03).is_err());
    }

    fn assert_close(found: &SkinningWeights, expected: &SkinningWeights) {
        let both = found.to_dense().into_iter().zip(expected.to_dense());
        let largest = both.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(largest < 2e-3, "{largest}");
    }
}
