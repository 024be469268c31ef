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
        skinned: None,
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    pass.set_afterwards(Afterwards::SearchedAgain);
    let rest = &garment.rest.vertices;
    let mut shown = rest.clone();
    pass.apply(posed, &mut shown);
    let mut planes = Vec::new();
    pass.contact_planes(posed, &shown, &mut planes);
    // Only on one side: lifts of stretched faces reach some rows farther.
    let row = |v: usize| v / 22;
    let drawn = |v: usize| planes[v] == ContactPlane::NONE && row(v) < 6;
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
    pass.correct_again(posed, &planes, &mut positions);
    let radii = (0..shown.len())
        .filter(|v| drawn(*v))
        .map(|v| positions[v].length());
    let height_m = radii.fold(f32::INFINITY, f32::min) - 0.15;
    assert!(
        (height_m - LAST_MARGIN_SHARE * MARGIN_M).abs() < 3e-4,
        "{height_m} m"
    );
    for v in 0..shown.len() {
        match planes[v] == ContactPlane::NONE {
            // Lifts of stretched faces come on top.
            true if drawn(v) => assert!(
                (0.151..0.175).contains(&positions[v].length()),
                "{}",
                positions[v]
            ),
            true if row(v) > 14 => assert_eq!(positions[v], shown[v] + little),
            true => assert!(positions[v].distance(shown[v]) < 0.03),
            false => assert!(
                (0.151..0.175).contains(&positions[v].length()),
                "{}",
                positions[v]
            ),
        }
    }
}

/// Height over a ball of the lowest middle of an edge, metres, before and after the corrections that
/// follow sweeps. The ball comes through a sheet at height `y`, with edges of length `side` that are
/// stretched by a factor. Vertices inside the ball are at the margin.
fn heights_of_stretched_faces(side: f32, stretch: f32, y: f32) -> [f32; 2] {
    let ball = sphere(4, 0.15);
    let (body, garment) = on_one_joint(ball.clone(), sheet(8, 8, side / stretch));
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: None,
    };
    let lowest_middle = |positions: &[Vec3]| {
        let edges = crate::topology::edges(&garment.rest.faces).into_iter();
        let middles = edges.map(|[a, b]| positions[a as usize].midpoint(positions[b as usize]));
        middles.map(|p| p.length()).fold(f32::INFINITY, f32::min) - 0.15
    };
    // The middle of a face is over the middle of the ball.
    let corner = Vec3::new(4.0 + 1.0 / 3.0, 0.0, 4.0 + 2.0 / 3.0) * side;
    let at: Vec<Vec3> = (garment.rest.vertices.iter())
        .map(|p| (*p * stretch - corner).with_y(y))
        .collect();
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    pass.set_afterwards(Afterwards::SearchedAgain);
    let mut shown = at.clone();
    pass.apply(scene, &mut shown);
    let mut planes = Vec::new();
    pass.contact_planes(scene, &shown, &mut planes);
    // Sweeps may bring the corners down to the margin again.
    let drawn = |p: &Vec3| match p.length() < 0.153 {
        true => *p * (0.153 / p.length()),
        false => *p,
    };
    let mut positions: Vec<Vec3> = at.iter().map(drawn).collect();
    let before = lowest_middle(&positions);
    pass.correct_again(scene, &planes, &mut positions);
    [before, lowest_middle(&positions)]
}

#[test]
fn faces_that_sweeps_have_drawn_into_the_body_are_lifted_again() {
    let [before, after] = heights_of_stretched_faces(0.1, 2.0, 0.145);
    assert!(before < -0.5e-3 && after > -0.2e-3, "{before} m, then {after} m");
}

#[test]
fn faces_that_are_little_stretched_or_far_inside_stay_there_after_sweeps() {
    let [before, after] = heights_of_stretched_faces(0.1, 1.3, 0.145);
    assert!(before < -0.5e-3 && after < -0.5e-3, "{before} m, then {after} m");
    // Edges beside the lowest one are not as deep, and are lifted.
    let [before, after] = heights_of_stretched_faces(0.2, 2.0, 0.11);
    assert!(before < -0.02 && after < -0.01, "{before} m, then {after} m");
}

#[test]
fn vertices_that_sweeps_have_drawn_into_the_ground_are_pushed_out_again() {
    let ball = sphere(4, 0.15);
    let cloth = shifted(sheet(21, 21, 0.04), Vec3::new(-0.4, 0.14, -0.4));
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    let ground = [Collider::ground(0.1)];
    let scene = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &ground,
        skinned: None,
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    pass.set_afterwards(Afterwards::SearchedAgain);
    let mut positions = garment.rest.vertices.clone();
    pass.apply(scene, &mut positions);
    let mut planes = Vec::new();
    pass.contact_planes(scene, &positions, &mut planes);
    positions[0].y = 0.05;
    pass.correct_again(scene, &planes, &mut positions);
    assert!((positions[0].y - 0.1 - MARGIN_M).abs() < 1e-5, "{}", positions[0]);
}

#[test]
fn beside_one_part_alone_a_pass_before_sweeps_ends_where_a_last_one_does() {
    let ball = sphere(4, 0.15);
    for y in [0.05, 0.12, 0.148] {
        let cloth = shifted(sheet(21, 21, 0.02), Vec3::new(-0.2, y, -0.2));
        let (body, garment) = on_one_joint(ball.clone(), cloth);
        let scene = CollisionScene {
            body: &body,
            vertices: &ball.vertices,
            colliders: &[],
            skinned: None,
        };
        let shown = |afterwards: Afterwards| {
            let mut pass = DisplayPass::new(RULE, &garment, &body);
            pass.set_afterwards(afterwards);
            let mut positions = garment.rest.vertices.clone();
            pass.apply(scene, &mut positions);
            positions
        };
        let last = shown(Afterwards::Shown);
        assert_eq!(shown(Afterwards::SearchedAgain), last);
        // Some vertices were clear of the ball, and moved with their neighbours.
        let pairs = garment.rest.vertices.iter().zip(&last);
        let mut spread = pairs.filter(|(rest, shown)| rest != shown && rest.length() > 0.15 + 2.0 * MARGIN_M);
        assert!(spread.next().is_some(), "{y}");
    }
}
