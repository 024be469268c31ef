//! Cloth whose neighbours are on opposite sides of a limb comes together on one side.

use super::*;

/// Radius of a ball in the place of a limb, metres.
const RADIUS_M: f32 = 0.06;

/// Number of cells along each side of the sheet.
const CELLS: u32 = 8;

/// Vertex over the middle of the ball.
const MIDDLE: usize = 4 * 9 + 4;

/// Sheet that lies on top of the ball, with these vertices opposite to their places. Positions after
/// the display pass, and after the corrections that follow sweeps. It is skinned at 0.1 m over the
/// middle.
fn shown(torn: &[usize], closing_share: f32, split_faces: bool) -> (Garment, [Vec<Vec3>; 2]) {
    let ball = sphere(4, RADIUS_M);
    let mut cloth = shifted(sheet(CELLS, CELLS, 0.01), Vec3::new(-0.04, 0.1, -0.04));
    let is_torn: Vec<Vec3> = torn.iter().map(|&v| cloth.vertices[v]).collect();
    if split_faces {
        cloth = split(&cloth);
    }
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    let on_top = |p: &Vec3| {
        let above = p.with_y((0.064f32.powi(2) - p.x * p.x - p.z * p.z).sqrt());
        match is_torn.contains(p) {
            true => -above,
            false => above,
        }
    };
    let mut positions: Vec<Vec3> = garment.rest.vertices.iter().map(on_top).collect();
    let skinned = SkinnedGarment {
        garment: &garment,
        world_from_rest: &[Rigid::IDENTITY],
        closing_share,
    };
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: Some(skinned),
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    let mut first = positions.clone();
    pass.apply(scene, &mut first);
    let planes = vec![ContactPlane::NONE; positions.len()];
    pass.correct_again(scene, &planes, &mut positions);
    (garment, [first, positions])
}

/// Smallest distance of the middles of edges from the middle of the ball, metres.
fn lowest_middle(garment: &Garment, positions: &[Vec3]) -> f32 {
    let edges = crate::topology::edges(&garment.rest.faces).into_iter();
    let middles = edges.map(|[a, b]| positions[a as usize].midpoint(positions[b as usize]));
    middles.map(|p| p.length()).fold(f32::INFINITY, f32::min)
}

#[test]
fn a_vertex_on_the_other_side_of_a_limb_comes_to_its_neighbours() {
    // Given garments are not torn, whatever they cut through.
    let (garment, torn) = shown(&[MIDDLE], 0.0, false);
    for torn in torn {
        assert!(torn[MIDDLE].y < -RADIUS_M && lowest_middle(&garment, &torn) < 0.9 * RADIUS_M);
    }
    for split_faces in [false, true] {
        let (garment, whole) = shown(&[MIDDLE], 1.0, split_faces);
        for whole in whole {
            assert!(whole.iter().all(|p| p.y > 0.0));
            let lowest_m = lowest_middle(&garment, &whole);
            assert!(lowest_m > RADIUS_M, "{lowest_m}");
            // Seams stay closed.
            let rest = &garment.rest.vertices;
            for (v, p) in whole.iter().enumerate() {
                let first = rest.iter().position(|at| *at == rest[v]).unwrap();
                assert_eq!(*p, whole[first]);
            }
        }
    }
}

#[test]
fn a_patch_on_the_other_side_of_a_limb_comes_to_its_neighbours() {
    let patch: Vec<usize> = (0..9).map(|k| MIDDLE - 10 + k % 3 + 9 * (k / 3)).collect();
    // Only before sweeps, the faces around the patch are lifted over the ball.
    let (garment, [_, whole]) = shown(&patch, 1.0, false);
    let below = whole.iter().filter(|p| p.y <= 0.0).count();
    let lowest_m = lowest_middle(&garment, &whole);
    assert!(below == 0 && lowest_m > RADIUS_M, "{below}, {lowest_m}");
}
