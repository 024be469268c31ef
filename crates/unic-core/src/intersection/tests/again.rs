//! Vertices that sweeps over edges move into the body after the display pass.

use super::*;

/// Sheet across a ball of 15 cm, whose border is far from the ball.
fn ball_and_sheet() -> (TriMesh, RobustBody, Garment) {
    let ball = sphere(4, 0.15);
    let cloth = shifted(sheet(21, 21, 0.04), Vec3::new(-0.4, 0.14, -0.4));
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    (ball, body, garment)
}

#[test]
fn a_far_vertex_that_sweeps_have_drawn_into_the_body_is_pushed_out_again() {
    let (ball, body, garment) = ball_and_sheet();
    let posed = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    let mut positions = garment.rest.vertices.clone();
    pass.apply(posed, &mut positions);
    let mut planes = Vec::new();
    pass.contact_planes(posed, &positions, &mut planes);
    let far = (0..positions.len())
        .find(|&v| positions[v].length() > 0.3)
        .unwrap();
    let near = (0..positions.len()).find(|&v| planes[v] != ContactPlane::NONE);
    assert_eq!(planes[far], ContactPlane::NONE);
    let (drawn, kept) = (Vec3::new(0.0, 0.0, 0.14), positions[near.unwrap()]);
    positions[far] = drawn;
    pass.push_out_again(posed, &planes, &mut positions);
    let radius = positions[far].length();
    assert!((radius - 0.153).abs() < 1e-3, "{radius}");
    assert!(positions[near.unwrap()].distance(kept) < 1e-5);
}
