//! Skinning weights for a garment, from those of the body under it.

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

/// How far [`diffused_weights`] smooths by default, metres: about half the gap between the thighs
/// that the front of a skirt spans, and less than the length of an upper arm, so that a sleeve
/// still follows its own bones.
pub const DIFFUSION_LENGTH_M: f32 = 0.06;

/// Most joints a garment vertex keeps; eight are what engines skin with at most.
const JOINTS_KEPT: usize = 8;

/// Weights below this move a vertex by less than a millimetre when its joint moves by a metre.
const LEAST_WEIGHT: f32 = 1e-3;

/// Weights of the nearest body vertex for each garment vertex, both in bind-pose space, metres.
///
/// # Errors
/// `body_weights` of another number of vertices than `body_rest`, no body vertex to be near to,
/// garment positions that are not finite.
pub fn nearest_body_weights(
    body_rest: &[Vec3],
    body_weights: &SkinningWeights,
    garment_rest: &[Vec3],
) -> Result<SkinningWeights, WeightsError> {
    check_rows(body_weights, body_rest.len())?;
    let tree = ClosestVertex::build(body_rest);
    // A row without a nearest vertex is empty, and refused as that.
    let row = |&p: &Vec3| {
        let nearest = tree.nearest(p).into_iter();
        nearest.flat_map(|(v, _)| body_weights.row(v))
    };
    SkinningWeights::from_rows(body_weights.joint_count(), garment_rest.iter().map(row))
}

/// Weights spread over the garment by heat flow: (M + τL) w = M w₀ for every joint, with L the
/// cotangent Laplacian, M lumped vertex areas and τ = `length_m`², one implicit step of
/// diffusion (Desbrun et al. 1999, "Implicit fairing of irregular meshes using diffusion and
/// curvature flow"), whose influence falls off as e^(−distance / `length_m`).
///
/// Nearest-body weights jump where the nearest body part changes, as between the legs under a
/// skirt; these do not. Negative cotangent weights count as zero, so that weights stay between
/// zero and one. Vertices at the same place are one and get the same row to the bit; vertices
/// that no sound face holds keep their weights. Rows are cut to 8 joints of at least 0.001.
///
/// # Errors
/// `nearest` of another number of vertices than `rest`.
pub fn diffused_weights(
    nearest: &SkinningWeights,
    rest: &TriMesh,
    length_m: f32,
) -> Result<SkinningWeights, WeightsError> {
    check_rows(nearest, rest.vertices.len())?;
    let (places, count) = numbered_places(&rest.vertices);
    let faces: Vec<[u32; 3]> = rest.faces.iter().map(|f| f.map(|v| places[v as usize])).collect();
    let mut positions = vec![Vec3::ZERO; count];
    (rest.vertices.iter().zip(&places)).for_each(|(&v, &place)| positions[place as usize] = v);
    let mut columns = mean_columns(nearest, &places, count);
    let diffusion = Diffusion::new(&positions, &faces, f64::from(length_m).powi(2));
    // Joints that move no part of the garment stay so.
    let used = columns.iter_mut().filter(|c| c.iter().any(|w| *w > 0.0));
    used.for_each(|column| diffusion.solve(column));
    let row = |&place: &u32| {
        let weight = |column: &Vec<f64>| column[place as usize].max(0.0) as f32;
        columns
            .iter()
            .map(weight)
            .enumerate()
            .collect::<Vec<_>>()
            .into_iter()
    };
    let smooth = SkinningWeights::from_rows(nearest.joint_count(), places.iter().map(row))?;
    Ok(smooth.pruned(JOINTS_KEPT, LEAST_WEIGHT))
}

/// Weights of any points near a garment with weights, by closest point on its rest shape: what
/// another mesh of the same garment wears.
///
/// # Errors
/// A garment without faces, points that are not finite, weights of another number of vertices.
pub fn transferred_weights(
    rest: &TriMesh,
    weights: &SkinningWeights,
    points: &[Vec3],
) -> Result<SkinningWeights, SurfaceMapError> {
    SurfaceMap::new(rest, points)?.weights(weights)
}

/// Weights with one row for all vertices at the same place of the rest shape, the mean of theirs: panels whose
/// seams are not welded stay closed under any pose. Vertices that are alone keep their rows to the bit.
///
/// # Errors
/// Weights of another number of vertices.
pub fn sewn_weights(weights: &SkinningWeights, rest: &[Vec3]) -> Result<SkinningWeights, WeightsError> {
    check_rows(weights, rest.len())?;
    let sewn: Vec<Vec<(usize, f32)>> = (copies(rest).iter())
        .map(|copies| mean_row(weights, copies))
        .collect();
    let (places, _) = numbered_places(rest);
    let rows = places.iter().map(|&place| sewn[place as usize].iter().copied());
    SkinningWeights::from_rows(weights.joint_count(), rows)
}

/// One number a vertex, the mean over all vertices at the same place of the rest shape.
pub fn sewn_numbers(numbers: &[f32], rest: &[Vec3]) -> Vec<f32> {
    let mut sewn = numbers.to_vec();
    for copies in copies(rest) {
        let first = numbers[copies[0]];
        if copies.iter().any(|&v| numbers[v] != first) {
            let mean = copies.iter().map(|&v| numbers[v]).sum::<f32>() / copies.len() as f32;
            copies.iter().for_each(|&v| sewn[v] = mean);
        }
    }
    sewn
}

/// Vertices at each place.
fn copies(vertices: &[Vec3]) -> Vec<Vec<usize>> {
    let (places, count) = numbered_places(vertices);
    let mut copies = vec![Vec::new(); count];
    for (vertex, place) in places.into_iter().enumerate() {
        copies[place as usize].push(vertex);
    }
    copies
}

/// The row of the first of `vertices` where all have the same, else their mean.
fn mean_row(weights: &SkinningWeights, vertices: &[usize]) -> Vec<(usize, f32)> {
    let first: Vec<(usize, f32)> = weights.row(vertices[0]).collect();
    if vertices.iter().all(|&v| weights.row(v).eq(first.iter().copied())) {
        return first;
    }
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

/// Number of the place of each vertex, without gaps, and the number of places.
fn numbered_places(vertices: &[Vec3]) -> (Vec<u32>, usize) {
    let first_at = weld(vertices);
    let mut places = vec![0; vertices.len()];
    let mut count = 0;
    for vertex in 0..vertices.len() {
        let first = first_at[vertex] as usize;
        if first == vertex {
            places[vertex] = count;
            count += 1;
        } else {
            places[vertex] = places[first];
        }
    }
    (places, count as usize)
}

/// One column of places a joint: the mean row of the vertices at each place.
fn mean_columns(weights: &SkinningWeights, places: &[u32], count: usize) -> Vec<Vec<f64>> {
    let mut members = vec![0.0; count];
    places.iter().for_each(|&place| members[place as usize] += 1.0);
    let mut columns = vec![vec![0.0; count]; weights.joint_count()];
    for (vertex, &place) in places.iter().enumerate() {
        for (joint, weight) in weights.row(vertex) {
            columns[joint][place as usize] += f64::from(weight) / members[place as usize];
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{point, sheet};
    use proptest::{collection::vec, prelude::*};

    fn of_two(shares: impl Iterator<Item = f32>) -> SkinningWeights {
        SkinningWeights::from_rows(2, shares.map(|s| [(0, 1.0 - s), (1, s)].into_iter())).unwrap()
    }

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
    fn a_step_becomes_the_exponential_of_the_screened_heat_equation() {
        // On a line w − τ w'' = step has the solution e^(x/l) / 2 left of it, 1 − e^(−x/l) / 2 right.
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
        fn rows_are_weights_and_obey_the_maximum_principle(
            shares in vec(0.2f32..0.7, 81), dents in vec(point(0.09), 81), length in 0.0f32..0.5,
        ) {
            // A sheet crumpled beyond Delaunay: many negative cotangents.
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
    fn panels_diffuse_across_their_seams_as_if_sewn() {
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
    fn seams_are_sewn_and_what_is_alone_stays() {
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
    fn what_no_face_holds_keeps_its_weights() {
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
}
