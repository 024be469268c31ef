//! Contract of the robust handling: closed forms, what it leaves alone, and what display adds.

use super::*;
use crate::{
    collider::Collider,
    config::Corrects,
    mesh::TriMesh,
    shapes::{cube, point, sheet, sphere},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    surface::Surface,
    transform::Rigid,
};
use proptest::{collection::vec, prelude::*};
use std::sync::Arc;

mod coherence;
mod creases;
mod spans;

const MARGIN_M: f32 = 0.003;
const RULE: RobustIntersection = RobustIntersection { margin_m: MARGIN_M };

/// A skeleton of joints that hang on one another as `parents` say, and a body vertex by vertex on one.
fn character(body: TriMesh, parents: &[i64], joint_of: impl Fn(usize) -> usize) -> Character {
    let parts = SkeletonParts {
        parents: parents.to_vec(),
        joints: (0..parents.len()).map(|j| Vec3::Y * j as f32).collect(),
        ..Default::default()
    };
    let rows = (0..body.vertices.len()).map(|v| std::iter::once((joint_of(v), 1.0)));
    Character {
        skeleton: Skeleton::new(parts).unwrap(),
        weights: SkinningWeights::from_rows(parents.len(), rows).unwrap(),
        body,
    }
}

/// A garment, vertex by vertex on one joint.
fn garment(rest: TriMesh, joints: usize, joint_of: impl Fn(usize) -> usize) -> Garment {
    let rows = (0..rest.vertices.len()).map(|v| std::iter::once((joint_of(v), 1.0)));
    let weights = SkinningWeights::from_rows(joints, rows).unwrap();
    Garment::new(rest, weights)
}

fn rigid(body: TriMesh, cloth: TriMesh) -> (RobustBody, Garment) {
    let (character, garment) = (character(body, &[-1], |_| 0), garment(cloth, 1, |_| 0));
    (RobustBody::new(&character, &garment), garment)
}

fn corrected(body: &RobustBody, p: Vec3) -> Option<Vec3> {
    RULE.correct(body, 0, p, &mut Handling::no_seed())
}

fn two(a: TriMesh, b: TriMesh) -> TriMesh {
    let count = a.vertices.len() as u32;
    let moved = b.faces.iter().map(|f| f.map(|v| v + count));
    let faces = a.faces.iter().copied().chain(moved).collect();
    TriMesh::new([a.vertices, b.vertices].concat(), faces).unwrap()
}

/// The same faces, each with corners of its own.
fn split(mesh: &TriMesh) -> TriMesh {
    let corners = mesh.faces.iter().flatten().map(|&v| mesh.vertices[v as usize]);
    let faces = (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
    TriMesh::new(corners.collect(), faces.collect()).unwrap()
}

fn shifted(mut mesh: TriMesh, by: Vec3) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v += by);
    mesh
}

/// The display pass over a garment that lies at its rest positions.
fn shown(body: &RobustBody, body_vertices: &[Vec3], garment: &Garment) -> Vec<Vec3> {
    shown_among(body, body_vertices, garment, &[])
}

fn shown_among(
    body: &RobustBody,
    body_vertices: &[Vec3],
    garment: &Garment,
    colliders: &[Collider],
) -> Vec<Vec3> {
    let mut positions = garment.rest.vertices.clone();
    let posed = PosedVertices {
        body,
        vertices: body_vertices,
        colliders,
    };
    DisplayPass::new(RULE, garment, body).apply(posed, &mut positions);
    positions
}

proptest! {
    #[test]
    fn vertices_in_a_sphere_go_out_along_the_radius(p in point(0.2)) {
        let (radius, ball) = (0.15, sphere(4, 0.15));
        let (body, _) = rigid(ball, cube());
        match corrected(&body, p) {
            // The facets of this sphere lie up to 0.1 mm below it.
            Some(out) => {
                prop_assert!(p.length() < radius + MARGIN_M);
                prop_assert!((out.length() - radius - MARGIN_M).abs() < 3e-4, "{}", out.length());
                if p.length() > 0.05 {
                    prop_assert!(out.angle_between(p) < 0.05);
                }
            }
            None => prop_assert!(p.length() > radius + MARGIN_M - 3e-4),
        }
    }

    #[test]
    fn vertices_at_a_plane_keep_their_places_in_it(x in 0.02f32..0.38, z in 0.02f32..0.38, y in -0.01f32..0.01) {
        let (body, _) = rigid(sheet(8, 8, 0.05), cube());
        let p = Vec3::new(x, y, z);
        match corrected(&body, p) {
            Some(out) => prop_assert!(y < MARGIN_M && out.distance(p.with_y(MARGIN_M)) < 5e-6),
            None => prop_assert!(y > MARGIN_M - 2e-5),
        }
    }

    #[test]
    fn seeds_change_nothing(p in point(0.2), seed in 0u32..600) {
        let (body, _) = rigid(sphere(2, 0.15), cube());
        prop_assert_eq!(RULE.look(&body, 0, p, seed), RULE.look(&body, 0, p, Handling::no_seed()));
    }

    #[test]
    fn together_vertices_go_where_they_go_alone(radii in vec(0.13f32..0.17, 162), cloth in vec(0.05f32..0.3, 258)) {
        let mut body = sphere(2, 1.0);
        body.vertices.iter_mut().zip(radii.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let mut around = sphere(2, 1.0);
        around.vertices.iter_mut().zip(cloth.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let (body, garment) = rigid(body, around);
        assert_together_as_alone(&body, &garment)?;
    }

    #[test]
    fn together_vertices_sink_as_alone(gap in 0.0f32..0.03, cloth in vec(0.08f32..0.26, 642)) {
        let count = sphere(3, 1.0).vertices.len();
        let character = character(trunk_and_hand(gap), &[-1, 0, 1, 2], |v| if v < count { 0 } else { 3 });
        let mut around = sphere(3, 1.0);
        around.vertices.iter_mut().zip(&cloth).for_each(|(v, r)| *v *= *r);
        // Two kinds, both near the hand: it pushes one of them.
        let garment = garment(around, 4, |v| if v % 5 == 0 { 2 } else { 0 });
        assert_together_as_alone(&RobustBody::new(&character, &garment), &garment)?;
    }

    #[test]
    fn after_the_display_pass_no_vertex_is_inside(
        radii in vec(0.13f32..0.17, 162), cloth in vec(0.11f32..0.2, 258),
    ) {
        let mut body = sphere(2, 1.0);
        body.vertices.iter_mut().zip(radii.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let mut around = sphere(2, 1.0);
        around.vertices.iter_mut().zip(cloth.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let (posed, garment) = rigid(body.clone(), around);
        for p in shown(&posed, &body.vertices, &garment) {
            let height = posed.surface().closest(p).unwrap().signed_distance;
            prop_assert!(height > -1e-4, "{} m", height);
        }
    }
}

/// All vertices of a garment at rest look at the body as each does alone, and as one that looks at every face.
fn assert_together_as_alone(body: &RobustBody, garment: &Garment) -> Result<(), TestCaseError> {
    let slots = body.parts().packets().slots();
    let mut at = vec![Vec3::NAN; body.parts().packets().len()];
    slots
        .iter()
        .zip(&garment.rest.vertices)
        .for_each(|(&slot, &p)| at[slot as usize] = p);
    let mut contacts = vec![Contact::NONE; at.len()];
    RULE.look_at_all(body, &at, |_| true, &mut contacts);
    for (vertex, &slot) in slots.iter().enumerate() {
        let (p, together) = (at[slot as usize], contacts[slot as usize]);
        let alone = RULE.look(body, vertex, p, Handling::no_seed());
        prop_assert_eq!(alone.moved, together.moved);
        // A bound for what is well above.
        let is_bound = together.height_m >= MARGIN_M - 2e-5 && alone.height_m >= together.height_m - 1e-6;
        prop_assert!(
            is_bound || alone.height_m == together.height_m,
            "{:?} {:?}",
            alone,
            together
        );
        let pushes = |face| body.parts().face_pushes(face, vertex);
        let of_all = body
            .surface()
            .closest_among(p, f32::INFINITY, Handling::no_seed(), pushes);
        prop_assert_eq!(body.closest(vertex, p, Handling::no_seed()), of_all);
    }
    Ok(())
}

/// The skin next to the cloth is the hand's, and its outer side.
#[test]
fn cloth_in_the_trunk_beside_a_hand_that_has_sunk_into_it_goes_out() -> Result<(), TestCaseError> {
    let count = sphere(3, 1.0).vertices.len();
    let body = trunk_and_hand(-0.1);
    let character = character(body, &[-1, 0, 1, 2], |v| if v < count { 0 } else { 3 });
    let garment = garment(shifted(sphere(2, 0.01), Vec3::X * 0.025), 4, |_| 0);
    let body = RobustBody::new(&character, &garment);
    for (vertex, &p) in garment.rest.vertices.iter().enumerate() {
        let moved = RULE.look(&body, vertex, p, Handling::no_seed()).moved;
        prop_assert!(moved.unwrap().length() > 0.15);
    }
    assert_together_as_alone(&body, &garment)
}

#[test]
fn what_is_beyond_a_rim_is_not_under_it() {
    let (body, _) = rigid(sheet(8, 8, 0.05), cube());
    assert_eq!(corrected(&body, Vec3::new(-0.02, -0.001, 0.2)), None);
    assert!(corrected(&body, Vec3::new(0.001, -0.001, 0.2)).is_some());
}

#[test]
fn a_thin_limb_is_left_by_the_nearer_side() {
    let mut limb = sphere(3, 0.015);
    limb.vertices.iter_mut().for_each(|v| v.y *= 10.0);
    let (body, _) = rigid(limb, cube());
    for side in [-1.0, 1.0] {
        let out = corrected(&body, Vec3::X * side * 0.002).unwrap();
        assert!((out.x * side - 0.018).abs() < 3e-4 && out.y.abs() < 1e-3, "{out}");
    }
}

#[test]
fn a_body_that_jumps_is_found_again() {
    let ball = sphere(3, 0.15);
    let (mut body, _) = rigid(ball.clone(), cube());
    let mut seed = Handling::no_seed();
    // Over the middle of a face: two that are equally near would be told apart by rounding.
    let p = Vec3::new(0.8, 0.5, 0.33).normalize() * 0.149;
    let before = RULE.correct(&body, 0, p, &mut seed).unwrap();
    let jump = Vec3::new(64.0, 0.0, -32.0);
    body.pose(&shifted(ball, jump).vertices);
    assert_eq!(RULE.correct(&body, 0, p, &mut seed), None);
    let after = RULE.correct(&body, 0, p + jump, &mut seed).unwrap();
    assert!((after - jump).distance(before) < 2e-5);
}

/// Trunk and arm, elbow and hand: two balls, the second carried by the hand.
fn trunk_and_hand(gap: f32) -> TriMesh {
    two(sphere(3, 0.15), shifted(sphere(3, 0.03), Vec3::X * (0.18 + gap)))
}

#[test]
fn a_hand_does_not_push_what_the_trunk_carries() {
    let count = sphere(3, 1.0).vertices.len();
    let body = trunk_and_hand(-0.02);
    let parents = [-1, 0, 1, 2];
    let character = character(body, &parents, |v| if v < count { 0 } else { 3 });
    // Vertex 0 on the trunk, 1 on the elbow.
    let cloth = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let garment = garment(cloth, 4, |v| if v == 1 { 2 } else { 0 });
    let body = RobustBody::new(&character, &garment);
    let look = |vertex, p| RULE.look(&body, vertex, p, Handling::no_seed());
    // In the hand, which it does not leave outwards.
    let p = Vec3::X * 0.17;
    assert!(look(0, p).moved.unwrap().x < 0.155);
    assert!(look(1, p).moved.is_some());
    // In both: for what the hand does not push there is no fold either.
    let out = look(0, Vec3::X * 0.145).moved.unwrap();
    assert!((out.length() - 0.153).abs() < 3e-4);
    // The trunk pushes sleeves.
    assert!(look(1, Vec3::NEG_X * 0.14).moved.is_some());
}

#[test]
fn folds_are_left_alone() {
    let (body, _) = rigid(
        two(sphere(3, 0.1), shifted(sphere(3, 0.1), Vec3::X * 0.15)),
        cube(),
    );
    assert_eq!(corrected(&body, Vec3::X * 0.055), None);
    assert!(corrected(&body, Vec3::NEG_X * 0.095).is_some());
}

/// A cloth of `side` squares a way over the top of a ball.
fn over_a_ball(side: u32, length: f32, height: f32) -> (RobustBody, TriMesh, Garment) {
    let ball = sphere(3, 0.1);
    let corner = Vec3::new(-0.5 * length, height, -0.47 * length);
    let cloth = shifted(sheet(side, side, length / side as f32), corner);
    let (body, garment) = rigid(ball.clone(), cloth);
    (body, ball, garment)
}

#[test]
fn a_ball_through_one_large_square_is_covered() {
    let (body, ball, garment) = over_a_ball(1, 0.4, 0.09);
    let positions = shown(&body, &ball.vertices, &garment);
    let cloth = Surface::build(&TriMesh::new(positions, garment.rest.faces.clone()).unwrap());
    for &v in &ball.vertices {
        let hit = cloth.closest(v).unwrap();
        assert!(
            hit.signed_distance < 1e-4,
            "{v} is {} m over the cloth",
            hit.signed_distance
        );
    }
}

#[test]
fn corrections_reach_a_few_edges_and_end_there() {
    let (body, ball, garment) = over_a_ball(40, 0.8, 0.095);
    let rest = &garment.rest.vertices;
    let positions = shown(&body, &ball.vertices, &garment);
    let edge_m = 0.02;
    let moved: Vec<bool> = rest.iter().zip(&positions).map(|(a, b)| a != b).collect();
    // The cap above the cloth has a radius of 3.1 cm.
    let farthest = 0.04 + (DisplayPass::REACH_EDGES as f32 + 1.0) * edge_m * 2f32.sqrt();
    for (v, is_moved) in rest.iter().zip(&moved) {
        assert!(!is_moved || v.with_y(0.0).length() < farthest, "{v} moved");
    }
    // Beside the cap the cloth rises towards it, without a step.
    let steepest = (crate::topology::edges(&garment.rest.faces).iter())
        .map(|&[a, b]| (positions[a as usize].y - positions[b as usize].y).abs())
        .fold(0.0, f32::max);
    assert!(moved.iter().filter(|m| **m).count() > 20);
    let highest = positions.iter().map(|p| p.y - 0.095).fold(0.0, f32::max);
    assert!(steepest < 0.7 * highest, "{steepest} of {highest} m in one edge");
}

#[test]
fn a_cloth_that_lies_well_keeps_its_bits() {
    let (body, ball, garment) = over_a_ball(40, 0.8, 0.1035);
    assert_eq!(shown(&body, &ball.vertices, &garment), garment.rest.vertices);
}

#[test]
fn no_two_vertices_collapse() {
    // The paper's rule takes all vertices with one nearest body vertex to one place.
    let (body, ball, garment) = over_a_ball(60, 0.4, 0.06);
    let positions = shown(&body, &ball.vertices, &garment);
    let rest = &garment.rest.vertices;
    for [a, b] in crate::topology::edges(&garment.rest.faces)
        .into_iter()
        .map(|e| e.map(|v| v as usize))
    {
        let share = positions[a].distance(positions[b]) / rest[a].distance(rest[b]);
        assert!(share > 0.2, "an edge is {share} of what it was");
    }
}

#[test]
fn seams_stay_closed() {
    let (body, ball, garment) = over_a_ball(20, 0.4, 0.09);
    let (_, split) = rigid(ball.clone(), split(&garment.rest));
    let character = character(ball.clone(), &[-1], |_| 0);
    let of_split = shown(&RobustBody::new(&character, &split), &ball.vertices, &split);
    let whole = shown(&body, &ball.vertices, &garment);
    for (corner, &vertex) in of_split.iter().zip(garment.rest.faces.iter().flatten()) {
        assert!(corner.distance(whole[vertex as usize]) < 1e-6);
    }
}

/// A ball through a sheet of `side` squares a way that lies far from the body.
fn over_a_prop(side: u32, collider: Collider) -> (Vec<Vec3>, Garment) {
    let ball = sphere(2, 0.1);
    let far = Vec3::new(4.8, 0.09, -0.19);
    let (body, garment) = rigid(ball.clone(), shifted(sheet(side, side, 0.4 / side as f32), far));
    (shown_among(&body, &ball.vertices, &garment, &[collider]), garment)
}

#[test]
fn cloth_is_lifted_over_props_and_keeps_its_bits_beside_them() {
    let ball = Collider::sphere(0.1, Vec3::X * 5.0);
    let capsule = Collider::capsule(0.1, [Vec3::new(5.0, 0.0, -0.05), Vec3::new(5.0, 0.0, 0.05)]);
    let mesh = Collider::mesh(
        Arc::new(Surface::build(&sphere(4, 0.1))),
        Rigid::new(glam::Quat::IDENTITY, Vec3::X * 5.0),
    );
    for (name, collider) in [("ball", ball), ("capsule", capsule), ("mesh", mesh)] {
        let (positions, garment) = over_a_prop(40, collider.clone());
        let low = positions
            .iter()
            .filter_map(|&p| collider.way_out(p, MARGIN_M - 1e-5));
        assert_eq!(low.count(), 0, "{name}");
        let pairs = || positions.iter().zip(&garment.rest.vertices);
        assert!(
            pairs().any(|(a, b)| a != b) && pairs().any(|(a, b)| a == b),
            "{name}"
        );
    }
}

#[test]
fn round_props_through_one_large_square_are_covered() {
    let ball = Collider::sphere(0.1, Vec3::X * 5.0);
    let (positions, garment) = over_a_prop(1, ball.clone());
    for face in &garment.rest.faces {
        let corners = face.map(|v| positions[v as usize]);
        assert!(ball.way_out_of_face(corners, 0.0).is_none(), "{corners:?}");
    }
}

#[test]
fn cloth_lies_on_the_ground_and_out_of_the_body() {
    let (body, ball, garment) = over_a_ball(40, 0.8, 0.05);
    let positions = shown_among(&body, &ball.vertices, &garment, &[Collider::ground(0.06)]);
    for p in positions {
        assert!(p.y > 0.06 + MARGIN_M - 1e-5, "{p}");
        assert!(body.surface().closest(p).unwrap().signed_distance > -1e-4);
    }
}

/// A cloth over a ball, and another that dips through it.
fn two_layers(layer_of: impl Fn(usize) -> u32) -> (RobustBody, TriMesh, Garment, Layers) {
    let ball = sphere(3, 0.1);
    let corner = |y: f32| Vec3::new(-0.2, y, -0.19);
    let outer = |v: &Vec3| *v + Vec3::Y * 0.006 * (30.0 * v.x).sin();
    let mut over = shifted(sheet(30, 30, 0.4 / 30.0), corner(0.125));
    over.vertices.iter_mut().for_each(|v| *v = outer(v));
    let cloth = two(shifted(sheet(20, 20, 0.02), corner(0.12)), over);
    let (character, garment) = (character(ball.clone(), &[-1], |_| 0), garment(cloth, 1, |_| 0));
    let of_vertices = (0..garment.rest.vertices.len()).map(layer_of).collect();
    let layers = Layers::new(&character, &garment, of_vertices).unwrap();
    assert_eq!(
        layers.of_vertices(),
        Layers::of_parts(&character, &garment).of_vertices()
    );
    (RobustBody::new(&character, &garment), ball, garment, layers)
}

#[test]
fn layers_come_into_order_and_keep_it() {
    let inner = 21 * 21;
    let (body, ball, garment, layers) = two_layers(|v| u32::from(v >= inner));
    let posed = PosedVertices {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
    };
    let mut pass = DisplayPass::new(RULE, &garment, &body);
    pass.set_layers(&layers);
    let mut positions = garment.rest.vertices.clone();
    pass.apply(posed, &mut positions);
    assert_eq!(
        positions[..inner],
        garment.rest.vertices[..inner],
        "the inner layer stays"
    );
    let faces = garment
        .rest
        .faces
        .iter()
        .filter(|f| f.iter().all(|&v| (v as usize) < inner));
    let beneath = Surface::build(&TriMesh::new(positions.clone(), faces.copied().collect()).unwrap());
    let height = |p: &Vec3| beneath.closest(*p).unwrap();
    let over = || {
        positions[inner..]
            .iter()
            .map(height)
            .filter(|hit| hit.normal.y > 0.99)
    };
    let was = garment.rest.vertices[inner..].iter().map(height);
    assert!(was.filter(|hit| hit.signed_distance < -5e-4).count() > 50);
    assert!(over().count() > 500);
    over().for_each(|hit| assert!(hit.signed_distance > MARGIN_M - 1e-4, "{hit:?}"));
    let again = positions.clone();
    pass.apply(posed, &mut positions);
    assert!(positions.iter().zip(&again).all(|(a, b)| a.distance(*b) < 1e-4));
}

#[test]
fn layers_of_another_mesh_are_refused() {
    let character = character(sphere(1, 0.15), &[-1], |_| 0);
    let garment = garment(cube(), 1, |_| 0);
    let of = |layers: Vec<u32>| Layers::new(&character, &garment, layers).map(|_| ());
    let vertices = garment.rest.vertices.len();
    assert_eq!(of(vec![0; vertices]), Ok(()));
    let (expected, found) = (vertices, 3);
    assert_eq!(of(vec![0; 3]), Err(LayersError::Vertices { expected, found }));
    let (most, found) = (Layers::MOST - 1, 99);
    assert_eq!(of(vec![99; vertices]), Err(LayersError::TooMany { most, found }));
}

/// A trunk with an arm beside it: what is in the arm goes to the trunk.
#[test]
fn cloth_in_a_limb_sinks_towards_what_carries_it() {
    let count = sphere(3, 1.0).vertices.len();
    let parents = [-1, 0, 1, 2];
    // From 1.5 cm over the trunk to 7.5 cm.
    let body = trunk_and_hand(0.015);
    let character = character(body, &parents, |v| if v < count { 0 } else { 3 });
    let cloth = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let garment = garment(cloth, 4, |v| if v == 1 { 2 } else { 0 });
    let body = RobustBody::new(&character, &garment);
    let look = |vertex, x: f32| RULE.look(&body, vertex, Vec3::X * x, Handling::no_seed()).moved;
    for x in [0.167, 0.17, 0.19, 0.21, 0.222] {
        let out = look(0, x).unwrap();
        // Under the arm, over the trunk.
        assert!(
            out.x > 0.153 - 3e-4 && out.x < 0.165 && out.x > 0.161,
            "{x}: {out}"
        );
    }
    // Continuous where the arm comes in.
    let out = look(0, 0.1655).unwrap();
    assert!((out.x - 0.1645).abs() < 5e-4, "{out}");
    assert_eq!((look(0, 0.16), look(0, 0.23)), (None, None));
    // A sleeve is pushed by the arm and goes the nearest way.
    assert!(look(1, 0.222).unwrap().x > 0.225);
}

#[test]
fn every_mode_can_be_asked() {
    let character = character(sphere(3, 0.15), &[-1], |_| 0);
    let garment = garment(cube(), 1, |_| 0);
    let p = Vec3::X * 0.149;
    let modes = [
        (IntersectionMode::Off, None),
        (IntersectionMode::Paper { relaxation_m: 0.005 }, Some(0.155)),
        (
            IntersectionMode::Robust {
                margin_m: MARGIN_M,
                corrects: Corrects::State,
            },
            Some(0.153),
        ),
    ];
    for (mode, expected) in modes {
        let mut handling = Handling::new(mode, &character, &garment);
        handling.pose(&character, &character.body.vertices);
        let found = handling.correct(0, p, &mut Handling::no_seed());
        assert_eq!(found.is_some(), expected.is_some(), "{mode:?}");
        let height = found.map_or(0.0, Vec3::length) - expected.unwrap_or(0.0);
        assert!(height.abs() < 3e-4, "{mode:?}");
        assert_eq!(handling.correct(0, Vec3::NAN, &mut Handling::no_seed()), None);
    }
}
