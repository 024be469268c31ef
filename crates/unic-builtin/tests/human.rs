//! Contract of the procedural human: a closed and symmetric skin of the requested measures, facing
//! outward, in which every joint moves its own limb alone.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod mesh_checks;

use glam::Vec3;
use mesh_checks::*;
use std::sync::LazyLock;
use unic_builtin::{
    garments::BodyShape,
    human::{HumanError, HumanParameters, human},
};
use unic_core::{Pose, character::Character};

static DEFAULT: LazyLock<Character> = LazyLock::new(|| human(&HumanParameters::default()).unwrap());

#[test]
fn the_skin_is_one_closed_sphere_facing_outward() {
    let body = &DEFAULT.body;
    let vertices = body.vertices.len();
    assert!((5000..=8000).contains(&vertices), "{vertices} vertices");
    assert_manifold(vertices, &body.faces);
    assert_eq!(boundary_loops(&body.faces), 0);
    assert_eq!(component_count(vertices, &body.faces), 1);
    assert_eq!(euler_characteristic(vertices, &body.faces), 2);
    // An adult of this height holds 55 to 80 litres.
    let volume = volume(&body.vertices, &body.faces);
    assert!((0.05..0.08).contains(&volume), "{volume} cubic metres");
}

#[test]
fn left_mirrors_right() {
    assert_mirror_symmetric(&DEFAULT.body.vertices, &DEFAULT.body.faces);
    let joints = DEFAULT.skeleton.joints();
    for left in [1, 4, 7, 10, 13, 16, 18, 20, 22] {
        assert!(joints[left].x > 0.0);
        assert_eq!(joints[left] * Vec3::new(-1.0, 1.0, 1.0), joints[left + 1]);
    }
}

#[test]
fn triangles_are_well_shaped() {
    let angles = smallest_angles(&DEFAULT.body.vertices, &DEFAULT.body.faces);
    let share = |degrees: f32| angles.partition_point(|a| *a < degrees) as f32 / angles.len() as f32;
    eprintln!(
        "least angle {:.1}, below 30 degrees {:.2} %",
        angles[0],
        100.0 * share(30.0)
    );
    assert!(angles[0] > 5.0, "{}", angles[0]);
    assert!(share(30.0) < 0.03);
}

#[test]
fn every_joint_moves_its_own_limb_alone() {
    let (joints, weights) = (DEFAULT.skeleton.joints(), &DEFAULT.weights);
    for (v, &p) in DEFAULT.body.vertices.iter().enumerate() {
        assert!(weights.row(v).len() <= 6);
        let sum: f32 = weights.row(v).map(|(_, w)| w).sum();
        assert!((sum - 1.0).abs() < 1e-5);
        let on = |set: &[usize]| -> f32 {
            weights
                .row(v)
                .filter(|(j, _)| set.contains(j))
                .map(|(_, w)| w)
                .sum()
        };
        let is_foot = p.y < 0.1;
        let is_hand = p.x.abs() > joints[20].x + 0.03;
        if is_foot || is_hand {
            let own: &[usize] = match (is_foot, p.x > 0.0) {
                (true, true) => &[4, 7, 10],
                (true, false) => &[5, 8, 11],
                (false, true) => &[18, 20, 22],
                (false, false) => &[19, 21, 23],
            };
            assert!(on(own) > 0.999, "vertex {v} at {p}");
        }
        // The flanks below the armpits do not follow the arms, and no thigh follows the other one.
        if p.y < 1.2 {
            assert!(on(&[16, 17, 18, 19]) < 0.01, "vertex {v} at {p}");
        }
        if p.x > 0.035 {
            assert!(on(&[2, 5, 8, 11, 14, 17]) < 0.05, "vertex {v} at {p}");
        }
    }
}

#[test]
fn bending_keeps_the_volume_of_the_limbs() {
    let mut turns = vec![Vec3::ZERO; 24];
    (turns[18], turns[19]) = (Vec3::NEG_Y * 1.571, Vec3::Y * 1.571);
    (turns[4], turns[5]) = (Vec3::X * 1.571, Vec3::X * 1.571);
    let pose = Pose::from_axis_angles(Vec3::ZERO, &turns);
    let (mut world_from_joint, mut world_from_rest, mut posed) = (Vec::new(), Vec::new(), Vec::new());
    DEFAULT.skeleton.forward_kinematics(&pose, &mut world_from_joint);
    DEFAULT
        .skeleton
        .world_from_rest(&world_from_joint, &mut world_from_rest);
    DEFAULT
        .weights
        .skin(&DEFAULT.body.vertices, &world_from_rest, &mut posed);
    let faces = &DEFAULT.body.faces;
    let kept = volume(&posed, faces) / volume(&DEFAULT.body.vertices, faces);
    assert!((0.97..1.03).contains(&kept), "{kept}");
}

#[test]
fn measures_are_as_requested() {
    let asked = HumanParameters {
        height_m: 1.6,
        shoulder_width_m: 0.34,
        chest_m: 0.92,
        waist_m: 0.80,
        hip_m: 1.0,
    };
    for parameters in [HumanParameters::default(), asked] {
        let character = human(&parameters).unwrap();
        let joints = character.skeleton.joints();
        let vertices = &character.body.vertices;
        let height = |of: fn(f32, f32) -> f32| vertices.iter().map(|v| v.y).reduce(of).unwrap();
        assert!((height(f32::max) - parameters.height_m).abs() < 0.01);
        assert!(height(f32::min).abs() < 0.005);
        assert!((joints[16].x - joints[17].x - parameters.shoulder_width_m).abs() < 1e-4);
        let shape = BodyShape::new(&character).unwrap();
        let at = shape.measurements().unwrap();
        let girth = |height: f32| shape.trunk_ring(height).unwrap().circumference();
        let found = [girth(at.chest), girth(at.waist), girth(at.hip)];
        let wanted = [parameters.chest_m, parameters.waist_m, parameters.hip_m];
        eprintln!("girths {found:.3?} m, asked {wanted:.3?}, at {at:.3?}");
        for (found, wanted) in found.into_iter().zip(wanted) {
            assert!((found / wanted - 1.0).abs() < 0.05, "{found} for {wanted}");
        }
    }
}

#[test]
fn bodies_of_any_measures_are_closed() {
    let extremes = [
        (0.26, 0.75, 0.60, 0.85),
        (0.44, 1.20, 1.10, 1.15),
        (0.44, 0.75, 1.10, 0.85),
    ];
    for (shoulder_width_m, chest_m, waist_m, hip_m) in extremes {
        let body = human(&HumanParameters {
            height_m: 1.70,
            shoulder_width_m,
            chest_m,
            waist_m,
            hip_m,
        });
        let body = body.unwrap().body;
        assert_manifold(body.vertices.len(), &body.faces);
        assert_eq!(boundary_loops(&body.faces), 0);
        assert_eq!(component_count(body.vertices.len(), &body.faces), 1);
        assert_eq!(euler_characteristic(body.vertices.len(), &body.faces), 2);
    }
}

#[test]
fn the_same_parameters_give_the_same_bytes() {
    let again = human(&HumanParameters::default()).unwrap();
    assert_eq!(again, *DEFAULT);
}

#[test]
fn measures_out_of_range_are_refused() {
    let refused = human(&HumanParameters {
        waist_m: f32::NAN,
        ..Default::default()
    });
    assert!(matches!(
        refused,
        Err(HumanError::Measure { name: "waist_m", .. })
    ));
}
