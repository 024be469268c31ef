//! States: restored ones continue with the same bytes, and starts reproduce given positions.

use super::*;

#[test]
fn a_reset_discards_the_state() {
    let poses = motion(10);
    for variant in variants() {
        let mut animator = Animator::new(model(&variant));
        let first = run(&mut animator, &poses);
        let state = animator.state().clone();
        assert_eq!(run(&mut animator, &poses), first, "{}", variant.name);
        assert_eq!(animator.state(), &state);
    }
}

#[test]
fn a_restored_state_continues_with_the_same_bytes() {
    let poses = motion(10);
    for variant in variants() {
        let model = model(&variant);
        // A cut at 0 is before the first step, which completes the start.
        for cut in [0, 1, 2, 5] {
            let mut animator = Animator::new(Arc::clone(&model));
            run(&mut animator, &poses[..=cut]);
            let saved = serde_json::to_string(animator.state()).unwrap();
            let at_cut = bits(animator.garment());
            let finish = |animator: &mut Animator| -> Vec<_> {
                (cut + 1..poses.len())
                    .map(|t| {
                        animator.step(&input(&poses, t)).unwrap();
                        bits(animator.garment())
                    })
                    .collect()
            };
            let expected = finish(&mut animator);
            let state: AnimatorState = serde_json::from_str(&saved).unwrap();
            for mut other in [animator, Animator::new(Arc::clone(&model))] {
                other.restore(state.clone()).unwrap();
                assert!(bits(other.garment()) == at_cut, "{}, cut at {cut}", variant.name);
                assert!(finish(&mut other) == expected, "{}, cut at {cut}", variant.name);
            }
        }
    }
}

#[test]
fn animators_that_share_a_model_are_independent() {
    let model = model(&variant("second order"));
    let (poses, mut others) = (motion(8), motion(16));
    others.reverse();
    let alone = run(&mut Animator::new(Arc::clone(&model)), &poses);
    let (mut a, mut b) = (
        Animator::new(Arc::clone(&model)),
        Animator::new(Arc::clone(&model)),
    );
    a.reset(&input(&poses, 0), Start::MeanShape).unwrap();
    b.reset(&input(&others, 0), Start::MeanShape).unwrap();
    for (t, alone) in alone.iter().enumerate().skip(1) {
        b.step(&input(&others, t)).unwrap();
        assert_eq!(a.step(&input(&poses, t)).unwrap().positions, alone);
        b.step(&input(&others, t + 7)).unwrap();
    }
}

#[test]
fn given_positions_are_reproduced_at_the_start() {
    let poses = motion(6);
    for variant in variants() {
        let model = model(&variant);
        let mut noise = Noise(2);
        let given: Vec<Vec3> = model
            .garment()
            .rest
            .vertices
            .iter()
            .map(|v| *v + noise.vector() * 0.05)
            .collect();
        let mut animator = Animator::new(Arc::clone(&model));
        // A reset must not depend on an earlier state.
        run(&mut animator, &poses);
        let found = animator
            .reset(&input(&poses, 0), Start::Positions(&given))
            .unwrap();
        let skinned = skinned(&model, &poses[0]);
        let blended = |(v, given): (usize, &Vec3)| skinned[v].lerp(*given, model.garment().share(v));
        let expected: Vec<Vec3> = given.iter().enumerate().map(blended).collect();
        assert!(
            largest_distance(found.positions, &expected) < 1e-5,
            "{}",
            variant.name
        );
    }
}

/// The prior of frame 0 is known at frame 1 only, which changes the states of frame 0. Without a
/// field and with hardly any decay, this must not move the garment.
#[test]
fn completing_the_start_moves_nothing() {
    let poses = motion(3);
    let still = [poses[0].clone(), poses[1].clone()];
    let mut parts = parts(&variant("second order"));
    let StateConfig::Displacement(config) = &mut parts.config.state else {
        unreachable!()
    };
    // d_1 equals d_0 to 1 part in 30,000.
    config.memory_s = 1000.0;
    let last = parts.field.last_mut().unwrap();
    last.weight.fill(0.0);
    last.bias.fill(0.0);
    let model = Arc::new(Model::new(parts).unwrap());
    let mut reference = Reference::new(&model, &input(&still, 0));
    let mut animator = Animator::new(Arc::clone(&model));
    let start = animator
        .reset(&input(&still, 0), Start::MeanShape)
        .unwrap()
        .positions
        .to_vec();
    let expected: Vec<Vec3> = reference
        .step(&input(&still, 1))
        .iter()
        .map(|p| p.as_vec3())
        .collect();
    assert!(largest_distance(animator.step(&input(&still, 1)).unwrap().positions, &expected) < 1e-5);
    // In a body that stands still, frames 0 and 1 have the same prior.
    let stand = [poses[0].clone(), poses[0].clone()];
    animator.reset(&input(&stand, 0), Start::MeanShape).unwrap();
    let found = animator.step(&input(&stand, 1)).unwrap().positions;
    assert!(largest_distance(found, &start) < 1e-5);
}

#[test]
fn a_restored_state_shows_the_same_garment() {
    let poses = motion(6);
    for mode in MODES {
        let [mut ahead, mut restored] = [(); 2].map(|()| Animator::new(tight("second order")));
        ahead.set_intersection(mode);
        restored.set_intersection(mode);
        run(&mut ahead, &poses);
        restored.restore(ahead.state().clone()).unwrap();
        assert_eq!(bits(restored.garment()), bits(ahead.garment()), "{mode:?}");
    }
}

/// A start that nobody gave is not kept, and its state is as good as any.
#[test]
fn an_animator_without_a_reset_saves_and_fades() {
    let poses = motion(3);
    for variant in variants() {
        let model = model(&variant);
        let mut animator = Animator::new(Arc::clone(&model));
        assert_eq!(animator.state().start.share, 0.0, "{}", variant.name);
        let mut restored = Animator::new(model);
        restored.restore(animator.state().clone()).unwrap();
        for t in 1..poses.len() {
            let expected = animator.step(&input(&poses, t)).unwrap().positions.to_vec();
            let found = restored.step(&input(&poses, t)).unwrap().positions;
            assert_eq!(found, expected, "{}", variant.name);
        }
        assert_eq!(animator.state().start.share, 0.0, "{}", variant.name);
    }
}
