//! Cloth deep inside a limb leaves it towards its skinned shape.

use super::*;

/// Radius of a ball in the place of a limb, metres.
const RADIUS_M: f32 = 0.05;

/// Number of cells along each side of the sheet.
const CELLS: u32 = 12;

/// Vertex over the middle of the ball.
const MIDDLE: usize = 6 * 13 + 6;

/// Use of the skinned shape.
#[derive(Clone, Copy, PartialEq)]
enum Skinned {
    Known,
    Unknown,
}

/// Sheet that lies across the ball's middle at `height`. It is skinned at 0.1 m over the middle.
fn shown_at(height: f32, skinned: Skinned) -> (Garment, Vec<Vec3>) {
    let ball = sphere(4, RADIUS_M);
    let cloth = shifted(sheet(CELLS, CELLS, 0.01), Vec3::new(-0.06, 0.1, -0.06));
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    let mut positions: Vec<Vec3> = (garment.rest.vertices.iter()).map(|v| v.with_y(height)).collect();
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: (skinned == Skinned::Known).then_some(SkinnedGarment {
            garment: &garment,
            world_from_rest: &[Rigid::IDENTITY],
            closing_share: 1.0,
        }),
    };
    DisplayPass::new(RULE, &garment, &body).apply(scene, &mut positions);
    (garment, positions)
}

#[test]
fn a_sheet_through_the_middle_of_a_limb_leaves_it_on_the_side_of_the_skinned_shape() {
    // Below the middle, the shortest ways out lead down.
    let (garment, torn) = shown_at(-0.004, Skinned::Unknown);
    let (_, whole) = shown_at(-0.004, Skinned::Known);
    assert!(torn[MIDDLE].y < -RADIUS_M, "{}", torn[MIDDLE]);
    assert!(whole[MIDDLE].y > RADIUS_M, "{}", whole[MIDDLE]);
    for (v, p) in whole.iter().enumerate() {
        // At the ball's equator both ways are short.
        let above = garment.rest.vertices[v].with_y(0.0).length() < 0.75 * RADIUS_M;
        assert!(!above || p.y > 0.0, "{p}");
        // The facets of this ball are up to 0.1 mm inside it.
        assert!(p.length() > RADIUS_M + MARGIN_M - 3e-4, "{p}");
    }
}

#[test]
fn cloth_near_the_skin_takes_the_shortest_way() {
    let below = RADIUS_M - RobustIntersection::MIN_RETRACTED_DEPTH_M + 1e-3;
    let (_, with) = shown_at(-below, Skinned::Known);
    let (_, without) = shown_at(-below, Skinned::Unknown);
    assert_eq!(with[MIDDLE], without[MIDDLE]);
    assert!(with[MIDDLE].y < -RADIUS_M);
}

#[test]
fn the_retraction_sets_in_without_a_jump_and_ends_at_the_skinned_shape() {
    let ball = sphere(4, RADIUS_M);
    let (body, _) = on_one_joint(ball, cube());
    let retracted = |depth: f32, skinned: Vec3| {
        let p = Vec3::new(0.0, depth - RADIUS_M, 0.0);
        let moved = RULE.retract(&body, 0, p, skinned, Handling::NO_SEED);
        (p, moved)
    };
    let outside = Vec3::Y * 0.2;
    let set_in = RobustIntersection::MIN_RETRACTED_DEPTH_M + 3e-4;
    let (p, moved) = retracted(set_in, outside);
    assert!(moved.unwrap().distance(p) < 1e-3);
    let (_, moved) = retracted(0.03, outside);
    assert!((moved.unwrap().y - RADIUS_M - MARGIN_M).abs() < 2e-3);
    // A skinned position inside of the body is as far as the vertex goes.
    let (_, moved) = retracted(0.03, Vec3::ZERO);
    assert!(moved.unwrap().length() < 1e-6);
}
