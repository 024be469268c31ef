//! Contract of a motion state: first velocities, fallbacks, contacts, serialisation, finite
//! numbers.

use super::*;

#[test]
fn first_velocities_equal_the_second_ones_after_every_reset() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let slices = MotionSlices::new(24);
    for layout in [
        MotionLayout::Paper,
        MotionLayout::PaperRootRelative,
        MotionLayout::Heading,
    ] {
        let spec = spec(layout, VelocityScheme::Backward, 24);
        for from in [0, 40] {
            let c = streamed(&spec, &skeleton, &poses[from..from + 3], Source::Live);
            for range in [
                &slices.root_velocity,
                &slices.root_angular_velocity,
                &slices.joint_velocities,
            ] {
                assert_eq!(c[0][range.clone()], c[1][range.clone()]);
                assert_ne!(c[1][range.clone()], c[2][range.clone()]);
            }
        }
    }
}

#[test]
fn a_live_forward_scheme_falls_back_to_backward_differences() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for layout in [
        MotionLayout::Paper,
        MotionLayout::PaperRootRelative,
        MotionLayout::Heading,
    ] {
        let vectors = |velocity, source| streamed(&spec(layout, velocity, 24), &skeleton, &poses, source);
        let forward = vectors(VelocityScheme::Forward, Source::Live);
        assert_eq!(forward[1..], vectors(VelocityScheme::Backward, Source::Live)[1..]);
        assert_eq!(forward[0], vectors(VelocityScheme::Forward, Source::Clip)[0]);
    }
}

#[test]
fn frames_transform_joint_positions_back_to_the_world() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let positions = MotionSlices::new(24).joint_positions;
    for (layout, velocity) in VARIANTS {
        let spec = spec(layout, velocity, 24);
        let mut state = MotionState::start(&spec, &skeleton, &input(&poses, 0, Source::Live));
        for t in 1..40 {
            let before = state.world_from_frame();
            state.advance(&spec, &skeleton, &input(&poses, t, Source::Live));
            assert_eq!(state.previous_world_from_frame(), before);
        }
        let (before, now) = state.pair();
        let last = |c: &[f32]| Vec3::from_slice(&c[positions.end - 3..positions.end]);
        let world = state.world_from_frame().point(last(now));
        assert!((world - state.world_from_joint()[23].translation).length() < 1e-5);
        let world = state.previous_world_from_frame().point(last(before));
        assert!((world - state.previous_world_from_joint()[23].translation).length() < 1e-5);
    }
}

#[test]
fn a_restored_state_continues_with_the_same_bytes() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for (layout, velocity) in VARIANTS {
        let mut spec = spec(layout, velocity, 24);
        spec.springs = springs(24);
        for saved_at in [0, 30] {
            let mut state = MotionState::start(&spec, &skeleton, &input(&poses, 0, Source::Clip));
            (1..=saved_at).for_each(|t| state.advance(&spec, &skeleton, &input(&poses, t, Source::Clip)));
            let text = serde_json::to_string(&state).unwrap();
            let mut restored: MotionState = serde_json::from_str(&text).unwrap();
            assert_eq!(restored.check(&spec, &skeleton), Ok(()));
            for t in saved_at + 1..saved_at + 20 {
                state.advance(&spec, &skeleton, &input(&poses, t, Source::Clip));
                restored.advance(&spec, &skeleton, &input(&poses, t, Source::Clip));
            }
            assert_eq!(state, restored);
        }
    }
}

#[test]
fn advancing_does_not_reallocate() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for (layout, velocity) in VARIANTS {
        let mut spec = spec(layout, velocity, 24);
        spec.springs = springs(24);
        let mut state = MotionState::start(&spec, &skeleton, &input(&poses, 0, Source::Clip));
        let buffers = |state: &MotionState| {
            let (before, now) = state.pair();
            let joints = (state.previous_world_from_joint(), state.world_from_joint());
            (
                before.as_ptr(),
                now.as_ptr(),
                joints.0.as_ptr(),
                joints.1.as_ptr(),
            )
        };
        let at_start = buffers(&state);
        (1..=2).for_each(|t| state.advance(&spec, &skeleton, &input(&poses, t, Source::Clip)));
        assert_eq!(buffers(&state), at_start);
    }
}

#[test]
fn teleports_and_steps_of_zero_seconds_give_finite_numbers() {
    let (skeleton, mut poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for pose in &mut poses[10..] {
        pose.trans += Vec3::new(1e4, -3e3, 2e4);
        pose.local[0] = Quat::from_rotation_z(std::f32::consts::PI) * pose.local[0];
    }
    for (layout, velocity) in VARIANTS {
        let mut spec = spec(layout, velocity, 24);
        spec.springs = springs(24);
        let vectors = streamed(&spec, &skeleton, &poses, Source::Clip);
        assert!(vectors.iter().flatten().all(|x| x.is_finite()));
        let mut state = MotionState::start(&spec, &skeleton, &input(&poses, 0, Source::Live));
        let frozen = MotionInput {
            dt: 0.0,
            ..input(&poses, 1, Source::Live)
        };
        state.advance(&spec, &skeleton, &frozen);
        let (before, now) = state.pair();
        assert!(before.iter().chain(now).all(|x| x.is_finite()));
    }
}

/// A root joint with a foot joint 10 cm above the ground in the bind pose.
fn foot() -> Skeleton {
    Skeleton::new(SkeletonParts {
        parents: vec![-1, 0],
        joints: vec![Vec3::Y, Vec3::Y * 0.1],
        ..SkeletonParts::default()
    })
    .unwrap()
}

/// Returns the contacts of frames 0 and 1, given offsets of the foot and heights of the ground.
fn contacts(layout: MotionLayout, offset: [Vec3; 2], ground: [f32; 2]) -> [f32; 2] {
    let skeleton = foot();
    let spec = MotionSpec {
        layout,
        velocity: VelocityScheme::Backward,
        contact_joints: [1; 4],
        contact_rest_heights_m: [0.1; 4],
        springs: JointSprings::default(),
    };
    let poses = offset.map(|trans| Pose {
        trans,
        ..skeleton.bind_pose()
    });
    let input = |t: usize| MotionInput {
        ground_height: ground[t],
        ..input(&poses, t, Source::Live)
    };
    let mut state = MotionState::start(&spec, &skeleton, &input(0));
    state.advance(&spec, &skeleton, &input(1));
    let (before, now) = state.pair();
    [before, now].map(|c| c[c.len() - 1])
}

#[test]
fn a_contact_is_slow_and_low() {
    use MotionLayout::{Heading, Paper, PaperRootRelative};
    let (at, level) = (Vec3::new, [0.0; 2]);
    let sliding = |step| [Vec3::ZERO, at(step, 0.0, 0.0)];
    assert_eq!(contacts(Heading, sliding(0.24 / 30.0), level), [1.0, 1.0]);
    assert_eq!(contacts(Heading, sliding(0.26 / 30.0), level), [0.0, 0.0]);
    for layout in [Paper, PaperRootRelative] {
        assert_eq!(contacts(layout, sliding(0.044), level), [1.0, 1.0]);
        assert_eq!(contacts(layout, sliding(0.046), level), [0.0, 0.0]);
    }
    // Each frame has its own height above its own ground.
    let landing = [at(0.0, 0.052, 0.0), at(0.0, 0.048, 0.0)];
    assert_eq!(contacts(Heading, landing, level), [0.0, 1.0]);
    assert_eq!(contacts(Heading, sliding(0.0), [0.0, -0.06]), [1.0, 0.0]);
}
