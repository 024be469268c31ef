//! Layers of cloth over one place of the body keep their order when they are pushed.

use super::*;

/// Radius of a ball, metres.
const RADIUS_M: f32 = 0.15;

/// Cells along each side of a layer.
const CELLS: u32 = 8;

/// Height at which layers are skinned, metres.
const SKINNED_M: f32 = 0.02;

/// Stages of the display pass.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stages {
    /// Each vertex by itself.
    Single,
    /// All vertices together.
    All,
}

/// Mean heights over a ball of fine layers at these heights, after the display pass, metres.
fn shown(heights_m: &[f32], stages: Stages) -> Vec<f32> {
    shown_with_cells(0.004, heights_m, stages)
}

/// The same for layers with cells of a size. The edges of the ball are 10 mm long.
fn shown_with_cells(cell_m: f32, heights_m: &[f32], stages: Stages) -> Vec<f32> {
    let ball = sphere(4, RADIUS_M);
    let middle = 0.5 * CELLS as f32 * cell_m;
    let layer = shifted(sheet(CELLS, CELLS, cell_m), Vec3::new(-middle, 0.0, -middle));
    let size = layer.vertices.len();
    let at_height =
        |p: Vec3, height_m: f32| Vec3::new(p.x, RADIUS_M, p.z).normalize() * (RADIUS_M + height_m);
    let cloth = (1..heights_m.len()).fold(layer.clone(), |all, _| joined(all, layer.clone()));
    let layer_of = |v: usize| heights_m[v / size];
    let flat = cloth.vertices.iter().enumerate();
    let mut positions: Vec<Vec3> = flat.map(|(v, p)| at_height(*p, layer_of(v))).collect();
    let rest = TriMesh {
        // The layers are not at one place, where they would be welded.
        vertices: (cloth.vertices.iter().enumerate())
            .map(|(v, p)| at_height(*p, SKINNED_M + 1e-5 * (v / size) as f32))
            .collect(),
        ..cloth
    };
    let (body, garment) = on_one_joint(ball.clone(), rest);
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: Some(SkinnedGarment {
            garment: &garment,
            world_from_rest: &[Rigid::IDENTITY],
            closing_share: 0.0,
        }),
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    match stages {
        Stages::All => pass.apply(scene, &mut positions),
        Stages::Single => move_each(&mut pass, scene, &mut positions),
    }
    let mean = |layer: &[Vec3]| layer.iter().map(|p| p.length() - RADIUS_M).sum::<f32>() / size as f32;
    positions.chunks(size).map(mean).collect()
}

/// Moves each vertex by itself.
fn move_each(pass: &mut DisplayPass, scene: CollisionScene, positions: &mut [Vec3]) {
    pass.find_contacts(scene, positions);
    pass.find_corrections(scene);
    pass.move_each(scene.body, positions);
}

/// Checks heights over the margin, to the facets of the ball, metres.
fn assert_over_margin(found_m: &[f32], expected_m: &[f32]) {
    for (found, expected) in found_m.iter().zip(expected_m) {
        let error_m = found - MARGIN_M - expected;
        assert!(error_m.abs() < 3e-4, "{found_m:?} {expected_m:?}");
    }
}

#[test]
fn the_deepest_layer_comes_to_the_margin_and_the_others_stay_above_it() {
    // 11 and 5 mm below the margin, 2 and 15 mm above it; 11 mm above it nothing is raised.
    let heights_m = [-0.008, -0.002, 0.005, 0.018];
    let found_m = shown(&heights_m, Stages::Single);
    assert_over_margin(&found_m, &[0.0, 0.003, 0.0065, 0.015]);
    let found_m = shown(&heights_m, Stages::All);
    assert!(found_m.is_sorted_by(|a, b| b - a > 2e-3), "{found_m:?}");
}

#[test]
fn layers_that_are_drawn_to_their_skinned_positions_keep_their_order() {
    let found_m = shown(&[-0.025, -0.015, -0.005], Stages::Single);
    assert_over_margin(&found_m, &[0.0, 0.005, 0.010]);
}

#[test]
fn a_single_layer_comes_to_the_margin() {
    assert_over_margin(&shown(&[-0.004], Stages::Single), &[0.0]);
    assert_over_margin(&shown(&[-0.025], Stages::Single), &[0.0]);
}

#[test]
fn cloth_over_another_place_stays() {
    let ball = sphere(4, RADIUS_M);
    let layer = sheet(CELLS, CELLS, 0.004);
    let opposite = shifted(layer.clone(), Vec3::Y);
    let (body, garment) = on_one_joint(ball, joined(layer, opposite));
    // One layer is 11 mm below the margin; the other is 3 mm above it, on the other side.
    let size = garment.rest.vertices.len() / 2;
    let place = |v: usize, p: Vec3| match v < size {
        true => Vec3::new(p.x, RADIUS_M, p.z).normalize() * (RADIUS_M - 0.008),
        false => Vec3::new(p.x, -RADIUS_M, p.z).normalize() * (RADIUS_M + 0.006),
    };
    let rest = garment.rest.vertices.iter().enumerate();
    let before: Vec<Vec3> = rest.map(|(v, p)| place(v, *p)).collect();
    let scene = CollisionScene {
        body: &body,
        vertices: &[],
        colliders: &[],
        skinned: None,
    };
    let mut after = before.clone();
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    move_each(&mut pass, scene, &mut after);
    let moved = |range: std::ops::Range<usize>| range.filter(|&v| before[v] != after[v]).count();
    assert_eq!([moved(0..size), moved(size..2 * size)], [size, 0]);
}

#[test]
fn parts_that_may_not_push_cloth_do_not_raise_it() {
    // The ball belongs to one joint. A layer on the other joint is above a layer that is inside it.
    let ball = sphere(4, RADIUS_M);
    let layer = shifted(sheet(CELLS, CELLS, 0.004), Vec3::new(-0.016, 0.0, -0.016));
    let at_height = |height_m: f32| {
        let place = |p: &Vec3| Vec3::new(p.x, RADIUS_M, p.z).normalize() * (RADIUS_M + height_m);
        let vertices = layer.vertices.iter().map(place).collect();
        TriMesh {
            vertices,
            ..layer.clone()
        }
    };
    let (size, far) = (layer.vertices.len(), shifted(cube(), Vec3::Y * 2.0));
    let balls = ball.vertices.len();
    let body = character(joined(ball, far), &[-1, 0, 0], |v| 1 + usize::from(v >= balls));
    let raised_on = |joint: usize| {
        let cloth = joined(at_height(-0.008), at_height(0.006));
        let garment = garment(cloth, 3, |v| if v < size { 1 } else { joint });
        let posed = RobustBody::new(&body, &garment);
        let before = garment.rest.vertices.clone();
        let (mut after, mut pass) = (before.clone(), DisplayPass::new(RULE, &garment, &posed));
        let scene = CollisionScene {
            body: &posed,
            vertices: &[],
            colliders: &[],
            skinned: None,
        };
        move_each(&mut pass, scene, &mut after);
        (size..2 * size).filter(|&v| before[v] != after[v]).count()
    };
    assert_eq!([raised_on(1), raised_on(2)], [size, 0]);
}

#[test]
fn layers_of_a_coarse_garment_are_pushed_one_by_one() {
    let found_m = shown_with_cells(0.008, &[-0.008, -0.002], Stages::Single);
    assert_over_margin(&found_m, &[0.0, 0.0]);
}
