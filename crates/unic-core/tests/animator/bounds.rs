//! Bounds: displacements stay within that of their decay, and coarser precisions stay near f32.

use super::*;

/// Lengths of the states of all vertices.
fn state_lengths(animator: &Animator) -> Vec<f32> {
    let state = serde_json::to_value(animator.state()).unwrap();
    let vertices = state["vertices"].as_array().unwrap();
    let value = |v: &serde_json::Value| serde_json::from_value::<Vec3>(v["value"].clone()).unwrap();
    vertices.iter().map(|v| value(v).length()).collect()
}

#[test]
fn displacements_stay_within_their_bound_in_any_motion() {
    for name in [
        "second order",
        "short limit",
        "displacement in the paper's layout",
    ] {
        let variant = variant(name);
        let StateConfig::Displacement(config) = &variant.state else {
            unreachable!()
        };
        let bound = config.scale_m * config.output_limit / (1.0 - config.decay(1.0 / FPS));
        let mut animator = Animator::new(model(&variant));
        let mut noise = Noise(9);
        let (mut start, mut longest) = (0.0f32, 0.0f32);
        let decay = config.decay(1.0 / FPS);
        for step in 0..2000 {
            // Teleports that grow to the largest distance that is accepted.
            let reach = 10f32.powf(7.9 * step as f32 / 2000.0 - 2.0);
            let local = (0..JOINTS)
                .map(|_| Quat::from_scaled_axis(noise.vector() * 3.0))
                .collect();
            let pose = Pose {
                trans: noise.vector() * reach,
                local,
            };
            let frame = animator
                .step(&StepInput {
                    pose: &pose,
                    next_pose: None,
                    ground_height: 0.0,
                    wind: Vec3::ZERO,
                })
                .unwrap();
            assert!(
                frame.positions.iter().chain(frame.normals).all(|p| p.is_finite()),
                "{name}, step {step}"
            );
            let length = state_lengths(&animator).into_iter().fold(0.0, f32::max);
            start = if step == 0 { length } else { start * decay };
            assert!(
                length <= (start + bound) * 1.0001,
                "{name}, step {step}: {length} m, bound {bound} m"
            );
            longest = longest.max(length - start);
        }
        assert!(
            longest > 0.3 * bound,
            "{name}: {longest} m is too far below the bound of {bound} m to test it"
        );
    }
}

#[test]
fn coarser_precisions_stay_near_f32() {
    let poses = motion(12);
    for variant in variants().into_iter().filter(has_field) {
        let exact = model(&variant);
        let truth = run(&mut Animator::new(Arc::clone(&exact)), &poses);
        for (precision, metres) in [
            (Precision::Bf16, 0.02),
            (Precision::Int16, 0.002),
            (Precision::Int8, 0.05),
        ] {
            let model = Arc::new(Model::clone(&exact).with_precision(precision));
            let found = run(&mut Animator::new(model), &poses);
            let error = largest_distance(&found[11], &truth[11]);
            assert!(
                error > 0.0 && error < metres,
                "{}, {precision:?}: {error} m",
                variant.name
            );
        }
    }
}
