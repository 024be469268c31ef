//! Contract of the geometry on a real body and a real T-shirt: signs of distances agree with
//! winding numbers, and diffused weights are smooth on a garment that is not a grid. An ignored
//! test prints the times of the queries.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use glam::{DVec3, Vec3};
use std::{f64::consts::PI, hint::black_box, path::Path, time::Instant};
use unic_core::{
    closest::ClosestVertex,
    intersection::BodySnapshot,
    mesh::TriMesh,
    skinning::SkinningWeights,
    subdivide::{Subdivided, subdivided},
    surface::{Surface, SurfacePoint},
    topology::{components, edges},
    weights::{DIFFUSION_LENGTH_M, diffused_weights, transferred_weights},
};

/// Vertices and triangles of an OBJ file without polygons; none when the data are not there.
fn mesh(path: &str) -> Option<TriMesh> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data")
        .join(path);
    let Ok(text) = std::fs::read_to_string(&file) else {
        eprintln!("skipped: {} is not there", file.display());
        return None;
    };
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let index = |w: &str| w.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
        match words.first() {
            Some(&"v") => vertices.push(Vec3::from([1, 2, 3].map(|i| words[i].parse().unwrap()))),
            Some(&"f") => faces.push([1, 2, 3].map(|i| index(words[i]))),
            _ => {}
        }
    }
    Some(TriMesh::new(vertices, faces).unwrap())
}

fn body() -> Option<TriMesh> {
    mesh("interop/body_rest.obj")
}

fn shirt() -> Option<TriMesh> {
    mesh("captures/tshirt_blender/garment.obj")
}

fn winding_number(mesh: &TriMesh, p: Vec3) -> f64 {
    let solid_angle = |face: &[u32; 3]| {
        let [a, b, c]: [DVec3; 3] = face.map(|v| (mesh.vertices[v as usize] - p).as_dvec3());
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    mesh.faces.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}

#[test]
fn the_side_of_every_shirt_vertex_agrees_with_its_winding_number() {
    let (Some(body), Some(shirt)) = (body(), shirt()) else {
        return;
    };
    let surface = Surface::build(&body);
    let (mut inside, mut wrong) = (0, 0);
    for &p in &shirt.vertices {
        let hit = surface.closest(p).unwrap();
        let winding = winding_number(&body, p);
        inside += usize::from(hit.signed_distance < 0.0);
        // Winding numbers other than 0 and 1 are in folds, where the body overlaps itself.
        let sound = (winding - winding.round()).abs() < 0.01 && (-0.5..1.5).contains(&winding);
        wrong += usize::from(sound && (winding > 0.5) != (hit.signed_distance < 0.0));
    }
    let share = inside as f64 / shirt.vertices.len() as f64;
    assert!(
        (0.06..0.09).contains(&share),
        "its rest shape cuts into the body: {share}"
    );
    assert!(wrong == 0, "{wrong} vertices on the wrong side");
}

/// Weights on one joint for each half, left and right, with a jump in the middle of the garment.
fn halves(mesh: &TriMesh) -> SkinningWeights {
    let rows = mesh
        .vertices
        .iter()
        .map(|v| [(usize::from(v.x > 0.0), 1.0)].into_iter());
    SkinningWeights::from_rows(3, rows).unwrap()
}

#[test]
fn diffusion_turns_a_jump_into_a_slope() {
    let Some(shirt) = shirt() else { return };
    assert_eq!(components(shirt.vertices.len(), &shirt.faces).count, 1);
    let smooth = diffused_weights(&halves(&shirt), &shirt, DIFFUSION_LENGTH_M).unwrap();
    let dense = smooth.to_dense();
    for [a, b] in edges(&shirt.faces) {
        let (a, b) = (a as usize, b as usize);
        let apart = shirt.vertices[a].distance(shirt.vertices[b]);
        // The slope of e^(−x / l) / 2 is at most 1 / (2 l); the tolerance for the mesh is half of
        // that.
        let steepest = 0.75 / DIFFUSION_LENGTH_M * apart;
        assert!(
            (dense[3 * a] - dense[3 * b]).abs() <= steepest,
            "edge {a}-{b} of {apart} m"
        );
    }
    assert!(
        dense
            .chunks(3)
            .all(|row| row[2] == 0.0 && (row[0] + row[1] - 1.0).abs() < 1e-6)
    );
    let far = (0..shirt.vertices.len()).filter(|&v| shirt.vertices[v].x > 5.0 * DIFFUSION_LENGTH_M);
    assert!(far.map(|v| dense[3 * v + 1]).all(|w| w > 0.99));
}

#[test]
fn weights_transfer_to_a_finer_shirt() {
    let Some(shirt) = shirt() else { return };
    let smooth = diffused_weights(&halves(&shirt), &shirt, DIFFUSION_LENGTH_M).unwrap();
    let Subdivided { mesh: finer, parents } = subdivided(&shirt);
    let carried = transferred_weights(&shirt, &smooth, &finer.vertices)
        .unwrap()
        .to_dense();
    let dense = smooth.to_dense();
    for (row, [a, b]) in carried.chunks(3).zip(parents) {
        for joint in 0..3 {
            let mean = 0.5 * (dense[3 * a as usize + joint] + dense[3 * b as usize + joint]);
            assert!((row[joint] - mean).abs() < 1e-4);
        }
    }
}

/// Shortest time of 100 runs, microseconds.
fn microseconds(mut work: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e6
    };
    (0..100).map(once).fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "prints the times of queries: run with --ignored --nocapture"]
fn query_times() {
    let (Some(body), Some(shirt)) = (body(), shirt()) else {
        return;
    };
    let mut tree = ClosestVertex::build(&body.vertices);
    let mut surface = Surface::build(&body);
    let mut snapshot = BodySnapshot::default();
    let seeds: Vec<u32> = shirt
        .vertices
        .iter()
        .map(|&p| surface.closest(p).unwrap().face)
        .collect();
    let report = |what: &str, us: f64| println!("{what:<44} {us:9.0} us");
    report(
        "vertex tree: build",
        microseconds(|| drop(ClosestVertex::build(&body.vertices))),
    );
    report("vertex tree: refit", microseconds(|| tree.refit(&body.vertices)));
    let each = |query: &dyn Fn(usize, Vec3) -> f32| {
        let all = || {
            shirt
                .vertices
                .iter()
                .enumerate()
                .map(|(i, &p)| query(i, p))
                .sum::<f32>()
        };
        microseconds(|| drop(black_box(vec![all()])))
    };
    let distance = |hit: Option<SurfacePoint>| hit.map_or(0.0, |hit| hit.signed_distance);
    let nearest = |_, p| tree.nearest(p).map_or(0.0, |(_, distance)| distance);
    report("nearest vertex of every shirt vertex", each(&nearest));
    report(
        "triangle tree: build",
        microseconds(|| drop(Surface::build(&body))),
    );
    report(
        "triangle tree: refit",
        microseconds(|| surface.refit(&body.vertices)),
    );
    report(
        "closest triangle of every shirt vertex",
        each(&|_, p| distance(surface.closest(p))),
    );
    let from = |i: usize, p| distance(surface.closest_from(p, seeds[i]));
    report("the same, from last frame's triangle", each(&from));
    let within = |_, p| distance(surface.closest_within(p, 0.02));
    report("the same, within 20 mm", each(&within));
    let prepare = microseconds(|| snapshot.prepare(&body.vertices, &body.faces));
    report("snapshot: prepare", prepare);
    let weights = halves(&shirt);
    let diffuse = || drop(diffused_weights(&weights, &shirt, DIFFUSION_LENGTH_M));
    report("diffuse two joints over the shirt", microseconds(diffuse));
}
