//! Vertices that sweeps over edges move into the body after the display pass.

use super::*;

#[test]
fn vertices_that_sweeps_have_drawn_into_the_body_from_afar_are_pushed_out_again() {
    // A sheet across a ball of 15 cm, whose border is far from the ball.
    let ball = sphere(4, 0.15);
    let cloth = shifted(sheet(21, 21, 0.04), Vec3::new(-0.4, 0.14, -0.4));
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    let posed = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    let rest = &garment.rest.vertices;
    let mut shown = rest.clone();
    pass.apply(posed, &mut shown);
    let mut planes = Vec::new();
    pass.contact_planes(posed, &shown, &mut planes);
    let drawn = |v: usize| planes[v] == ContactPlane::NONE && v.is_multiple_of(2);
    let has_spread = |v: usize| shown[v] != rest[v];
    assert!((0..shown.len()).any(|v| drawn(v) && has_spread(v)));
    assert!((0..shown.len()).any(|v| drawn(v) && !has_spread(v)));
    // Others without a plane move a little.
    let little = Vec3::Y * 1e-3;
    let moved = |v: usize| match (drawn(v), planes[v] == ContactPlane::NONE) {
        (true, _) => Vec3::new(0.0, 0.0, 0.14),
        (false, true) => shown[v] + little,
        (false, false) => shown[v],
    };
    let mut positions: Vec<Vec3> = (0..shown.len()).map(moved).collect();
    pass.push_out_again(posed, &planes, &mut positions);
    for v in 0..shown.len() {
        match planes[v] == ContactPlane::NONE {
            true if drawn(v) => assert!((positions[v].length() - 0.153).abs() < 1e-3, "{}", positions[v]),
            true => assert_eq!(positions[v], shown[v] + little),
            false => assert!(positions[v].distance(shown[v]) < 1e-5),
        }
    }
}
