//! Stencils of free edges and of coarse levels.

use super::*;
use stencil::{BendingStencil, level_stencils};

/// Sum of a stencil over moves.
fn sum(stencil: &BendingStencil, moves: impl Fn(usize) -> Vec3) -> Vec3 {
    let terms = stencil.vertices.iter().zip(stencil.coefficients);
    terms.map(|(&v, k)| moves(v as usize) * k).sum()
}

#[test]
fn a_free_edge_loses_its_zigzag_and_keeps_its_waves() {
    const N: usize = 49;
    let mesh = sheet(N);
    let projection = inextensible(config(), &mesh, None);
    // Without hinges and edges the free edges alone are smoothed.
    let faces = &mesh.faces;
    let stencils = bending_stencils(&mesh.vertices, faces, &welded_edges(&mesh), 0.0);
    let stencils = stencils.iter().map(|s| Stencil::new(s, projection.freedom()));
    let constraints = Constraints::new(Vec::new(), stencils.collect(), N * N);
    let sweeps = Sweeps {
        edges: 2,
        smoothed: 2,
    };
    // RMS height of the first row far from its ends, divided by that before the sweeps.
    let left = |wave: fn(usize) -> f32| {
        let at = |v: usize| Vec3A::from(mesh.vertices[v]);
        let rest: Vec<Vec3A> = (0..N * N).map(at).collect();
        let lift = |v: usize| Vec3A::Z * if v < N { 1e-3 * wave(v) } else { 0.0 };
        let mut positions: Vec<Vec3A> = (0..N * N).map(|v| rest[v] + lift(v)).collect();
        constraints.sweep(sweeps, projection.freedom(), &rest, &mut positions);
        let inside = |v: &usize| (1..N - 1).contains(&(v % N)) && (1..N - 1).contains(&(v / N));
        assert!(
            (0..N * N).filter(inside).all(|v| positions[v] == rest[v]),
            "cloth inside"
        );
        let square = |height: &dyn Fn(usize) -> f32| (12..37).map(|v| height(v).powi(2)).sum::<f32>();
        (square(&|v| positions[v].z) / square(&|v| lift(v).z)).sqrt()
    };
    let zigzag = left(|v| [1.0, -1.0][v % 2]);
    // Second differences would take a tenth of it.
    let wave = left(|v| (v as f32 * std::f32::consts::TAU / 8.0).sin());
    assert!(zigzag < 0.2, "{zigzag}");
    assert!(wave > 0.97, "{wave}");
}

/// Stencils along the free edge of a strip, whose lower row has these places.
fn along(lower: &[Vec3]) -> Vec<BendingStencil> {
    let n = lower.len() as u32;
    let upper = lower.iter().map(|p| *p + Vec3::Y);
    let vertices: Vec<Vec3> = lower.iter().copied().chain(upper).collect();
    let faces = (0..n - 1).flat_map(|i| [[i, i + 1, n + i], [i + 1, n + i + 1, n + i]]);
    let mesh = TriMesh::new(vertices, faces.collect()).unwrap();
    let stencils = bending_stencils(&mesh.vertices, &mesh.faces, &welded_edges(&mesh), 0.0);
    let is_lower = |s: &BendingStencil| s.share > 0.0 && s.vertices.iter().all(|v| *v < n);
    stencils.into_iter().filter(is_lower).collect()
}

#[test]
fn third_differences_follow_the_lengths_of_a_free_edge_and_leave_out_corners() {
    let at = [0.0, 0.01, 0.03, 0.035, 0.06, 0.08f32];
    let straight: Vec<Vec3> = at.map(|x| Vec3::new(x, 0.0, 0.0)).to_vec();
    let stencils = along(&straight);
    assert_eq!(stencils.len(), 3);
    for stencil in &stencils {
        let quadratic = |v: usize| Vec3::Z * (1.0 + 20.0 * at[v] + 300.0 * at[v] * at[v]);
        assert!(sum(stencil, quadratic).length() < 1e-4, "{stencil:?}");
        assert!(sum(stencil, |v| Vec3::Z * [1.0, -1.0][v % 2]).length() > 2.0);
    }
    // A corner between the third place and the fourth one.
    let mut corner = straight.clone();
    for place in &mut corner[3..] {
        *place = Vec3::new(0.03, 0.0, place.x - 0.03);
    }
    assert!(along(&corner).len() < 3);
    let mut together = straight;
    together[2] = together[1];
    assert!(along(&together).is_empty(), "an edge without length");
}

#[test]
fn holes_of_three_edges_and_branches_have_no_third_differences() {
    // Two tetrahedra without their base, joined at the apex; the bases are holes of three edges.
    let corner = |i: usize, y: f32| {
        let angle = i as f32 * 2.1;
        Vec3::new(angle.cos(), y, angle.sin())
    };
    let mut vertices = vec![Vec3::ZERO];
    vertices.extend((0..6).map(|i| corner(i, if i < 3 { 1.0 } else { -1.0 })));
    let faces = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]];
    let mesh = TriMesh::new(vertices, faces).unwrap();
    let of = |mesh: &TriMesh| bending_stencils(&mesh.vertices, &mesh.faces, &welded_edges(mesh), 0.0);
    assert!(of(&mesh).iter().all(|stencil| stencil.share == 0.0));
    // Two triangles that touch in a point, where the free edge branches.
    let touching = [[-1.0, 1.0], [-1.0, -1.0], [0.0, 0.0], [1.0, 1.0], [1.0, -1.0]];
    let vertices = touching.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
    let mesh = TriMesh::new(vertices, vec![[0, 1, 2], [2, 4, 3]]).unwrap();
    assert!(of(&mesh).is_empty());
}

#[test]
fn stencils_of_a_flat_level_are_zero_for_linear_moves() {
    let jitter = |i: usize| 0.3 * ((i * 7 % 13) as f32 / 13.0 - 0.5);
    let place = |i: usize| {
        Vec3::new(
            (i % 9) as f32 + jitter(i),
            (i / 9) as f32 + jitter(3 * i + 1),
            0.5,
        )
    };
    let places: Vec<Vec3> = (0..81).map(place).collect();
    let near = |&[a, b]: &[u32; 2]| places[a as usize].distance(places[b as usize]) < 2.1;
    let pairs = (0..81).flat_map(|b| (0..b).map(move |a| [a, b]));
    let chords: Vec<[u32; 2]> = pairs.filter(near).collect();
    let stencils = level_stencils(&places, &chords);
    assert_eq!(stencils.len(), 81);
    for stencil in &stencils {
        let linear = |v: usize| Vec3::new(2.0 * places[v].y - places[v].x, places[v].x, 1.0);
        assert!(sum(stencil, linear).length() < 1e-4, "{stencil:?}");
        let one = |v: usize| {
            if v as u32 == stencil.vertices[0] {
                Vec3::Z
            } else {
                Vec3::ZERO
            }
        };
        assert_eq!(sum(stencil, one), Vec3::Z);
    }
    for broken in [f32::NAN, 1e30] {
        let mut places = places.clone();
        places[40].x = broken;
        let stencils = level_stencils(&places, &chords);
        let coefficients = stencils.iter().flat_map(|s| s.coefficients);
        assert!(coefficients.into_iter().all(f32::is_finite), "{broken}");
    }
    assert!(
        level_stencils(&[Vec3::ONE; 81], &chords).is_empty(),
        "all at one place"
    );
}

#[test]
fn stencils_of_a_curved_level_join_samples_to_others_around_them() {
    // Half a tube of 7.5 cm radius.
    let place = |i: usize| {
        let angle = (i % 20) as f32 * 0.2;
        Vec3::new(0.075 * angle.cos(), (i / 20) as f32 * 0.015, 0.075 * angle.sin())
    };
    let places: Vec<Vec3> = (0..200).map(place).collect();
    let near = |&[a, b]: &[u32; 2]| places[a as usize].distance(places[b as usize]) < 0.032;
    let pairs = (0..200).flat_map(|b| (0..b).map(move |a| [a, b]));
    let chords: Vec<[u32; 2]> = pairs.filter(near).collect();
    let stencils = level_stencils(&places, &chords);
    assert_eq!(stencils.len(), 200, "one for each sample");
    for stencil in &stencils {
        assert!(sum(stencil, |_| Vec3::X).length() < 1e-5);
        // A curved level has no plane through four samples: a sagitta of 1.5 mm is left.
        assert!(sum(stencil, |v| places[v]).length() < 1.6e-3, "{stencil:?}");
        let reach: f32 = stencil.coefficients[1..].iter().map(|k| k.abs()).sum();
        // A sample inside or at a free edge lies between others; a corner continues their line.
        assert!(reach < 3.01, "{stencil:?}");
    }
    let between = stencils
        .iter()
        .filter(|s| s.coefficients[1..].iter().all(|k| *k < 0.01));
    assert_eq!(between.count(), 196, "all but the corners");
    let alone = level_stencils(&places[..3], &[[0, 1], [1, 2]]);
    assert!(alone.is_empty(), "fewer than three others");
}

/// Sheet of 60 × 60 vertices between two fixed ends that are nearer than at rest, after its coarse
/// levels: the RMS of the stencils' sums over the moves of the finest level, and the mean length of
/// its chords by that at rest.
fn levels_of_a_shortened_sheet(bending_sweeps: usize) -> [f32; 2] {
    let mesh = sheet(60);
    let config = ProjectionConfig {
        bending_sweeps,
        ..config()
    };
    let is_end = |v: usize| [0, 59].contains(&(v % 60));
    let mask: Vec<f32> = (0..3600).map(|v| if is_end(v) { 0.0 } else { 1.0 }).collect();
    let projection = inextensible(config, &mesh, Some(&mask));
    let levels = projection.levels().unwrap();
    let predicted: Vec<Vec3A> = waved(&mesh, 0.8).into_iter().map(Vec3A::from).collect();
    let mut positions = predicted.clone();
    let mut scratch = LevelScratch::default();
    levels.solve(1, projection.freedom(), &mut scratch, &mut positions);
    let vertex = |sample: u32| levels.samples()[sample as usize] as usize;
    let finest = levels.levels().last().unwrap();
    let stencils: Vec<&Stencil> = finest.stencil_colours().flatten().collect();
    let squares = stencils.iter().map(|stencil| {
        let terms = stencil.vertices.iter().zip(stencil.coefficients());
        let moved = |sample: u32| positions[vertex(sample)] - predicted[vertex(sample)];
        terms.map(|(&s, k)| moved(s) * k).sum::<Vec3A>().length_squared()
    });
    let crumples = (squares.sum::<f32>() / stencils.len() as f32).sqrt();
    let chords: Vec<&Edge> = finest.chord_colours().flatten().collect();
    let length = |chord: &&Edge| {
        let [a, b] = chord.ends.map(|end| positions[vertex(end)]);
        a.distance(b) / chord.limit.shortest
    };
    [
        crumples,
        chords.iter().map(length).sum::<f32>() / chords.len() as f32,
    ]
}

#[test]
fn smoothed_levels_lengthen_without_crumples() {
    let [crumpled, crumpled_length] = levels_of_a_shortened_sheet(0);
    let [smooth, smooth_length] = levels_of_a_shortened_sheet(1);
    assert!(
        smooth < 0.7 * crumpled,
        "{smooth} and {crumpled} m, {smooth_length} {crumpled_length}"
    );
    assert!(smooth_length > 0.97, "{smooth_length} and {crumpled_length}");
}
