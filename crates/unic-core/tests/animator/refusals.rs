//! Refusals: unusable inputs, states and masks are errors and change nothing.

use super::*;

#[test]
fn unusable_masks_are_refused() {
    let whole = model(&variant("second order"));
    let count = whole.vertex_count();
    for mask in [
        vec![1.0; count - 1],
        vec![1.5; count],
        vec![f32::NAN; count],
        vec![-0.1; count],
    ] {
        assert!(whole.with_mask(&mask).is_err());
    }
    assert!(model(&variant("paper")).with_mask(&vec![0.5; count]).is_err());
    let twice = whole
        .with_mask(&vec![0.5; count])
        .unwrap()
        .with_mask(&vec![0.5; count])
        .unwrap();
    assert_eq!(
        twice.to_parts(),
        whole.with_mask(&vec![0.25; count]).unwrap().to_parts()
    );
}

#[test]
fn unusable_inputs_are_refused_and_change_nothing() {
    let (poses, model) = (motion(6), model(&variant("second order")));
    let mut animator = Animator::new(Arc::clone(&model));
    let expected = run(&mut animator, &poses);
    run(&mut animator, &poses[..4]);
    let (state, shown) = (animator.state().clone(), bits(animator.garment()));

    let vertices = model.vertex_count();
    let mut fewer = poses[4].clone();
    fewer.local.pop();
    let joints = AnimatorError::Joints {
        expected: JOINTS,
        found: JOINTS - 1,
    };
    let changed = |change: &dyn Fn(&mut Pose)| {
        let mut pose = poses[4].clone();
        change(&mut pose);
        pose
    };
    let bad = [
        (fewer, joints),
        (changed(&|p| p.trans.x = f32::NAN), AnimatorError::Pose),
        (changed(&|p| p.trans.y = 1e30), AnimatorError::Pose),
        (
            changed(&|p| p.local[2] = Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0)),
            AnimatorError::Pose,
        ),
        (
            changed(&|p| p.local[2] = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            AnimatorError::Pose,
        ),
    ];
    for (pose, error) in &bad {
        let alone = StepInput {
            pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        let ahead = StepInput {
            pose: &poses[4],
            next_pose: Some(pose),
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        for input in [alone, ahead] {
            assert_eq!(animator.step(&input).unwrap_err(), *error);
            assert_eq!(animator.reset(&input, Start::MeanShape).unwrap_err(), *error);
        }
    }
    for ground_height in [f32::NAN, f32::INFINITY, 1e20] {
        let input = StepInput {
            ground_height,
            wind: Vec3::ZERO,
            ..input(&poses, 4)
        };
        assert_eq!(animator.step(&input).unwrap_err(), AnimatorError::Pose);
        let input = StepInput {
            wind: Vec3::Y * ground_height,
            ..self::input(&poses, 4)
        };
        assert_eq!(animator.step(&input).unwrap_err(), AnimatorError::Pose);
    }
    let mut positions = vec![Vec3::ZERO; vertices];
    positions[7].z = f32::INFINITY;
    let count = AnimatorError::Vertices {
        expected: vertices,
        found: 3,
    };
    for (positions, error) in [
        (&positions[..], AnimatorError::Position { vertex: 7 }),
        (&positions[..3], count),
    ] {
        assert_eq!(animator.set_garment(positions).unwrap_err(), error);
        assert_eq!(
            animator
                .reset(&input(&poses, 0), Start::Positions(positions))
                .unwrap_err(),
            error
        );
    }
    let mesh = subdivided(&model.garment().rest).mesh;
    let foreign = Animator::new(Arc::new(model.with_mesh(mesh).unwrap()))
        .state()
        .clone();
    assert!(matches!(
        animator.restore(foreign),
        Err(AnimatorError::Vertices { .. })
    ));
    let kept = serde_json::to_value(&state).unwrap();
    assert!(!kept["recurrence"].as_array().unwrap().is_empty());
    for numbers in [serde_json::json!([]), serde_json::json!([1.0, 2.0])] {
        let mut foreign = kept.clone();
        foreign["recurrence"] = numbers;
        let foreign = serde_json::from_value(foreign).unwrap();
        assert!(matches!(animator.restore(foreign), Err(AnimatorError::State(_))));
    }

    assert_eq!(animator.state(), &state);
    assert!(bits(animator.garment()) == shown);
    for (t, expected) in expected.iter().enumerate().skip(4) {
        assert_eq!(animator.step(&input(&poses, t)).unwrap().positions, expected);
    }
}
