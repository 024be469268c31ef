//! Contract of the display pass for faces stretched through a limb: they are lifted out of the
//! parts that may push them.

use super::*;

/// Number of squares of the sheet on each side. The corners of the middle one are pushed out to all
/// sides, and leave the square 66 mm below the ball's top.
const SIDE: u32 = 3;
const HEIGHT_M: f32 = 0.03;

#[test]
fn faces_stretched_through_a_ball_are_lifted_from_its_depth() {
    let (body, ball, garment) = over_a_ball(SIDE, 0.36, HEIGHT_M);
    let positions = shown(&body, &ball.vertices, &garment);
    assert!(positions.iter().all(|p| p.is_finite()));
    let cloth = Surface::build(&TriMesh::new(positions, garment.rest.faces.clone()).unwrap());
    for v in ball.vertices.iter().filter(|v| v.y > 0.06) {
        let along = |way| cloth.cast_ray(*v, way, 0.1).map(|hit| hit.distance);
        // A ball's vertex that is not below the cloth must be little above it.
        let depth = along(Vec3::Y).map_or_else(|| along(Vec3::NEG_Y).unwrap(), |_| 0.0);
        assert!(depth < 0.02, "the cloth is {depth} m under the skin at {v}");
    }
}

/// The ball is a hand in front of a sheet that the trunk carries, or the trunk itself.
#[test]
fn a_part_that_may_not_push_lifts_no_face() {
    let (_, ball, cloth) = over_a_ball(SIDE, 0.36, HEIGHT_M);
    let garment = garment(cloth.rest, 4, |_| 0);
    let stretched = garment.rest.vertices.iter().map(|p| p * Vec3::new(1.3, 1.0, 1.3));
    let stretched: Vec<Vec3> = stretched.collect();
    for (part, lifts) in [(3, false), (0, true)] {
        let character = character(ball.clone(), &[-1, 0, 1, 2], |_| part);
        let body = RobustBody::new(&character, &garment);
        let posed = CollisionScene {
            body: &body,
            vertices: &ball.vertices,
            colliders: &[],
            skinned: None,
        };
        let mut positions = stretched.clone();
        DisplayPass::new(RULE, &garment, &body).apply(posed, &mut positions);
        assert_eq!(positions != stretched, lifts, "part {part}");
    }
}
