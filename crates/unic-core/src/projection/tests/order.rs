//! Contract of the pushes into the order of the cloth: folds that pass through themselves come apart,
//! and cloth in order, sewn-in folds, fixed vertices and given cloth stay.

use super::{
    super::{
        OrderScratch,
        order::{APART_GAPS, MOST_MISSING_GAPS},
    },
    *,
};
use std::collections::BTreeSet;

/// Number of vertices along a side; such a sheet has coarse levels.
const N: usize = 40;

/// Least distance along the smoothed shape, in edge lengths. Diagonals are longer than cells.
const ORDER: f32 = 0.4;

/// The sheet in waves of ten cells, half as long, whose flanks hang over by `overhang` metres. They pass
/// through each other from 16 mm on: the shape is a trochoid.
fn folded(overhang: f32) -> Vec<Vec3> {
    let fold = |p: &Vec3| {
        let phase = p.x / CELL * std::f32::consts::TAU / 10.0;
        Vec3::new(0.5 * p.x - overhang * phase.sin(), p.y, 0.03 * phase.cos())
    };
    sheet(N).vertices.iter().map(fold).collect()
}

fn ordered(mesh: &TriMesh, mask: Option<&[f32]>) -> StrainProjection {
    let config = ProjectionConfig {
        order: ORDER,
        layers: 0.0,
        ..config()
    };
    inextensible(config, mesh, mask)
}

/// Pushes of one tick alone, without sweeps.
struct Pushed {
    positions: Vec<Vec3A>,
    scratch: OrderScratch,
}

impl Pushed {
    fn new(positions: &[Vec3]) -> Self {
        Self {
            positions: positions.iter().map(|p| Vec3A::from(*p)).collect(),
            scratch: OrderScratch::default(),
        }
    }

    /// Finds pairs and pushes them once. Returns their number.
    fn once(&mut self, projection: &StrainProjection, share: f32) -> usize {
        projection.find_pairs(&self.positions, &mut self.scratch);
        projection.push_pairs(share, &mut self.scratch, &mut self.positions);
        self.pairs().count()
    }

    /// Ends of the pairs that were found.
    fn pairs(&self) -> impl Iterator<Item = [u32; 2]> {
        let OrderScratch { sheet, layers } = &self.scratch;
        sheet.pairs.ends().chain(layers.pairs.ends())
    }
}

/// Number of pairs of vertices of the sheet on a line along x, at least four cells apart, that are in
/// reversed order.
fn reversed(positions: &[Vec3A]) -> usize {
    let pairs = (0..N * N).flat_map(|a| (a + 4..(a / N + 1) * N).map(move |b| (a, b)));
    pairs.filter(|&(a, b)| positions[b].x < positions[a].x).count()
}

#[test]
fn a_fold_that_passes_through_itself_comes_apart() {
    let projection = ordered(&sheet(N), None);
    let mut pushed = Pushed::new(&folded(0.025));
    let before = reversed(&pushed.positions);
    let largest = 0.5 * MOST_MISSING_GAPS * projection.order().unwrap().gap_m();
    for _ in 0..30 {
        let start = pushed.positions.clone();
        pushed.once(&projection, 1.0);
        let moves = start.iter().zip(&pushed.positions).map(|(a, b)| a.distance(*b));
        assert!(moves.fold(0.0, f32::max) <= largest);
    }
    let after = reversed(&pushed.positions);
    assert!(
        before > 100 && after == 0,
        "{before} reversed pairs, then {after}"
    );
    assert!(pushed.positions.iter().all(|p| p.is_finite()));
}

#[test]
fn relaxed_cloth_comes_apart_unless_it_was_given() {
    let projection = ordered(&sheet(N), None);
    let relaxed = |order_share: f32| {
        let mut positions = folded(0.025);
        let mut scratch = ProjectionScratch::default();
        scratch.keep_uncorrected(&positions);
        projection.relax(
            &[ContactPlane::NONE; N * N],
            order_share,
            &mut positions,
            &mut scratch,
        );
        let positions: Vec<Vec3A> = positions.iter().map(|p| Vec3A::from(*p)).collect();
        reversed(&positions)
    };
    let (given, shown) = (relaxed(0.0), relaxed(1.0));
    assert!(
        given > 100 && 4 * shown < given,
        "{given} reversed pairs, {shown} with pushes"
    );
}

#[test]
fn cloth_in_order_stays() {
    let mesh = sheet(N);
    let projection = ordered(&mesh, None);
    for positions in [mesh.vertices.clone(), waved(&mesh, 0.98)] {
        let mut pushed = Pushed::new(&positions);
        let start = pushed.positions.clone();
        pushed.once(&projection, 1.0);
        assert!(pushed.positions == start);
    }
}

#[test]
fn folds_that_are_sewn_in_have_no_order() {
    let mut mesh = sheet(N);
    mesh.vertices = folded(0.025);
    let mut pushed = Pushed::new(&mesh.vertices);
    let start = pushed.positions.clone();
    assert!(reversed(&start) > 100);
    pushed.once(&ordered(&mesh, None), 1.0);
    assert!(pushed.positions == start);
}

#[test]
fn fixed_vertices_and_given_cloth_are_not_pushed() {
    let mesh = sheet(N);
    let mask: Vec<f32> = (0..N * N)
        .map(|i| if i % N < N / 2 { 0.0 } else { 1.0 })
        .collect();
    let mut pushed = Pushed::new(&folded(0.025));
    let start = pushed.positions.clone();
    assert!(pushed.once(&ordered(&mesh, None), 0.0) > 300);
    assert!(pushed.positions == start);
    pushed.once(&ordered(&mesh, Some(&mask)), 1.0);
    let moved: Vec<bool> = start.iter().zip(&pushed.positions).map(|(a, b)| a != b).collect();
    assert!((0..N * N).all(|i| i % N >= N / 2 || !moved[i]));
    assert!(moved.iter().filter(|moved| **moved).count() > 300);
}

#[test]
fn the_search_finds_the_pairs_of_a_comparison_of_all() {
    let projection = ordered(&sheet(N), None);
    let order = projection.order().unwrap();
    // Cells on both sides of the origin.
    let shift = Vec3::new(-3.0, 0.4, 0.7);
    let positions: Vec<Vec3> = folded(0.025).iter().map(|p| *p + shift).collect();
    let mut pushed = Pushed::new(&positions);
    let start = pushed.positions.clone();
    pushed.once(&projection, 0.0);
    let found: Vec<[u32; 2]> = pushed.pairs().map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let distinct: BTreeSet<[u32; 2]> = found.iter().copied().collect();
    assert_eq!(distinct.len(), found.len());
    let mut smoothed = Vec::new();
    let levels = projection.levels().unwrap();
    (order.shape()).smooth(levels, &start, &mut Default::default(), &mut smoothed);
    let gap = order.gap_m();
    let is_pair = |&[a, b]: &[u32; 2]| {
        let (a, b) = (a as usize, b as usize);
        let (between, on_shape) = (start[b] - start[a], smoothed[b] - smoothed[a]);
        let [a, b] = [a, b].map(|v| order.places()[v]);
        let at_rest = b.smoothed - a.smoothed;
        between.length() < order.distances().near_m
            && on_shape.length() > APART_GAPS * gap
            && between.dot(on_shape.normalize()) < order.distances().kept_m
            && (b.position - a.position).dot(at_rest.normalize()) >= gap
    };
    let count = (N * N) as u32;
    let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
    let expected: BTreeSet<[u32; 2]> = all.filter(is_pair).collect();
    // Rounding may decide for a pair at the limit.
    let differing = expected.symmetric_difference(&distinct).count();
    assert!(
        expected.len() > 300 && differing < 5,
        "{} pairs, {differing} differ",
        expected.len()
    );
}

#[test]
fn vertices_at_one_place_are_pushed_once_and_stay_together() {
    let mut mesh = sheet(N);
    // A seam along the third row, whose upper faces have vertices of their own.
    let row: Vec<u32> = (0..N as u32).map(|i| 2 * N as u32 + i).collect();
    let count = mesh.vertices.len() as u32;
    mesh.vertices
        .extend(row.iter().map(|&v| sheet(N).vertices[v as usize]));
    for face in &mut mesh.faces {
        if face.iter().any(|&v| v >= 3 * N as u32) {
            *face = face.map(|v| row.iter().position(|&r| r == v).map_or(v, |i| count + i as u32));
        }
    }
    let mut predicted = folded(0.025);
    predicted.extend_from_within(2 * N..3 * N);
    let projection = ordered(&mesh, None);
    let mut pushed = Pushed::new(&predicted);
    assert!(pushed.once(&projection, 1.0) > 300);
    assert!(pushed.pairs().flatten().all(|v| v < count));
    let shown = Sheet::new(predicted.len(), Quat::IDENTITY).tick(&projection, &predicted);
    for (i, &v) in row.iter().enumerate() {
        assert_eq!(shown[count as usize + i], shown[v as usize]);
    }
}

#[test]
fn small_garments_have_no_order() {
    assert!(ordered(&sheet(9), None).order().is_none());
}

#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_pushes_the_same() {
    let projection = ordered(&sheet(N), None);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut pushed = Pushed::new(&folded(0.025));
            assert!(pushed.once(&projection, 1.0) > 300);
            pushed.positions
        })
    };
    let one = on(1);
    assert!([2, 3, 5].iter().all(|&threads| on(threads) == one));
}

#[test]
fn a_share_of_freedom_is_that_share_of_a_push() {
    let moves = |mask: Option<&[f32]>| {
        let mut pushed = Pushed::new(&folded(0.025));
        let start = pushed.positions.clone();
        pushed.once(&ordered(&sheet(N), mask), 1.0);
        start
            .iter()
            .zip(&pushed.positions)
            .map(|(a, b)| *b - *a)
            .collect::<Vec<_>>()
    };
    let (whole, half) = (moves(None), moves(Some(&[0.5; N * N])));
    let differ = |(a, b): (&Vec3A, &Vec3A)| (*a * 0.5 - *b).length() > 1e-6;
    assert!(!whole.iter().zip(&half).any(differ));
}

#[test]
fn crumpled_cloth_is_compared_with_a_limit_and_wild_vertices_push_no_others() {
    let projection = ordered(&sheet(N), None);
    // Samples stay where they are, so that the smoothed shape is wide; all others are at one place.
    let levels = projection.levels().unwrap();
    let mut crumpled = vec![Vec3::new(0.3, 0.4, 0.0); N * N];
    for &sample in levels.samples() {
        crumpled[sample as usize] = sheet(N).vertices[sample as usize];
    }
    let found = Pushed::new(&crumpled).once(&projection, 1.0);
    // About 700,000 without a limit for each of the four parts.
    assert!((100_000..512 * N * N).contains(&found), "{found} pairs");
    let mut pushed = Pushed::new(&folded(0.025));
    projection.find_pairs(&pushed.positions, &mut pushed.scratch);
    let wild = pushed.pairs().next().unwrap()[0] as usize;
    pushed.positions[wild] = Vec3A::NAN;
    projection.push_pairs(1.0, &mut pushed.scratch, &mut pushed.positions);
    let finite = pushed.positions.iter().filter(|p| p.is_finite()).count();
    assert_eq!(finite, N * N - 1);
    pushed.positions[9] = Vec3A::splat(1e30);
    assert!(pushed.once(&projection, 1.0) > 300);
}

#[test]
fn pushes_share_the_sweeps_between_them() {
    assert_eq!(between_pushes(6), [2, 2, 2]);
    assert_eq!(between_pushes(4), [1, 1, 2]);
    assert_eq!(between_pushes(0), [0; ORDER_PASSES]);
}
