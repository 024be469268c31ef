//! Contract: forward kinematics is right for every bind pose and order of joints, and a description
//! that is not a tree is refused.

use super::*;
use std::f32::consts::FRAC_PI_2;

fn arm(rest_pose: Vec<Vec3>) -> Skeleton {
    Skeleton::new(SkeletonParts {
        parents: vec![-1, 0, 1],
        joints: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
        rest_pose,
        ..SkeletonParts::default()
    })
    .unwrap()
}

#[test]
fn a_bent_elbow_moves_the_hand() {
    let skeleton = arm(vec![]);
    let mut pose = skeleton.bind_pose();
    pose.trans = Vec3::Y;
    pose.local[1] = Quat::from_rotation_z(FRAC_PI_2);
    let mut world = Vec::new();
    skeleton.forward_kinematics(&pose, &mut world);
    assert!((world[2].translation - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-6);
}

#[test]
fn the_bind_pose_moves_nothing_even_when_it_is_not_zero() {
    let skeleton = arm(vec![Vec3::ZERO, Vec3::new(0.1, 0.5, -0.2), Vec3::X]);
    let (mut joints, mut rest) = (Vec::new(), Vec::new());
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut joints);
    skeleton.world_from_rest(&joints, &mut rest);
    for (j, world_from_rest) in rest.iter().enumerate() {
        assert!((joints[j].translation - skeleton.joints()[j]).length() < 1e-6);
        let p = Vec3::new(0.3, -0.4, 0.5);
        assert!((world_from_rest.point(p) - p).length() < 1e-6);
    }
}

#[test]
fn the_rest_pose_is_removed_before_the_pose_is_applied() {
    // The bind pose has the elbow bent by 90°, so pose zero straightens it.
    let skeleton = Skeleton::new(SkeletonParts {
        parents: vec![-1, 0, 1],
        joints: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)],
        rest_pose: vec![Vec3::ZERO, Vec3::Z * FRAC_PI_2, Vec3::ZERO],
        ..SkeletonParts::default()
    })
    .unwrap();
    let mut world = Vec::new();
    let zero = Pose::from_axis_angles(Vec3::ZERO, &[Vec3::ZERO; 3]);
    skeleton.forward_kinematics(&zero, &mut world);
    assert!((world[2].translation - Vec3::X * 2.0).length() < 1e-6);
}

#[test]
fn children_may_precede_their_parents() {
    let skeleton = Skeleton::new(SkeletonParts {
        parents: vec![2, 0, -1],
        joints: vec![Vec3::X, Vec3::X * 2.0, Vec3::ZERO],
        ..SkeletonParts::default()
    })
    .unwrap();
    let mut pose = skeleton.bind_pose();
    pose.local[2] = Quat::from_rotation_y(FRAC_PI_2);
    let mut world = Vec::new();
    skeleton.forward_kinematics(&pose, &mut world);
    assert!((world[1].translation - Vec3::Z * -2.0).length() < 1e-6);
}

#[test]
fn descriptions_that_are_not_a_tree_are_refused() {
    let skeleton = |parents: Vec<i64>| {
        Skeleton::new(SkeletonParts {
            joints: vec![Vec3::ZERO; parents.len()],
            parents,
            ..SkeletonParts::default()
        })
    };
    assert_eq!(skeleton(vec![]), Err(SkeletonError::Roots { found: 0 }));
    assert_eq!(skeleton(vec![-1, -1]), Err(SkeletonError::Roots { found: 2 }));
    assert_eq!(skeleton(vec![-1, 2, 1]), Err(SkeletonError::Cycle { joint: 1 }));
    assert!(matches!(
        skeleton(vec![-1, 7]),
        Err(SkeletonError::Parent { parent: 7, .. })
    ));
}
