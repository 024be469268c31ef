//! Closed forms and invariances of the strain projection on a flat sheet.

mod layers;
mod order;
mod smoothing;

use super::*;
use crate::{features::PointFrame, subdivide::subdivided, surface_map::SurfaceMap};
use glam::Quat;

/// Edge length of a cell, metres.
const CELL: f32 = 0.02;

/// Flat sheet of n × n vertices in the plane z = 0.
fn sheet(n: usize) -> TriMesh {
    let vertices = (0..n * n).map(|i| CELL * Vec3::new((i % n) as f32, (i / n) as f32, 0.0));
    let cell = |i: usize| {
        let corner = [i, i + 1, i + n, i + n + 1].map(|v| v as u32);
        let [a, b, c, d] = corner;
        [[a, b, d], [a, d, c]]
    };
    let cells = (0..n * n).filter(|i| i % n < n - 1 && i / n < n - 1);
    TriMesh::new(vertices.collect(), cells.flat_map(cell).collect()).unwrap()
}

/// Lengths of all edges of a shape.
fn lengths(mesh: &TriMesh, positions: &[Vec3]) -> Vec<f32> {
    let length = |[a, b]: [u32; 2]| positions[a as usize].distance(positions[b as usize]);
    welded_edges(mesh).into_iter().map(length).collect()
}

/// Projection that keeps the rest lengths.
fn inextensible(config: ProjectionConfig, mesh: &TriMesh, mask: Option<&[f32]>) -> StrainProjection {
    let limit = |[a, b]: [u32; 2]| {
        let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
        StrainLimit {
            shortest: length,
            longest: length,
        }
    };
    let limits = limited_pairs(&config, mesh).into_iter().map(limit).collect();
    StrainProjection::new(config, mesh, mask, limits).unwrap()
}

/// A garment of which every vertex has the same rotated frame.
struct Sheet {
    points: Vec<PointHistory>,
    offsets: Vec<VertexState>,
    scratch: ProjectionScratch,
    memory: Memory,
    dt: f32,
}

impl Sheet {
    fn new(vertices: usize, rotation: Quat) -> Self {
        let frame = PointFrame {
            rotation,
            ..PointFrame::default()
        };
        let mut history = PointHistory::default();
        history.advance(frame);
        history.advance(frame);
        Self {
            points: vec![history; vertices],
            offsets: vec![VertexState::default(); vertices],
            scratch: ProjectionScratch::default(),
            memory: Memory::None,
            dt: 1.0 / 30.0,
        }
    }

    /// Shows the sheet for predicted positions.
    fn tick(&mut self, projection: &StrainProjection, predicted: &[Vec3]) -> Vec<Vec3> {
        let tick = ProjectionTick {
            dt: self.dt,
            origin: predicted[0],
            memory: self.memory,
        };
        projection.advance(
            tick,
            &self.points,
            predicted,
            &mut self.offsets,
            &mut self.scratch,
        );
        self.memory = Memory::Previous;
        let shown = predicted.iter().zip(&self.offsets).zip(&self.points);
        shown
            .map(|((p, offset), point)| *p + point.now.rotation * offset.value)
            .collect()
    }
}

/// Largest relative difference of edge lengths from those at rest.
fn strain(mesh: &TriMesh, positions: &[Vec3]) -> f32 {
    let pairs = lengths(mesh, positions)
        .into_iter()
        .zip(lengths(mesh, &mesh.vertices));
    pairs
        .map(|(length, rest)| (length / rest - 1.0).abs())
        .fold(0.0, f32::max)
}

/// A sheet that is `scale` times as long in x, with waves of a millimetre.
fn waved(mesh: &TriMesh, scale: f32) -> Vec<Vec3> {
    let wave = |p: &Vec3| Vec3::new(scale * p.x, p.y, 1e-3 * (40.0 * p.x + 90.0 * p.y).sin());
    mesh.vertices.iter().map(wave).collect()
}

fn config() -> ProjectionConfig {
    ProjectionConfig {
        // No pull back, so that ticks add up.
        pull_s: 1e6,
        bending: 0.2,
        ..ProjectionConfig::default()
    }
}

#[test]
fn lengths_within_their_limits_leave_the_prediction_as_it_is() {
    let mesh = sheet(9);
    let limit = |length| StrainLimit {
        shortest: 0.9 * length,
        longest: 1.1 * length,
    };
    let limits = lengths(&mesh, &mesh.vertices).into_iter().map(limit).collect();
    let projection = StrainProjection::new(config(), &mesh, None, limits).unwrap();
    let mut sheet = Sheet::new(81, Quat::from_rotation_y(0.7));
    for _ in 0..3 {
        sheet.tick(&projection, &waved(&mesh, 1.04));
        assert!(sheet.offsets.iter().all(|offset| offset.value == Vec3::ZERO));
    }
}

#[test]
fn a_stretched_sheet_gets_its_lengths_back() {
    let mesh = sheet(9);
    let projection = inextensible(config(), &mesh, None);
    let mut sheet = Sheet::new(81, Quat::from_rotation_x(1.1));
    let predicted = waved(&mesh, 1.1);
    let shown = (0..60)
        .map(|_| sheet.tick(&projection, &predicted))
        .last()
        .unwrap();
    assert!(strain(&mesh, &predicted) > 0.09);
    assert!(strain(&mesh, &shown) < 0.01, "{}", strain(&mesh, &shown));
}

#[test]
fn a_shortened_sheet_between_fixed_ends_buckles() {
    let mesh = sheet(9);
    // Both ends stay at the prediction.
    let mask: Vec<f32> = (0..81)
        .map(|v| if v % 9 == 0 || v % 9 == 8 { 0.0 } else { 1.0 })
        .collect();
    // Bending resists, and leaves the edges shorter.
    let config = ProjectionConfig {
        bending_sweeps: 2,
        ..config()
    };
    let projection = inextensible(config, &mesh, Some(&mask));
    let mut sheet = Sheet::new(81, Quat::IDENTITY);
    let predicted = waved(&mesh, 0.9);
    let shown = (0..60)
        .map(|_| sheet.tick(&projection, &predicted))
        .last()
        .unwrap();
    // The rows at the edges between two fixed ends are the stiffest.
    assert!(strain(&mesh, &shown) < 0.08, "{}", strain(&mesh, &shown));
    let depth = |positions: &[Vec3]| positions.iter().map(|p| p.z.abs()).fold(0.0, f32::max);
    assert!(depth(&shown) > 5.0 * depth(&predicted), "{}", depth(&shown));
}

/// Sweeps over the edges alone reach few rows, and the rows near the fixed one crumple.
#[test]
fn coarse_levels_let_the_free_end_of_a_shortened_sheet_go() {
    let mesh = sheet(60);
    let mask: Vec<f32> = (0..3600).map(|v| if v % 60 == 0 { 0.0 } else { 1.0 }).collect();
    let reach = |coarse_sweeps: usize| {
        let config = ProjectionConfig {
            coarse_sweeps,
            radius_m: 1.0,
            ..config()
        };
        let projection = inextensible(config, &mesh, Some(&mask));
        let mut sheet = Sheet::new(3600, Quat::from_rotation_y(0.4));
        // Flat, so that it cannot buckle.
        let predicted: Vec<Vec3> = (mesh.vertices.iter())
            .map(|p| Vec3::new(0.8 * p.x, p.y, 0.0))
            .collect();
        let shown = sheet.tick(&projection, &predicted);
        let free = shown.iter().skip(59).step_by(60).map(|p| p.x);
        free.sum::<f32>() / (60.0 * 59.0 * CELL)
    };
    let (with, without) = (reach(4), reach(0));
    assert!(
        with > 0.91 && without < 0.83,
        "{with} and {without} of the length"
    );
}

#[test]
fn levels_are_nested_and_their_chords_join_neighbours() {
    let mesh = sheet(60);
    let config = config();
    let projection = inextensible(config, &mesh, None);
    let levels = projection.levels().unwrap();
    let counts: Vec<usize> = levels.levels().iter().map(Level::samples).collect();
    assert_eq!(counts, [56, 225]);
    assert_eq!(levels.samples().len(), 225);
    let pairs = limited_pairs(&config, &mesh);
    assert_eq!(projection.limits().len(), pairs.len());
    let mut chords = 0;
    for (level, most) in levels.levels().iter().zip([20.0, 10.0]) {
        let mut near = vec![0; level.samples()];
        for colour in level.chord_colours() {
            let mut ends: Vec<u32> = colour.iter().flat_map(|chord| chord.ends).collect();
            ends.iter().for_each(|&end| near[end as usize] += 1);
            ends.sort_unstable();
            assert!(ends.windows(2).all(|pair| pair[0] < pair[1]), "a shared sample");
            for chord in colour {
                assert!(chord.limit.longest < 3.0 * most * CELL, "{chord:?}");
            }
            chords += colour.len();
        }
        assert!(near.iter().all(|count| (5..=40).contains(count)), "{near:?}");
    }
    assert_eq!(welded_edges(&mesh).len() + chords, pairs.len());
    // The samples of the finest level, and every vertex.
    let rows: Vec<usize> = levels.levels().iter().map(|l| l.rows().len()).collect();
    assert_eq!(rows, [225 - 56, 3600]);
    let small = inextensible(config, &sheet(20), None);
    assert!(small.levels().unwrap().levels().is_empty());
}

#[test]
fn chords_without_a_least_length_are_left_out() {
    let mesh = sheet(40);
    let edges = welded_edges(&mesh).len();
    let mut limits = inextensible(config(), &mesh, None).limits().to_vec();
    // The chords are far too long for their greatest lengths.
    for (i, limit) in limits[edges..].iter_mut().enumerate() {
        limit.longest *= 0.5;
        limit.shortest = if i == 3 { limit.longest } else { 0.0 };
    }
    let projection = StrainProjection::new(config(), &mesh, None, limits.clone()).unwrap();
    assert_eq!(projection.limits(), limits);
    let levels = projection.levels().unwrap().levels().iter();
    let chords = levels.flat_map(Level::chord_colours).map(<[Edge]>::len);
    assert_eq!(chords.sum::<usize>(), 1);
}

#[test]
fn another_number_of_limits_is_refused() {
    let mesh = sheet(30);
    let edges = welded_edges(&mesh).len();
    let all = limited_pairs(&config(), &mesh).len();
    assert!(all > edges + 50);
    let limit = StrainLimit {
        shortest: 0.0,
        longest: 1.0,
    };
    for found in [0, edges - 1, edges, all - 1, all + 1] {
        let refused = StrainProjection::new(config(), &mesh, None, vec![limit; found]);
        assert_eq!(refused.unwrap_err(), LimitCountError { expected: all, found });
    }
    assert!(StrainProjection::new(config(), &mesh, None, vec![limit; all]).is_ok());
}

/// A fixed column stays at the prediction, and copies of a seam's vertices at the first ones, though
/// they are half a weld's distance away.
#[test]
fn coarse_levels_keep_fixed_vertices_and_seams() {
    let mut mesh = sheet(40);
    let moved = mesh.vertices.len() as u32;
    // The faces right of the middle get corners of their own along it.
    for face in &mut mesh.faces {
        let is_right = face.iter().any(|v| v % 40 == 21);
        for v in face.iter_mut().filter(|v| is_right && **v % 40 == 20) {
            *v = moved + *v / 40;
        }
    }
    let copies = (0..40).map(|row| mesh.vertices[40 * row + 20] + Vec3::X * 5e-7);
    mesh.vertices.extend(copies.collect::<Vec<_>>());
    let mask: Vec<f32> = (0..1640)
        .map(|v| if v < 1600 && v % 40 == 0 { 0.0 } else { 1.0 })
        .collect();
    let projection = inextensible(config(), &mesh, Some(&mask));
    let levels = projection.levels().unwrap();
    assert!(!levels.levels().is_empty() && levels.samples().iter().all(|v| *v < 1600));
    let mut sheet = Sheet::new(1640, Quat::IDENTITY);
    let predicted = waved(&mesh, 0.9);
    let shown = sheet.tick(&projection, &predicted);
    for row in 0..40 {
        assert!(shown[40 * row].distance(predicted[40 * row]) < 1e-7);
        assert!(
            shown[1600 + row].distance(shown[40 * row + 20]) < 2e-6,
            "row {row}"
        );
    }
}

#[test]
fn the_same_mesh_keeps_every_limit() {
    let mesh = sheet(40);
    let pairs = limited_pairs(&config(), &mesh);
    let limit = |i: usize| StrainLimit {
        shortest: 0.01 + 1e-5 * (i % 7) as f32,
        longest: 0.02 + 1e-5 * (i % 5) as f32,
    };
    let limits: Vec<StrainLimit> = (0..pairs.len()).map(limit).collect();
    let projection = StrainProjection::new(config(), &mesh, None, limits.clone()).unwrap();
    let map = SurfaceMap::new(&mesh, &mesh.vertices).unwrap();
    assert_eq!(projection.limits_on_mesh(&mesh, &mesh, &map).unwrap(), limits);
}

#[test]
fn chord_limits_move_to_another_mesh_as_strains() {
    let mesh = sheet(40);
    let config = config();
    let limit = |[a, b]: [u32; 2]| {
        let length = mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
        StrainLimit {
            shortest: 0.7 * length,
            longest: 1.2 * length,
        }
    };
    let limits = limited_pairs(&config, &mesh).into_iter().map(limit).collect();
    let projection = StrainProjection::new(config, &mesh, None, limits).unwrap();
    let fine = subdivided(&mesh).mesh;
    let map = SurfaceMap::new(&mesh, &fine.vertices).unwrap();
    let limits = projection.limits_on_mesh(&mesh, &fine, &map).unwrap();
    let pairs = limited_pairs(&config, &fine);
    assert_eq!(limits.len(), pairs.len());
    assert!(pairs.len() > welded_edges(&fine).len() + 100);
    for (limit, [a, b]) in limits.iter().zip(pairs) {
        let length = fine.vertices[a as usize].distance(fine.vertices[b as usize]);
        assert!((limit.shortest / length - 0.7).abs() < 1e-3, "{limit:?} {length}");
        assert!((limit.longest / length - 1.2).abs() < 1e-3, "{limit:?} {length}");
    }
}

#[test]
fn offsets_stay_within_the_radius_and_masked_vertices_at_the_prediction() {
    let mesh = sheet(9);
    let mask: Vec<f32> = (0..81).map(|v| if v % 9 == 0 { 0.0 } else { 1.0 }).collect();
    let small = ProjectionConfig {
        radius_m: 0.004,
        ..config()
    };
    let projection = inextensible(small, &mesh, Some(&mask));
    let mut sheet = Sheet::new(81, Quat::from_rotation_z(0.3));
    for _ in 0..20 {
        sheet.tick(&projection, &waved(&mesh, 1.5));
        let longest = sheet.offsets.iter().map(|o| o.value.length()).fold(0.0, f32::max);
        assert!((0.0039..0.00401).contains(&longest), "{longest}");
        assert!((0..81).step_by(9).all(|v| sheet.offsets[v].value.length() < 1e-7));
    }
}

#[test]
fn a_still_sheet_comes_to_rest() {
    let mesh = sheet(9);
    let projection = inextensible(ProjectionConfig::default(), &mesh, None);
    let mut sheet = Sheet::new(81, Quat::IDENTITY);
    let predicted = waved(&mesh, 0.93);
    let mut shown: Vec<Vec<Vec3>> = (0..300).map(|_| sheet.tick(&projection, &predicted)).collect();
    let (last, before) = (shown.pop().unwrap(), shown.pop().unwrap());
    let moved = last
        .iter()
        .zip(&before)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max);
    // A tenth of a millimetre in a second.
    assert!(moved < 1e-4 / 30.0, "{moved} m");
}

#[test]
fn the_rate_of_ticks_changes_the_shape_little() {
    let mesh = sheet(9);
    let projection = inextensible(ProjectionConfig::default(), &mesh, None);
    let after_a_second = |fps: f32| {
        let mut sheet = Sheet::new(81, Quat::IDENTITY);
        sheet.dt = 1.0 / fps;
        let predicted = waved(&mesh, 0.93);
        (0..fps as usize)
            .map(|_| sheet.tick(&projection, &predicted))
            .last()
            .unwrap()
    };
    let [slow, fast] = [30.0, 60.0].map(after_a_second);
    let moved: f32 = slow
        .iter()
        .zip(&waved(&mesh, 0.93))
        .map(|(a, b)| a.distance(*b))
        .sum();
    let apart: f32 = slow.iter().zip(&fast).map(|(a, b)| a.distance(*b)).sum();
    assert!(apart < 0.3 * moved, "{apart} of {moved}");
}

#[test]
fn vertices_at_one_place_stay_together() {
    let mut mesh = sheet(5);
    // The last face gets corners of its own.
    let last = mesh.faces.len() - 1;
    for corner in 0..3 {
        let place = mesh.vertices[mesh.faces[last][corner] as usize];
        mesh.faces[last][corner] = mesh.vertices.len() as u32;
        mesh.vertices.push(place);
    }
    let projection = inextensible(config(), &mesh, None);
    let mut sheet = Sheet::new(mesh.vertices.len(), Quat::IDENTITY);
    let shown = sheet.tick(&projection, &waved(&mesh, 0.9));
    for (vertex, &first) in projection.first_at_place().iter().enumerate() {
        assert!(shown[vertex].distance(shown[first as usize]) < 1e-7, "{vertex}");
    }
    assert!(projection.first_at_place()[25..].iter().all(|&first| first < 25));
}

#[test]
fn constraints_of_a_colour_share_no_vertex() {
    let mesh = sheet(9);
    let projection = inextensible(config(), &mesh, None);
    let mut count = 0;
    for colour in projection.edge_colours() {
        count += colour.len();
        assert_distinct(colour.iter().flat_map(|edge| edge.ends));
    }
    assert_eq!(count, welded_edges(&mesh).len());
    for colour in projection.stencil_colours() {
        assert_distinct(colour.iter().flat_map(|stencil| stencil.vertices));
    }
    let projection = inextensible(ProjectionConfig::default(), &sheet(90), None);
    for level in projection.levels().unwrap().levels() {
        for colour in level.chord_colours() {
            assert_distinct(colour.iter().flat_map(|chord| chord.ends));
        }
        for colour in level.stencil_colours() {
            assert_distinct(colour.iter().flat_map(|stencil| stencil.vertices));
        }
    }
}

fn assert_distinct(vertices: impl Iterator<Item = u32>) {
    let mut vertices: Vec<u32> = vertices.collect();
    vertices.sort_unstable();
    let all = vertices.len();
    vertices.dedup();
    assert_eq!(vertices.len(), all);
}

#[test]
fn a_mask_of_ones_is_no_mask() {
    let mesh = sheet(9);
    let of = |mask: Option<&[f32]>| inextensible(config(), &mesh, mask).freedom().clone();
    assert_eq!(of(Some(&[1.0; 81])), of(None));
    assert_ne!(of(Some(&[0.5; 81])), of(None));
}

/// Large enough that a colour is swept in several parts.
#[cfg(feature = "rayon")]
#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let mesh = sheet(90);
    let mask: Vec<f32> = (0..90 * 90).map(|v| [0.0, 1.0, 0.5][v % 3]).collect();
    for mask in [None, Some(&mask[..])] {
        let projection = inextensible(ProjectionConfig::default(), &mesh, mask);
        assert!(projection.edge_colours().any(|colour| colour.len() > 2048));
        assert!(!projection.levels().unwrap().levels().is_empty());
        assert_same_on_any_threads(&mesh, &projection);
    }
}

#[cfg(feature = "rayon")]
fn assert_same_on_any_threads(mesh: &TriMesh, projection: &StrainProjection) {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut sheet = Sheet::new(mesh.vertices.len(), Quat::from_rotation_x(0.2));
            let shown = (0..4).map(|i| sheet.tick(projection, &waved(mesh, 0.9 + 0.01 * i as f32)));
            shown.last().unwrap()
        })
    };
    let one = on(1);
    for threads in [2, 3, 5] {
        assert!(on(threads) == one, "{threads} threads");
    }
}

#[test]
fn limits_on_the_same_mesh_are_those_of_the_garment_and_scale_with_a_finer_one() {
    let mesh = sheet(9);
    let projection = inextensible(config(), &mesh, None);
    let fine = subdivided(&mesh).mesh;
    let map = SurfaceMap::new(&mesh, &fine.vertices).unwrap();
    let limits = projection.limits_on_mesh(&mesh, &fine, &map).unwrap();
    let rest = lengths(&fine, &fine.vertices);
    assert_eq!(limits.len(), rest.len());
    for (limit, length) in limits.iter().zip(rest) {
        assert!((limit.shortest / length - 1.0).abs() < 1e-4, "{limit:?} {length}");
        assert!((limit.longest / length - 1.0).abs() < 1e-4, "{limit:?} {length}");
    }
}

/// Returns how far each vertex of a waved sheet moves when a correction pushes the middle one up by
/// `height`, metres. Edges keep the lengths that they have before the push.
fn moves_after_a_push(mesh: &TriMesh, config: ProjectionConfig, mask: &[f32], height: f32) -> Vec<Vec3> {
    let before = waved(mesh, 1.0);
    let limit = |[a, b]: [u32; 2]| {
        let length = before[a as usize].distance(before[b as usize]);
        StrainLimit {
            shortest: length,
            longest: length,
        }
    };
    let limits = limited_pairs(&config, mesh).into_iter().map(limit).collect();
    let projection = StrainProjection::new(config, mesh, Some(mask), limits).unwrap();
    let middle = mesh.vertices.len() / 2;
    let mut positions = before.clone();
    positions[middle].z += height;
    let mut planes = vec![ContactPlane::NONE; positions.len()];
    planes[middle] = ContactPlane {
        normal: Vec3::Z,
        height: positions[middle].z,
    };
    let mut scratch = ProjectionScratch::default();
    scratch.keep_uncorrected(&before);
    projection.relax(&planes, 1.0, &mut positions, &mut scratch);
    positions.iter().zip(before).map(|(p, q)| *p - q).collect()
}

#[test]
fn hinges_spread_a_push_more_than_edges_alone() {
    let mesh = sheet(9);
    let free = vec![1.0; mesh.vertices.len()];
    let height = 4e-3;
    let middle = mesh.vertices.len() / 2;
    let neighbours = [middle - 1, middle + 1, middle - 9, middle + 9];
    let share = |moves: &[Vec3], vertex: usize| moves[vertex].z / height;
    let moves = moves_after_a_push(&mesh, config(), &free, height);
    assert!(share(&moves, middle) > 0.999);
    for v in neighbours {
        assert!((0.18..0.9).contains(&share(&moves, v)), "{}", moves[v]);
    }
    let without = ProjectionConfig {
        bending_sweeps: 0,
        ..config()
    };
    let by_edges = moves_after_a_push(&mesh, without, &free, height);
    assert!(share(&by_edges, middle) > 0.999);
    assert!(
        by_edges.iter().any(|by| by.length() > 1e-5),
        "edges regain lengths"
    );
    for v in neighbours {
        assert!(share(&by_edges, v) < 0.1, "{}", by_edges[v]);
    }
    let mut mask = free.clone();
    mask[middle + 1] = 0.0;
    let held = moves_after_a_push(&mesh, config(), &mask, height);
    assert_eq!(held[middle + 1], Vec3::ZERO);
    // Without a push nothing moves, whatever the waves.
    let still = moves_after_a_push(&mesh, config(), &free, 0.0);
    assert!(still.iter().all(|by| by.length() < 1e-7));
}

#[test]
fn edges_that_hinges_shorten_regain_their_lengths() {
    let mesh = sheet(9);
    let projection = inextensible(config(), &mesh, None);
    let mut scratch = ProjectionScratch::default();
    scratch.keep_uncorrected(&mesh.vertices);
    // Folded along its middle column by 60 degrees. All lengths are right. The strain is 0.044 where
    // hinges come last.
    let fold = Vec3::X * 4.0 * CELL;
    let turn = Quat::from_rotation_y(60f32.to_radians());
    let folded = |p: &Vec3| {
        if p.x > fold.x {
            fold + turn * (*p - fold)
        } else {
            *p
        }
    };
    let mut positions: Vec<Vec3> = mesh.vertices.iter().map(folded).collect();
    projection.relax(&[ContactPlane::NONE; 81], 1.0, &mut positions, &mut scratch);
    let strain = strain(&mesh, &positions);
    assert!(strain < 0.025, "{strain}");
}
