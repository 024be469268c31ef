//! Contract: a rig of any names, axes and size gives the pose of the model; others are refused.

use super::*;
use crate::{skeleton::SkeletonParts, transform::Rigid};
use glam::EulerRot;

/// Pelvis, spine, head and two arms, whose bind pose is turned.
fn skeleton() -> Skeleton {
    let names = ["pelvis", "spine", "head", "L_arm", "R_arm"];
    Skeleton::new(SkeletonParts {
        names: names.map(str::to_owned).to_vec(),
        parents: vec![-1, 0, 1, 1, 1],
        joints: vec![
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(0.0, 1.3, 0.02),
            Vec3::new(0.0, 1.6, 0.0),
            Vec3::new(0.2, 1.5, 0.0),
            Vec3::new(-0.2, 1.5, 0.0),
        ],
        rest_pose: vec![
            Vec3::X * 0.1,
            Vec3::ZERO,
            Vec3::Y * 0.3,
            Vec3::Z * 0.5,
            Vec3::ZERO,
        ],
    })
    .unwrap()
}

/// A pose of the skeleton in the world.
fn posed(skeleton: &Skeleton) -> Pose {
    let mut pose = skeleton.bind_pose();
    pose.trans = Vec3::new(2.0, 0.1, -3.0);
    for (joint, local) in pose.local.iter_mut().enumerate() {
        *local *= Quat::from_euler(EulerRot::XYZ, 0.2 * joint as f32, -0.3, 0.1);
    }
    pose
}

/// Transforms of the joints in a pose, each turned in its own space, in a scaled world.
fn transforms(skeleton: &Skeleton, pose: &Pose, turn: Quat, world: Affine3A) -> Vec<Affine3A> {
    let mut joints = Vec::new();
    skeleton.forward_kinematics(pose, &mut joints);
    let own = |joint: &Rigid| Affine3A::from_rotation_translation(joint.rotation * turn, joint.translation);
    joints.iter().map(|joint| world * own(joint)).collect()
}

fn joints<'a>(names: &'a [String], places: &[Affine3A]) -> Vec<RigJoint<'a>> {
    let joint = |(name, place): (&'a String, &Affine3A)| RigJoint {
        name,
        mesh_from_joint: *place,
    };
    names.iter().zip(places).map(joint).collect()
}

fn scaled(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_scale(Vec3::new(x, y, z))
}

/// Fit of a rig with the axes of the model.
fn fit(skeleton: &Skeleton) -> RigFit {
    let places = transforms(
        skeleton,
        &skeleton.bind_pose(),
        Quat::IDENTITY,
        Affine3A::IDENTITY,
    );
    RigFit::new(skeleton, &joints(skeleton.names(), &places)).unwrap()
}

#[test]
fn axes_and_sizes_make_no_difference() {
    let skeleton = skeleton();
    let expected = posed(&skeleton);
    let turn = Quat::from_euler(EulerRot::XYZ, 0.7, -1.1, 2.0);
    let z_up = Affine3A::from_quat(Quat::from_rotation_x(FRAC_PI_2));
    // A rig in centimetres, beside the size of a giant and of a figure.
    let centimetres = scaled(100.0, 100.0, 100.0);
    for (mesh, size) in [
        (Affine3A::IDENTITY, 1.0),
        (z_up, 1.5),
        (z_up * centimetres, 0.01),
        (centimetres, 1e-3),
    ] {
        let rest = transforms(&skeleton, &skeleton.bind_pose(), turn, mesh);
        let fit = RigFit::new(&skeleton, &joints(skeleton.names(), &rest)).unwrap();
        let world = transforms(&skeleton, &expected, turn, scaled(size, size, size));
        let mut found = skeleton.bind_pose();
        let found_size = fit.pose(&skeleton, &world, &mut found).unwrap().unwrap();
        assert!((found_size / size - 1.0).abs() < 1e-4, "{found_size} for {size}");
        assert!(found.trans.distance(expected.trans) < 1e-3, "{}", found.trans);
        for (found, expected) in found.local.iter().zip(&expected.local) {
            assert!(found.dot(*expected).abs() > 1.0 - 1e-5, "size {size}");
        }
    }
}

#[test]
fn scales_that_are_not_one_positive_number_are_refused() {
    let skeleton = skeleton();
    let fit = fit(&skeleton);
    let pose = posed(&skeleton);
    for world in [
        scaled(0.0, 0.0, 0.0),
        scaled(1.0, 1.0, 0.0),
        scaled(-1.0, 1.0, 1.0),
        scaled(1.0, 1.0, 0.5),
    ] {
        let joints = transforms(&skeleton, &pose, Quat::IDENTITY, world);
        let found = fit.pose(&skeleton, &joints, &mut skeleton.bind_pose());
        let is_scale = |error: &RigError| matches!(error, RigError::Scale { joint, .. } if joint == "pelvis");
        assert!(found.as_ref().is_err_and(is_scale), "{world:?}: {found:?}");
    }
    let mut joints = transforms(&skeleton, &pose, Quat::IDENTITY, Affine3A::IDENTITY);
    joints[3] *= scaled(0.0, 0.0, 0.0);
    let found = fit.pose(&skeleton, &joints, &mut skeleton.bind_pose());
    let expected = "expected one positive scale along all axes, found 0.00, 0.00, 0.00 at the joint L_arm";
    assert_eq!(found.unwrap_err().to_string(), expected);
}

#[test]
fn joints_in_one_place_have_no_size() {
    let skeleton = skeleton();
    let joints = vec![Affine3A::IDENTITY; skeleton.len()];
    let found = fit(&skeleton).pose(&skeleton, &joints, &mut skeleton.bind_pose());
    assert_eq!(found, Ok(None));
}

#[test]
fn names_have_a_namespace_or_not_and_tips_may_be_missing() {
    let skeleton = skeleton();
    let mut places = transforms(
        &skeleton,
        &skeleton.bind_pose(),
        Quat::IDENTITY,
        Affine3A::IDENTITY,
    );
    places.push(places[0]);
    for namespace in ["", "rig:", "rig_", "Mixamo_Rig_"] {
        let mut names: Vec<String> = (skeleton.names().iter())
            .map(|name| format!("{namespace}{name}").to_uppercase())
            .collect();
        // A prop whose name ends as that of the root does.
        names.push("prop_pelvis".to_owned());
        let fit = RigFit::new(&skeleton, &joints(&names, &places)).unwrap();
        let expected = (0..skeleton.len()).map(Some);
        assert!(fit.sources().eq(expected), "namespace {namespace}");
        names[2] = "hat".to_owned();
        let fit = RigFit::new(&skeleton, &joints(&names, &places)).unwrap();
        assert_eq!(fit.sources().nth(2), Some(None), "namespace {namespace}");
    }
}

#[test]
fn rigs_that_do_not_fit_are_refused() {
    let skeleton = skeleton();
    let rest = transforms(
        &skeleton,
        &skeleton.bind_pose(),
        Quat::IDENTITY,
        Affine3A::IDENTITY,
    );
    let mut names = skeleton.names().to_vec();
    names[1] = "back".to_owned();
    let error = RigFit::new(&skeleton, &joints(&names, &rest)).unwrap_err();
    assert_eq!(error, RigError::Joints(vec!["spine".to_owned()]));

    let mut moved = rest.clone();
    moved[4].translation.y += 0.1;
    let error = RigFit::new(&skeleton, &joints(skeleton.names(), &moved)).unwrap_err();
    assert!(
        matches!(&error, RigError::RestPose { joint, .. } if joint == "R_arm"),
        "{error}"
    );

    let mut flat = rest;
    flat[4] *= scaled(1.0, 0.0, 1.0);
    let error = RigFit::new(&skeleton, &joints(skeleton.names(), &flat)).unwrap_err();
    assert!(
        matches!(&error, RigError::Scale { joint, .. } if joint == "R_arm"),
        "{error}"
    );
}
