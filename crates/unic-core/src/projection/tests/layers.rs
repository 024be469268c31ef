//! Contract of the pushes between layers: pleats whose layers pass through each other come apart, and
//! layers in order, opened pleats and garments without layers stay.

use super::{
    super::{OrderScratch, order::LEAST_COSINE},
    *,
};
use std::collections::BTreeSet;

/// Number of vertices along a side.
const N: usize = 40;

/// Number of columns of a layer.
const WIDTH: usize = 6;

/// Distance between layers at rest, metres.
const THICK: f32 = 0.6 * CELL;

/// Layer of a column of the sheet, from the outermost, 0, to the innermost, 2.
fn layer(column: usize) -> usize {
    column / WIDTH % 3
}

/// The sheet in knife pleats: each layer rises along x, so that the innermost one goes on as the
/// outermost one of the next pleat. Distances between layers are multiplied by a factor: negative ones
/// turn the layers inside out.
fn pleated(height: f32) -> TriMesh {
    let mut mesh = sheet(N);
    for (vertex, p) in mesh.vertices.iter_mut().enumerate() {
        let column = vertex % N;
        let (pleat, along) = (column / WIDTH / 3, column % WIDTH);
        // The middle layer runs back.
        let along = if layer(column) == 1 {
            WIDTH - 1 - along
        } else {
            along
        };
        p.x = CELL * (WIDTH * pleat + along) as f32;
        let rise = 2.0 * along as f32 / WIDTH as f32;
        p.z = THICK * (height * (1.0 - layer(column) as f32) + rise);
    }
    mesh
}

fn layered(mesh: &TriMesh, mask: Option<&[f32]>) -> StrainProjection {
    let config = ProjectionConfig {
        layers: 0.2,
        ..config()
    };
    inextensible(config, mesh, mask)
}

/// Finds pairs and pushes them once. Returns their number.
fn push(projection: &StrainProjection, share: f32, positions: &mut [Vec3A]) -> usize {
    let mut scratch = OrderScratch::default();
    projection.find_pairs(positions, &mut scratch);
    projection.push_pairs(share, &mut scratch, positions);
    scratch.layers.pairs.ends().count()
}

fn aligned(positions: &[Vec3]) -> Vec<Vec3A> {
    positions.iter().map(|p| Vec3A::from(*p)).collect()
}

/// Number of vertices above and below each other, away from folds, whose layers are in reversed order.
fn reversed(positions: &[Vec3A]) -> usize {
    let inner = |i: usize| (1..WIDTH - 1).contains(&(i % N % WIDTH));
    let all = (0..N * N).filter(|&i| inner(i));
    let pairs = all.flat_map(|a| (a / N * N..(a / N + 1) * N).map(move |b| (a, b)));
    let rest = pleated(1.0);
    let above = |&(a, b): &(usize, usize)| {
        layer(b % N) == layer(a % N) + 1 && inner(b) && rest.vertices[a].x == rest.vertices[b].x
    };
    let pairs = pairs.filter(above);
    pairs.filter(|&(a, b)| positions[a].z < positions[b].z).count()
}

#[test]
fn layers_that_pass_through_each_other_come_apart() {
    let projection = layered(&pleated(1.0), None);
    // Turned inside out, with layers at a third of their distance.
    let mut positions = aligned(&pleated(-0.3).vertices);
    let before = reversed(&positions);
    for _ in 0..30 {
        push(&projection, 1.0, &mut positions);
    }
    let after = reversed(&positions);
    assert!(
        before > 300 && after == 0,
        "{before} reversed pairs, then {after}"
    );
    assert!(positions.iter().all(|p| p.is_finite()));
}

#[test]
fn sweeps_and_relaxation_put_layers_in_order() {
    let projection = layered(&pleated(1.0), None);
    let turned = pleated(-0.3).vertices;
    let mut cloth = Sheet::new(N * N, Quat::IDENTITY);
    let shown = (0..10).map(|_| cloth.tick(&projection, &turned)).last();
    let left = reversed(&aligned(&shown.unwrap()));
    let relaxed = |share: f32| {
        let mut positions = turned.clone();
        let mut scratch = ProjectionScratch::default();
        scratch.keep_uncorrected(&positions);
        projection.relax(&[ContactPlane::NONE; N * N], share, &mut positions, &mut scratch);
        reversed(&aligned(&positions))
    };
    let (given, pushed) = (relaxed(0.0), relaxed(1.0));
    assert!(
        given > 300 && 2 * pushed < given && 4 * left < given,
        "{given} reversed pairs, {pushed} relaxed, {left} shown"
    );
}

#[test]
fn layers_in_order_and_opened_pleats_stay() {
    let projection = layered(&pleated(1.0), None);
    assert!(projection.layers().is_some());
    for (name, mesh) in [
        ("rest", pleated(1.0)),
        ("thicker", pleated(1.5)),
        ("open", sheet(N)),
    ] {
        let start = aligned(&mesh.vertices);
        let mut pushed = start.clone();
        push(&projection, 1.0, &mut pushed);
        let moved = start.iter().zip(&pushed).filter(|(a, b)| a != b).count();
        assert_eq!(moved, 0, "{name}");
    }
}

#[test]
fn garments_without_layers_have_no_order_of_them() {
    assert!(layered(&sheet(N), None).layers().is_none());
    let mut tube = sheet(N);
    for p in &mut tube.vertices {
        let angle = p.x / CELL * std::f32::consts::TAU / N as f32;
        let radius = CELL * N as f32 / std::f32::consts::TAU;
        *p = Vec3::new(radius * angle.sin(), p.y, -radius * angle.cos());
    }
    assert!(layered(&tube, None).layers().is_none());
    let config = ProjectionConfig {
        layers: 0.0,
        ..config()
    };
    assert!(inextensible(config, &pleated(1.0), None).layers().is_none());
}

#[test]
fn a_share_of_freedom_is_that_share_of_a_push() {
    let moves = |mask: Option<&[f32]>, share: f32| {
        let mut positions = aligned(&pleated(-0.3).vertices);
        let start = positions.clone();
        push(&layered(&pleated(1.0), mask), share, &mut positions);
        let moves = start.iter().zip(&positions).map(|(a, b)| *b - *a);
        moves.collect::<Vec<_>>()
    };
    let whole = moves(None, 1.0);
    assert!(whole.iter().filter(|m| m.length() > 1e-4).count() > 300);
    for half in [moves(Some(&[0.5; N * N]), 1.0), moves(None, 0.5)] {
        let differ = |(a, b): (&Vec3A, &Vec3A)| (*a * 0.5 - *b).length() > 1e-6;
        assert!(!whole.iter().zip(&half).any(differ));
    }
    assert!(moves(None, 0.0).iter().all(|m| *m == Vec3A::ZERO));
}

#[test]
fn the_search_finds_the_layers_of_a_comparison_of_all() {
    let projection = layered(&pleated(1.0), None);
    let order = projection.layers().unwrap();
    let mesh = TriMesh {
        vertices: pleated(-0.4).vertices,
        ..sheet(N)
    };
    let mut normals = Vec::new();
    crate::mesh::vertex_normals(&mesh.vertices, &mesh.faces, &mut normals);
    let positions = aligned(&mesh.vertices);
    let mut scratch = OrderScratch::default();
    projection.find_pairs(&positions, &mut scratch);
    let found: Vec<[u32; 2]> = (scratch.layers.pairs.ends())
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let distinct: BTreeSet<[u32; 2]> = found.iter().copied().collect();
    assert_eq!(distinct.len(), found.len());
    let (gap, distances) = (order.gap_m(), order.distances());
    let is_pair = |&[a, b]: &[u32; 2]| {
        let (between, places) = (
            positions[b as usize] - positions[a as usize],
            [a, b].map(|v| order.places()[v as usize]),
        );
        let [from, to] = [a, b].map(|v| Vec3A::from(normals[v as usize]));
        let [from, to] = [from * places[0].side, to * places[1].side];
        let rise = places[1].height_m - places[0].height_m;
        let at_rest = places[1].position - places[0].position;
        between.length() < distances.near_m
            && rise.abs() >= order.least_rise_m()
            && from.dot(to) > LEAST_COSINE
            && between.dot((from + to).normalize() * rise.signum()) < distances.kept_m
            && at_rest.length() < order.reach_m()
            && at_rest.dot((places[0].outward + places[1].outward).normalize() * rise.signum()) >= gap
    };
    let count = (N * N) as u32;
    let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    let expected: BTreeSet<[u32; 2]> = all.filter(is_pair).collect();
    // Rounding may decide for a pair at a limit.
    let differing = expected.symmetric_difference(&distinct).count();
    assert!(
        expected.len() > 1000 && 100 * differing < expected.len(),
        "{} pairs, {differing} differ",
        expected.len()
    );
}

#[test]
fn a_seam_in_a_pleat_stays_closed() {
    let mut mesh = pleated(1.0);
    // A seam along the third row, whose upper faces have vertices of their own.
    let (row, count) = (2 * N as u32, (N * N) as u32);
    mesh.vertices.extend_from_within(2 * N..3 * N);
    for face in &mut mesh.faces {
        if face.iter().any(|&v| v >= row + N as u32) {
            *face = face.map(|v| {
                if v / N as u32 == 2 {
                    count + v % N as u32
                } else {
                    v
                }
            });
        }
    }
    let mut predicted = pleated(-0.3).vertices;
    predicted.extend_from_within(2 * N..3 * N);
    let projection = layered(&mesh, None);
    let mut scratch = OrderScratch::default();
    projection.find_pairs(&aligned(&predicted), &mut scratch);
    let ends: Vec<u32> = scratch.layers.pairs.ends().flatten().collect();
    assert!(ends.iter().any(|v| v / N as u32 == 2) && ends.iter().all(|&v| v < count));
    let shown = Sheet::new(predicted.len(), Quat::IDENTITY).tick(&projection, &predicted);
    assert_eq!(shown[2 * N..3 * N], shown[N * N..]);
}

#[test]
fn hems_that_are_folded_once_have_no_outside() {
    let mut mesh = sheet(N);
    for p in &mut mesh.vertices {
        let column = p.x / CELL;
        let (half, last) = (N as f32 / 2.0, N as f32 - 1.0);
        if column >= half {
            (p.x, p.z) = (CELL * (last - column), THICK);
        }
    }
    assert!(layered(&mesh, None).layers().is_none());
}

#[test]
fn vertices_without_faces_have_no_layer() {
    let mut mesh = pleated(1.0);
    mesh.vertices
        .extend([Vec3::splat(1e30), Vec3::splat(-1e30), Vec3::new(0.1, 0.1, 0.001)]);
    let projection = layered(&mesh, None);
    let places = projection.layers().unwrap().places();
    assert!(places[N * N..].iter().all(|place| place.side == 0.0));
    assert!(places.iter().filter(|place| place.side != 0.0).count() > N * N / 2);
}

#[test]
fn wild_vertices_push_no_others() {
    let projection = layered(&pleated(1.0), None);
    let mut positions = aligned(&pleated(-0.3).vertices);
    positions[N + 8] = Vec3A::NAN;
    positions[2 * N + 9] = Vec3A::splat(1e30);
    push(&projection, 1.0, &mut positions);
    // Neighbours of the first one have no normal.
    let finite = positions.iter().filter(|p| p.is_finite()).count();
    assert_eq!(finite, N * N - 1);
}

#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_pushes_layers_the_same() {
    let projection = layered(&pleated(1.0), None);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut positions = aligned(&pleated(-0.3).vertices);
            assert!(push(&projection, 1.0, &mut positions) > 1000);
            positions
        })
    };
    let one = on(1);
    assert!([2, 3, 5].iter().all(|&threads| on(threads) == one));
}
