//! Cloth whose neighbours are on opposite sides of a limb comes together on one side.

use super::*;

/// Radius of a ball in the place of a limb, metres.
const RADIUS_M: f32 = 0.06;

/// Number of cells along each side of the sheet.
const CELLS: u32 = 8;

/// Vertex over the middle of the ball.
const MIDDLE: usize = 4 * 9 + 4;

/// Sheet that lies on top of the ball, with these vertices opposite to their places, after the
/// corrections that follow sweeps. It is skinned at 0.1 m over the middle.
fn shown_again(torn: &[usize], corrects: Corrects, split_faces: bool) -> (Garment, Vec<Vec3>) {
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
    };
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: (corrects == Corrects::Display).then_some(skinned),
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    pass.apply(scene, &mut positions.clone());
    let planes = vec![ContactPlane::NONE; positions.len()];
    pass.correct_again(scene, &planes, &mut positions);
    (garment, positions)
}

/// Smallest distance of the middles of edges from the middle of the ball, metres.
fn lowest_middle(garment: &Garment, positions: &[Vec3]) -> f32 {
    let edges = crate::topology::edges(&garment.rest.faces).into_iter();
    let middles = edges.map(|[a, b]| positions[a as usize].midpoint(positions[b as usize]));
    middles.map(|p| p.length()).fold(f32::INFINITY, f32::min)
}

#[test]
fn a_vertex_on_the_other_side_of_a_limb_comes_to_its_neighbours() {
    let (garment, torn) = shown_again(&[MIDDLE], Corrects::State, false);
    assert!(torn[MIDDLE].y < -RADIUS_M && lowest_middle(&garment, &torn) < 0.03);
    for split_faces in [false, true] {
        let (garment, whole) = shown_again(&[MIDDLE], Corrects::Display, split_faces);
        assert!(whole.iter().all(|p| p.y > 0.0));
        // An edge of 1 cm is 0.1 mm lower in its middle than at its ends.
        assert!(
            lowest_middle(&garment, &whole) > RADIUS_M,
            "{}",
            lowest_middle(&garment, &whole)
        );
    }
}

#[test]
fn a_patch_on_the_other_side_of_a_limb_comes_to_its_neighbours() {
    let patch: Vec<usize> = (0..9).map(|k| MIDDLE - 10 + k % 3 + 9 * (k / 3)).collect();
    let (garment, whole) = shown_again(&patch, Corrects::Display, false);
    assert!(whole.iter().all(|p| p.y > 0.0));
    assert!(
        lowest_middle(&garment, &whole) > RADIUS_M,
        "{}",
        lowest_middle(&garment, &whole)
    );
}

#[test]
fn cloth_without_tears_keeps_its_bits() {
    let (_, with) = shown_again(&[], Corrects::Display, false);
    let (_, without) = shown_again(&[], Corrects::State, false);
    assert_eq!(with, without);
}
