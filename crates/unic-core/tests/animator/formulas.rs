//! Formulas: a step agrees with the reference, anywhere in the world and on any mesh of the
//! garment.

use super::*;

/// Steps the reference and returns its positions, metres.
fn expected(reference: &mut Reference, input: &StepInput) -> Vec<Vec3> {
    reference.step(input).iter().map(|p| p.as_vec3()).collect()
}

#[test]
fn a_step_agrees_with_the_documented_formulas() {
    let poses = motion(21);
    for variant in variants_without_projection() {
        let model = model(&variant);
        let mut reference = Reference::new(&model, &input(&poses, 0));
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        let mut moved = 0.0f32;
        for t in 1..poses.len() {
            let expected = expected(&mut reference, &input(&poses, t));
            let before = animator.garment().positions.to_vec();
            let found = animator.step(&input(&poses, t)).unwrap().positions;
            let error = largest_distance(found, &expected);
            assert!(
                f64::from(error) < TOLERANCE,
                "{}, frame {t}: {error} m",
                variant.name
            );
            moved = moved.max(largest_distance(found, &before));
        }
        assert!(
            moved > 0.02,
            "{}: the garment moves too little for a test: {moved} m",
            variant.name
        );
        let limit_counts = variant.name == "short limit";
        assert!(
            !limit_counts || reference.limited > 50,
            "{} outputs limited",
            reference.limited
        );
    }
}

#[test]
fn a_step_after_set_garment_depends_on_the_given_positions() {
    let poses = motion(12);
    for variant in variants_without_projection() {
        let model = model(&variant);
        let (mut noise, rest) = (Noise(1), model.garment().rest.vertices.clone());
        let mut reference = Reference::new(&model, &input(&poses, 0));
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        for t in 1..poses.len() {
            let expected = expected(&mut reference, &input(&poses, t));
            let error = largest_distance(animator.step(&input(&poses, t)).unwrap().positions, &expected);
            assert!(
                f64::from(error) < TOLERANCE,
                "{}, frame {t}: {error} m",
                variant.name
            );
            let given: Vec<Vec3> = rest
                .iter()
                .map(|v| *v + poses[t].trans + noise.vector() * 0.03)
                .collect();
            reference.set_garment(&given);
            animator.set_garment(&given).unwrap();
            let shown = animator.garment().positions.iter().zip(&given).enumerate();
            let whole = shown.filter(|(v, _)| model.garment().share(*v) == 1.0);
            assert!(whole.fold(0.0, |largest, (_, (a, b))| a.distance(*b).max(largest)) < 1e-5);
        }
    }
}

/// Root-relative states are the same when character and garment travel through the world.
#[test]
fn root_relative_states_do_not_contain_the_distance_travelled() {
    let poses = motion(12);
    let by = |t: usize| Vec3::new(0.3, 0.05, -0.2) * t as f32;
    let far: Vec<Pose> = (poses.iter().enumerate())
        .map(|(t, pose)| Pose {
            trans: pose.trans + by(t),
            local: pose.local.clone(),
        })
        .collect();
    let relative = |v: &Variant| v.state == StateConfig::RootRelative;
    for variant in variants().into_iter().filter(relative) {
        let model = model(&variant);
        let states = |poses: &[Pose], carried: &dyn Fn(usize) -> Vec3| {
            let mut animator = Animator::new(Arc::clone(&model));
            let rest = &model.garment().rest.vertices;
            let given = |t: usize| -> Vec<Vec3> { rest.iter().map(|v| *v + carried(t)).collect() };
            animator
                .reset(&input(poses, 0), Start::Positions(&given(0)))
                .unwrap();
            for t in 1..poses.len() {
                animator.step(&input(poses, t)).unwrap();
                animator.set_garment(&given(t)).unwrap();
            }
            let values = animator.state().vertices.iter().map(|v| v.value);
            values.collect::<Vec<_>>()
        };
        let (here, there) = (states(&poses, &|_| Vec3::ZERO), states(&far, &by));
        let apart = largest_distance(&here, &there);
        assert!(apart < 1e-5, "{}: {apart} m", variant.name);
    }
}

#[test]
fn noise_on_the_code_depends_on_its_seed_and_vanishes_at_scale_zero() {
    use unic_core::CodeSampling::{Gumbel, Largest};
    let (poses, model) = (motion(12), model(&variant("one-hot code")));
    let run = |sampling| {
        let mut animator = Animator::new(Arc::clone(&model));
        animator.set_code_sampling(sampling);
        run(&mut animator, &poses)
    };
    let noisy = Gumbel { scale: 1.0, seed: 4 };
    assert_eq!(run(noisy), run(noisy));
    assert_ne!(run(noisy), run(Gumbel { scale: 1.0, seed: 5 }));
    assert_ne!(run(noisy), run(Largest));
    assert_eq!(run(Gumbel { scale: 0.0, seed: 4 }), run(Largest));
    // A restored state continues with the noise of its own ticks.
    let mut whole = Animator::new(Arc::clone(&model));
    whole.set_code_sampling(noisy);
    whole.reset(&input(&poses, 0), Start::MeanShape).unwrap();
    (1..6).for_each(|t| {
        whole.step(&input(&poses, t)).unwrap();
    });
    let mut resumed = Animator::new(Arc::clone(&model));
    resumed.set_code_sampling(noisy);
    resumed.restore(whole.state().clone()).unwrap();
    let next = input(&poses, 6);
    assert_eq!(
        whole.step(&next).unwrap().positions,
        resumed.step(&next).unwrap().positions
    );
}

#[test]
fn a_mask_of_zero_gives_skinning_and_a_mask_of_one_the_model() {
    let (poses, whole) = (motion(20), model(&variant("second order")));
    let graded: Vec<f32> = (0..whole.vertex_count())
        .map(|v| [0.0, 1.0, 0.4][v % 3])
        .collect();
    let masked = whole.with_mask(&graded).unwrap();
    let alone = run(&mut Animator::new(Arc::clone(&whole)), &poses);
    for (share, modes) in [(1.0, &MODES[..2]), (0.4, &MODES[..1]), (0.4, &MODES[3..])] {
        let model = Arc::new(masked.clone().with_sampling(share).unwrap());
        for &mode in modes {
            let mut animator = Animator::new(Arc::clone(&model));
            animator.set_intersection(mode);
            animator
                .reset(&input(&poses, 0), Start::Positions(&alone[0]))
                .unwrap();
            for t in 1..poses.len() {
                animator.set_garment(&alone[t]).unwrap();
                animator.step(&input(&poses, t)).unwrap();
                let state = animator.state().clone();
                let mut bare = Animator::new(Arc::clone(&model));
                bare.set_intersection(IntersectionMode::Off);
                let shown = bare.restore(state).unwrap().positions;
                for (v, skinned) in skinned(&model, &poses[t]).iter().enumerate().step_by(3) {
                    assert!(
                        shown[v].distance(*skinned) < 1e-6,
                        "{share}, {mode:?}, frame {t}, vertex {v}"
                    );
                }
            }
        }
    }
    let free = run(&mut Animator::new(Arc::new(masked)), &poses);
    for (free, alone) in free.iter().zip(&alone) {
        assert!((1..free.len()).step_by(3).all(|v| free[v] == alone[v]));
    }
}

#[test]
fn wind_moves_the_garment() {
    let poses = motion(20);
    for name in ["paper", "second order"] {
        let model = model(&variant(name));
        let [blown, still] = [1.0, 0.0].map(|factor| {
            let mut animator = Animator::new(Arc::clone(&model));
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
            for t in 1..poses.len() {
                let wind = wind(t) * factor;
                let input = StepInput {
                    wind,
                    ..input(&poses, t)
                };
                animator.step(&input).unwrap();
            }
            animator.garment().positions.to_vec()
        });
        let apart = largest_distance(&blown, &still);
        assert!(apart > 1e-3, "{name}: {apart} m");
    }
}

/// Turns a motion about the vertical and moves it horizontally.
fn moved(poses: &[Pose], root: Vec3, yaw: f32, by: Vec3) -> Vec<Pose> {
    let turn = Quat::from_rotation_y(yaw);
    let pose = |pose: &Pose| {
        let mut moved = pose.clone();
        moved.local[0] = turn * pose.local[0];
        moved.trans = turn * (root + pose.trans) + by - root;
        moved
    };
    poses.iter().map(pose).collect()
}

#[test]
fn the_garment_is_equivariant_to_turns_about_the_vertical_and_translation() {
    let poses = motion(40);
    for variant in variants() {
        let model = model(&variant);
        let root = model.character().skeleton.joints()[0];
        let (yaw, by) = (2.2, Vec3::new(2.0, 0.0, -3.0));
        let own = run(&mut Animator::new(Arc::clone(&model)), &poses);
        let (poses_there, mut elsewhere) = (moved(&poses, root, yaw, by), Animator::new(Arc::clone(&model)));
        let there: Vec<Vec<Vec3>> = (0..poses.len())
            .map(|t| {
                let input = StepInput {
                    wind: Quat::from_rotation_y(yaw) * wind(t),
                    ..input(&poses_there, t)
                };
                let frame = match t {
                    0 => elsewhere.reset(&input, Start::MeanShape),
                    _ => elsewhere.step(&input),
                };
                frame.unwrap().positions.to_vec()
            })
            .collect();
        for (t, (own, there)) in own.iter().zip(&there).enumerate() {
            let along: Vec<Vec3> = own.iter().map(|p| Quat::from_rotation_y(yaw) * *p + by).collect();
            let error = largest_distance(&along, there);
            assert!(error < 1e-4, "{}, frame {t}: {error} m", variant.name);
        }
    }
}

#[test]
fn another_mesh_of_the_same_garment_moves_the_same_way() {
    let poses = motion(30);
    for variant in variants_without_projection() {
        let model = model(&variant);
        let rest = model.garment().rest.clone();
        let own = run(&mut Animator::new(Arc::clone(&model)), &poses);
        let same = Arc::new(model.with_mesh(rest.clone()).unwrap());
        let Subdivided { mesh: finer, parents } = subdivided(&rest);
        let finer = Arc::new(model.with_mesh(finer).unwrap());
        assert_eq!(finer.vertex_count(), parents.len());
        let same = run(&mut Animator::new(same), &poses);
        let finer = run(&mut Animator::new(finer), &poses);
        for t in 0..poses.len() {
            let (on_same, on_finer) = (
                largest_distance(&own[t], &same[t]),
                largest_distance(&own[t], &finer[t][..rest.vertices.len()]),
            );
            assert!(
                on_same < 1e-4 && on_finer < 1e-4,
                "{}, frame {t}: {on_same} {on_finer} m",
                variant.name
            );
        }
    }
}
