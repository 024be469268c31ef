//! Contract of the robust handling: corrections agree with closed forms, packets agree with single
//! vertices, and positions without intersections keep their bits. The display pass leaves no vertex
//! inside the body, covers the body with faces, and keeps layers in order.

use super::*;
use crate::{
    collider::Collider,
    config::Corrects,
    mesh::TriMesh,
    projection::ContactPlane,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    surface::Surface,
    test_meshes::{cube, point, sheet, sphere},
    transform::Rigid,
};
use proptest::{collection::vec, prelude::*};
use std::sync::Arc;

mod again;
mod coherence;
mod creases;
mod depths;
mod retraction;
mod stretched_faces;
mod tears;

/// Height to which vertices are pushed, metres.
const MARGIN_M: f32 = 0.003;
const RULE: RobustIntersection = RobustIntersection { margin_m: MARGIN_M };

/// Character with a body of which each vertex is skinned to one joint.
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
        file_mesh: None,
    }
}

/// Garment with each vertex skinned to one joint.
fn garment(rest: TriMesh, joints: usize, joint_of: impl Fn(usize) -> usize) -> Garment {
    let rows = (0..rest.vertices.len()).map(|v| std::iter::once((joint_of(v), 1.0)));
    let weights = SkinningWeights::from_rows(joints, rows).unwrap();
    Garment::new(rest, weights)
}

/// Body and garment on a single joint.
fn on_one_joint(body: TriMesh, cloth: TriMesh) -> (RobustBody, Garment) {
    let (character, garment) = (character(body, &[-1], |_| 0), garment(cloth, 1, |_| 0));
    (RobustBody::new(&character, &garment), garment)
}

fn corrected(body: &RobustBody, p: Vec3) -> Option<Vec3> {
    let mut seed = Handling::NO_SEED;
    RULE.correct(body, 0, p, &mut seed)
}

/// Both meshes as one, the vertices of the first in front.
fn joined(a: TriMesh, b: TriMesh) -> TriMesh {
    let count = a.vertices.len() as u32;
    let moved = b.faces.iter().map(|f| f.map(|v| v + count));
    let faces = a.faces.iter().copied().chain(moved).collect();
    TriMesh::new([a.vertices, b.vertices].concat(), faces).unwrap()
}

/// Mesh with the same faces, each with corners of its own.
fn split(mesh: &TriMesh) -> TriMesh {
    let corners = mesh.faces.iter().flatten().map(|&v| mesh.vertices[v as usize]);
    let faces = (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
    TriMesh::new(corners.collect(), faces.collect()).unwrap()
}

fn shifted(mut mesh: TriMesh, by: Vec3) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v += by);
    mesh
}

/// Positions after the display pass over a garment at its rest positions.
fn shown(body: &RobustBody, body_vertices: &[Vec3], garment: &Garment) -> Vec<Vec3> {
    shown_with_colliders(body, body_vertices, garment, &[])
}

/// Positions after the display pass over a garment at its rest positions, with colliders.
fn shown_with_colliders(
    body: &RobustBody,
    body_vertices: &[Vec3],
    garment: &Garment,
    colliders: &[Collider],
) -> Vec<Vec3> {
    let mut positions = garment.rest.vertices.clone();
    let posed = CollisionScene {
        body,
        vertices: body_vertices,
        colliders,
        skinned: None,
    };
    DisplayPass::new(RULE, garment, body).apply(posed, &mut positions);
    positions
}

proptest! {
    #[test]
    fn vertices_inside_a_sphere_are_pushed_along_the_radius(p in point(0.2)) {
        let (radius, ball) = (0.15, sphere(4, 0.15));
        let (body, _) = on_one_joint(ball, cube());
        match corrected(&body, p) {
            // The facets of this sphere are up to 0.1 mm inside it.
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
    fn vertices_at_a_plane_are_pushed_perpendicular_to_it(x in 0.02f32..0.38, z in 0.02f32..0.38, y in -0.01f32..0.01) {
        let (body, _) = on_one_joint(sheet(8, 8, 0.05), cube());
        let p = Vec3::new(x, y, z);
        match corrected(&body, p) {
            Some(out) => prop_assert!(y < MARGIN_M && out.distance(p.with_y(MARGIN_M)) < 5e-6),
            None => prop_assert!(y > MARGIN_M - 2e-5),
        }
    }

    #[test]
    fn contacts_do_not_depend_on_seeds(p in point(0.2), seed in 0u32..600) {
        let (body, _) = on_one_joint(sphere(2, 0.15), cube());
        prop_assert_eq!(RULE.find_contact(&body, 0, p, seed), RULE.find_contact(&body, 0, p, Handling::NO_SEED));
    }

    #[test]
    fn packet_contacts_agree_with_single_vertices(radii in vec(0.13f32..0.17, 162), cloth in vec(0.05f32..0.3, 258)) {
        let mut body = sphere(2, 1.0);
        body.vertices.iter_mut().zip(radii.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let mut around = sphere(2, 1.0);
        around.vertices.iter_mut().zip(cloth.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let (body, garment) = on_one_joint(body, around);
        assert_packets_agree_with_single_vertices(&body, &garment)?;
    }

    #[test]
    fn packets_sink_like_single_vertices(gap in 0.0f32..0.03, cloth in vec(0.08f32..0.26, 642)) {
        let count = sphere(3, 1.0).vertices.len();
        let character = character(trunk_and_hand(gap), &[-1, 0, 1, 2], |v| if v < count { 0 } else { 3 });
        let mut around = sphere(3, 1.0);
        around.vertices.iter_mut().zip(&cloth).for_each(|(v, r)| *v *= *r);
        // Two contact classes near the hand, which may push one of them.
        let garment = garment(around, 4, |v| if v % 5 == 0 { 2 } else { 0 });
        assert_packets_agree_with_single_vertices(&RobustBody::new(&character, &garment), &garment)?;
    }

    #[test]
    fn after_the_display_pass_no_vertex_is_inside(
        radii in vec(0.13f32..0.17, 162), cloth in vec(0.11f32..0.2, 258),
    ) {
        let mut body = sphere(2, 1.0);
        body.vertices.iter_mut().zip(radii.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let mut around = sphere(2, 1.0);
        around.vertices.iter_mut().zip(cloth.iter().cycle()).for_each(|(v, r)| *v *= *r);
        let (posed, garment) = on_one_joint(body.clone(), around);
        for p in shown(&posed, &body.vertices, &garment) {
            let height = posed.surface().closest(p).unwrap().signed_distance;
            prop_assert!(height > -1e-4, "{} m", height);
        }
    }
}

/// Asserts that the contacts of a garment at rest, searched in packets, are those of each vertex
/// alone, and that filters by group agree with a predicate on every face.
fn assert_packets_agree_with_single_vertices(
    body: &RobustBody,
    garment: &Garment,
) -> Result<(), TestCaseError> {
    let slots = body.contact_filter().garment_packets().slots();
    let mut at = vec![Vec3::NAN; body.contact_filter().garment_packets().len()];
    slots
        .iter()
        .zip(&garment.rest.vertices)
        .for_each(|(&slot, &p)| at[slot as usize] = p);
    let mut contacts = vec![Contact::NONE; at.len()];
    // The second search starts from what the first one has found.
    for _ in 0..2 {
        RULE.find_contacts(body, &at, |_| true, &mut contacts);
        for (vertex, &slot) in slots.iter().enumerate() {
            let (p, in_packet) = (at[slot as usize], contacts[slot as usize]);
            let single = RULE.find_contact(body, vertex, p, Handling::NO_SEED);
            prop_assert_eq!(single.corrected, in_packet.corrected);
            // Heights of vertices well above the body are lower bounds.
            let is_bound =
                in_packet.height_m >= MARGIN_M - 2e-5 && single.height_m >= in_packet.height_m - 1e-6;
            prop_assert!(
                is_bound || single.height_m == in_packet.height_m,
                "{:?} {:?}",
                single,
                in_packet
            );
            let pushes = |face| body.contact_filter().face_may_push(face, vertex);
            let by_predicate = body
                .surface()
                .closest_among(p, f32::INFINITY, Handling::NO_SEED, pushes);
            prop_assert_eq!(body.closest(vertex, p, Handling::NO_SEED), by_predicate);
        }
    }
    Ok(())
}

/// The nearest face is the hand's, and the cloth is on its outer side.
#[test]
fn cloth_inside_the_trunk_next_to_a_hand_inside_the_trunk_is_pushed_out() -> Result<(), TestCaseError> {
    let count = sphere(3, 1.0).vertices.len();
    let body = trunk_and_hand(-0.1);
    let character = character(body, &[-1, 0, 1, 2], |v| if v < count { 0 } else { 3 });
    let garment = garment(shifted(sphere(2, 0.01), Vec3::X * 0.025), 4, |_| 0);
    let body = RobustBody::new(&character, &garment);
    for (vertex, &p) in garment.rest.vertices.iter().enumerate() {
        let contact = RULE.find_contact(&body, vertex, p, Handling::NO_SEED);
        prop_assert!(contact.corrected.unwrap().length() > 0.15);
    }
    assert_packets_agree_with_single_vertices(&body, &garment)
}

#[test]
fn vertices_beyond_a_rim_are_not_pushed() {
    let (body, _) = on_one_joint(sheet(8, 8, 0.05), cube());
    assert_eq!(corrected(&body, Vec3::new(-0.02, -0.001, 0.2)), None);
    assert!(corrected(&body, Vec3::new(0.001, -0.001, 0.2)).is_some());
}

#[test]
fn vertices_leave_a_thin_limb_by_the_nearer_side() {
    let mut limb = sphere(3, 0.015);
    limb.vertices.iter_mut().for_each(|v| v.y *= 10.0);
    let (body, _) = on_one_joint(limb, cube());
    for side in [-1.0, 1.0] {
        let out = corrected(&body, Vec3::X * side * 0.002).unwrap();
        assert!((out.x * side - 0.018).abs() < 3e-4 && out.y.abs() < 1e-3, "{out}");
    }
}

#[test]
fn a_body_that_is_teleported_is_found_from_an_old_seed() {
    let ball = sphere(3, 0.15);
    let (mut body, _) = on_one_joint(ball.clone(), cube());
    let mut seed = Handling::NO_SEED;
    // Over the middle of a face: rounding would decide between two faces that are equally near.
    let p = Vec3::new(0.8, 0.5, 0.33).normalize() * 0.149;
    let before = RULE.correct(&body, 0, p, &mut seed).unwrap();
    let jump = Vec3::new(64.0, 0.0, -32.0);
    body.pose(&shifted(ball, jump).vertices);
    assert_eq!(RULE.correct(&body, 0, p, &mut seed), None);
    let after = RULE.correct(&body, 0, p + jump, &mut seed).unwrap();
    assert!((after - jump).distance(before) < 2e-5);
}

/// Two balls for a skeleton of trunk, arm, elbow and hand: the first is the trunk's, the second the
/// hand's.
fn trunk_and_hand(gap: f32) -> TriMesh {
    joined(sphere(3, 0.15), shifted(sphere(3, 0.03), Vec3::X * (0.18 + gap)))
}

#[test]
fn a_hand_does_not_push_cloth_that_the_trunk_carries() {
    let count = sphere(3, 1.0).vertices.len();
    let body = trunk_and_hand(-0.02);
    let parents = [-1, 0, 1, 2];
    let character = character(body, &parents, |v| if v < count { 0 } else { 3 });
    // Vertex 0 on the trunk, 1 on the elbow.
    let cloth = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let garment = garment(cloth, 4, |v| if v == 1 { 2 } else { 0 });
    let body = RobustBody::new(&character, &garment);
    let contact = |vertex, p| RULE.find_contact(&body, vertex, p, Handling::NO_SEED);
    // Inside the hand: the trunk's vertex sinks instead of leaving outwards.
    let p = Vec3::X * 0.17;
    assert!(contact(0, p).corrected.unwrap().x < 0.155);
    assert!(contact(1, p).corrected.is_some());
    // Inside both: faces that do not push a vertex make no fold for it.
    let out = contact(0, Vec3::X * 0.145).corrected.unwrap();
    assert!((out.length() - 0.153).abs() < 3e-4);
    // The trunk pushes sleeves.
    assert!(contact(1, Vec3::NEG_X * 0.14).corrected.is_some());
}

#[test]
fn vertices_in_folds_are_not_pushed() {
    let (body, _) = on_one_joint(
        joined(sphere(3, 0.1), shifted(sphere(3, 0.1), Vec3::X * 0.15)),
        cube(),
    );
    assert_eq!(corrected(&body, Vec3::X * 0.055), None);
    assert!(corrected(&body, Vec3::NEG_X * 0.095).is_some());
}

/// Ball of 10 cm radius as the body, and a horizontal sheet that cuts it at `height`. The sheet has
/// `side` × `side` squares and is `length` metres wide.
fn over_a_ball(side: u32, length: f32, height: f32) -> (RobustBody, TriMesh, Garment) {
    let ball = sphere(3, 0.1);
    let corner = Vec3::new(-0.5 * length, height, -0.47 * length);
    let cloth = shifted(sheet(side, side, length / side as f32), corner);
    let (body, garment) = on_one_joint(ball.clone(), cloth);
    (body, ball, garment)
}

#[test]
fn a_face_is_lifted_over_a_ball_that_comes_through_it() {
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
fn corrections_spread_over_a_few_edges_without_a_step() {
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
fn a_cloth_without_intersections_keeps_its_bits() {
    let (body, ball, garment) = over_a_ball(40, 0.8, 0.1035);
    assert_eq!(shown(&body, &ball.vertices, &garment), garment.rest.vertices);
}

#[test]
fn edges_do_not_collapse() {
    // The paper's rule moves all vertices with the same nearest body vertex to one place.
    let (body, ball, garment) = over_a_ball(60, 0.4, 0.06);
    let positions = shown(&body, &ball.vertices, &garment);
    let rest = &garment.rest.vertices;
    for [a, b] in crate::topology::edges(&garment.rest.faces)
        .into_iter()
        .map(|e| e.map(|v| v as usize))
    {
        let ratio = positions[a].distance(positions[b]) / rest[a].distance(rest[b]);
        assert!(ratio > 0.2, "an edge shrinks to {ratio} of its length");
    }
}

#[test]
fn seams_stay_closed() {
    let (body, ball, garment) = over_a_ball(20, 0.4, 0.09);
    let (_, split) = on_one_joint(ball.clone(), split(&garment.rest));
    let character = character(ball.clone(), &[-1], |_| 0);
    let of_split = shown(&RobustBody::new(&character, &split), &ball.vertices, &split);
    let whole = shown(&body, &ball.vertices, &garment);
    for (corner, &vertex) in of_split.iter().zip(garment.rest.faces.iter().flatten()) {
        assert!(corner.distance(whole[vertex as usize]) < 1e-6);
    }
}

/// Positions of a sheet of `side` × `side` squares with a collider through it, far from the body.
fn over_a_collider(side: u32, collider: Collider) -> (Vec<Vec3>, Garment) {
    let ball = sphere(2, 0.1);
    let far = Vec3::new(4.8, 0.09, -0.19);
    let (body, garment) = on_one_joint(ball.clone(), shifted(sheet(side, side, 0.4 / side as f32), far));
    let positions = shown_with_colliders(&body, &ball.vertices, &garment, &[collider]);
    (positions, garment)
}

#[test]
fn cloth_is_lifted_over_colliders_and_keeps_its_bits_beside_them() {
    let ball = Collider::sphere(0.1, Vec3::X * 5.0);
    let capsule = Collider::capsule(0.1, Vec3::new(5.0, 0.0, -0.05), Vec3::new(5.0, 0.0, 0.05));
    let mesh = Collider::mesh(
        Arc::new(Surface::build(&sphere(4, 0.1))),
        Rigid::new(glam::Quat::IDENTITY, Vec3::X * 5.0),
    );
    for (name, collider) in [("ball", ball), ("capsule", capsule), ("mesh", mesh)] {
        let (positions, garment) = over_a_collider(40, collider.clone());
        let low = positions
            .iter()
            .filter_map(|&p| collider.push_out(p, MARGIN_M - 1e-5));
        assert_eq!(low.count(), 0, "{name}");
        let pairs = || positions.iter().zip(&garment.rest.vertices);
        assert!(
            pairs().any(|(a, b)| a != b) && pairs().any(|(a, b)| a == b),
            "{name}"
        );
    }
}

#[test]
fn a_face_is_lifted_over_a_collider_that_comes_through_it() {
    let ball = Collider::sphere(0.1, Vec3::X * 5.0);
    let (positions, garment) = over_a_collider(1, ball.clone());
    for face in &garment.rest.faces {
        let corners = face.map(|v| positions[v as usize]);
        assert!(ball.push_face_out(corners, 0.0).is_none(), "{corners:?}");
    }
}

#[test]
fn cloth_stays_above_the_ground_and_outside_the_body() {
    let (body, ball, garment) = over_a_ball(40, 0.8, 0.05);
    let positions = shown_with_colliders(&body, &ball.vertices, &garment, &[Collider::ground(0.06)]);
    for p in positions {
        assert!(p.y > 0.06 + MARGIN_M - 1e-5, "{p}");
        assert!(body.surface().closest(p).unwrap().signed_distance > -1e-4);
    }
}

/// Cloth over a ball, and a second layer with waves that cut through the first.
fn two_layers(layer_of: impl Fn(usize) -> u32) -> (RobustBody, TriMesh, Garment, Layers) {
    let ball = sphere(3, 0.1);
    let corner = |y: f32| Vec3::new(-0.2, y, -0.19);
    let outer = |v: &Vec3| *v + Vec3::Y * 0.006 * (30.0 * v.x).sin();
    let mut over = shifted(sheet(30, 30, 0.4 / 30.0), corner(0.125));
    over.vertices.iter_mut().for_each(|v| *v = outer(v));
    let cloth = joined(shifted(sheet(20, 20, 0.02), corner(0.12)), over);
    let (character, garment) = (character(ball.clone(), &[-1], |_| 0), garment(cloth, 1, |_| 0));
    let layer_of_vertex = (0..garment.rest.vertices.len()).map(layer_of).collect();
    let layers = Layers::new(&character, &garment, layer_of_vertex).unwrap();
    assert_eq!(
        layers.layer_of_vertex(),
        Layers::from_components(&character, &garment).layer_of_vertex()
    );
    (RobustBody::new(&character, &garment), ball, garment, layers)
}

#[test]
fn layers_are_brought_into_order_and_stay_in_it() {
    let inner = 21 * 21;
    let (body, ball, garment, layers) = two_layers(|v| u32::from(v >= inner));
    let posed = CollisionScene {
        body: &body,
        vertices: &ball.vertices,
        colliders: &[],
        skinned: None,
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
    let at_rest = garment.rest.vertices[inner..].iter().map(height);
    assert!(at_rest.filter(|hit| hit.signed_distance < -5e-4).count() > 50);
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
    let (last, found) = (Layers::MAX_COUNT - 1, 99);
    assert_eq!(of(vec![99; vertices]), Err(LayersError::TooMany { last, found }));
}

/// Cloth of the trunk that is inside an arm beside it sinks to the trunk.
#[test]
fn cloth_inside_a_limb_sinks_towards_the_part_that_carries_it() {
    let count = sphere(3, 1.0).vertices.len();
    let parents = [-1, 0, 1, 2];
    // The arm spans 1.5 cm to 7.5 cm over the trunk.
    let body = trunk_and_hand(0.015);
    let character = character(body, &parents, |v| if v < count { 0 } else { 3 });
    let cloth = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let garment = garment(cloth, 4, |v| if v == 1 { 2 } else { 0 });
    let body = RobustBody::new(&character, &garment);
    let corrected = |vertex, x: f32| {
        RULE.find_contact(&body, vertex, Vec3::X * x, Handling::NO_SEED)
            .corrected
    };
    for x in [0.167, 0.17, 0.19, 0.21, 0.222] {
        let out = corrected(0, x).unwrap();
        // Between the arm and the trunk.
        assert!(
            out.x > 0.153 - 3e-4 && out.x < 0.165 && out.x > 0.161,
            "{x}: {out}"
        );
    }
    // Just inside the arm the correction is small: it is continuous there.
    let out = corrected(0, 0.1655).unwrap();
    assert!((out.x - 0.1645).abs() < 5e-4, "{out}");
    assert_eq!((corrected(0, 0.16), corrected(0, 0.23)), (None, None));
    // A sleeve may be pushed by the arm, and leaves it by the shortest way.
    assert!(corrected(1, 0.222).unwrap().x > 0.225);
}

#[test]
fn every_mode_corrects_by_its_own_rule() {
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
        let mut seed = Handling::NO_SEED;
        let found = handling.correct(0, p, &mut seed);
        assert_eq!(found.is_some(), expected.is_some(), "{mode:?}");
        let height = found.map_or(0.0, Vec3::length) - expected.unwrap_or(0.0);
        assert!(height.abs() < 3e-4, "{mode:?}");
        assert_eq!(handling.correct(0, Vec3::NAN, &mut seed), None);
    }
}
