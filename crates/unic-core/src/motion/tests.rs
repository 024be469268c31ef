//! Contract of the motion vector: every slice agrees with a reference in f64 for all layouts and
//! velocity schemes, and vectors are invariant to the motions that their layout leaves out.

mod parameters;
mod reference;
mod springs;
mod state;

use super::*;
use crate::{
    skeleton::{Pose, SMPL_PARENTS, SkeletonParts},
    transform::Rigid,
};
use glam::{Quat, Vec3};
use reference::{Motion, motion_vectors};

const VARIANTS: [(MotionLayout, VelocityScheme); 6] = [
    (MotionLayout::Paper, VelocityScheme::Forward),
    (MotionLayout::Paper, VelocityScheme::Backward),
    (MotionLayout::Heading, VelocityScheme::Forward),
    (MotionLayout::Heading, VelocityScheme::Backward),
    (MotionLayout::PaperRootRelative, VelocityScheme::Forward),
    (MotionLayout::PaperRootRelative, VelocityScheme::Backward),
];
const FRAMES: usize = 120;

/// Pseudo-random numbers in −1..1, the same on every machine.
fn noise(index: usize) -> f32 {
    let bits = (index as u64 + 1)
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .rotate_left(31);
    (bits.wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
}

fn noise_vector(index: usize) -> Vec3 {
    Vec3::new(noise(3 * index), noise(3 * index + 1), noise(3 * index + 2))
}

/// Random bones and a bind pose that is not zero.
fn skeleton(parents: &[i64]) -> Skeleton {
    let joints = parents.len();
    Skeleton::new(SkeletonParts {
        names: vec![],
        parents: parents.to_vec(),
        joints: (0..joints)
            .map(|j| noise_vector(500 + j) * 0.3 + Vec3::Y)
            .collect(),
        rest_pose: (0..joints).map(|j| noise_vector(j + 900) * 0.5).collect(),
    })
    .unwrap()
}

fn spec(layout: MotionLayout, velocity: VelocityScheme, joints: usize) -> MotionSpec {
    MotionSpec {
        layout,
        velocity,
        contact_joints: [1, joints - 1, joints / 2, 2],
        contact_rest_heights_m: [1.1, 1.4, 1.3, 1.2],
        springs: JointSprings::default(),
    }
}

/// Two springs of each joint.
fn springs(joints: usize) -> JointSprings {
    let spring = |frequency_hz, damping| Spring {
        frequency_hz,
        damping_ratio: 0.4,
        damping,
    };
    JointSprings {
        joints: (0..joints).collect(),
        springs: vec![spring(0.8, SpringDamping::Joint), spring(2.0, SpringDamping::Air)],
    }
}

/// A motion that swings every joint; joint 0 turns and tips over, and pauses make contacts.
fn motion(joints: usize) -> Motion {
    let swing = |index: usize, t: usize| {
        let time = t as f32 - 9.0 * (t as f32 / 9.0).sin();
        noise_vector(index) * (0.1 * time + index as f32).sin()
    };
    let root = |t: usize| swing(77, t) * 1.3 + Vec3::Y * 0.03 * t as f32;
    Motion {
        trans: (0..FRAMES)
            .map(|t| swing(78, t) * 0.5 + Vec3::X * 0.01 * t as f32)
            .collect(),
        axis_angles: (0..FRAMES)
            .map(|t| {
                (0..joints)
                    .map(|j| if j == 0 { root(t) } else { swing(j, t) })
                    .collect()
            })
            .collect(),
        ground: -0.2,
        dt: 1.0 / 30.0,
    }
}

impl Motion {
    fn poses(&self) -> Vec<Pose> {
        let frames = self.trans.iter().zip(&self.axis_angles);
        frames
            .map(|(&trans, aa)| Pose::from_axis_angles(trans, aa))
            .collect()
    }
}

/// Source of poses.
#[derive(Clone, Copy)]
enum Source {
    /// The next pose is known.
    Clip,
    /// The next pose is not known.
    Live,
}

fn input<'a>(poses: &'a [Pose], t: usize, source: Source) -> MotionInput<'a> {
    MotionInput {
        pose: &poses[t],
        next_pose: match source {
            Source::Clip => poses.get(t + 1),
            Source::Live => None,
        },
        ground_height: -0.2,
        dt: 1.0 / 30.0,
        wind: Vec3::ZERO,
    }
}

/// Returns the vectors c_0, c_1, ... of a clip, and checks that successive pairs overlap.
fn streamed(spec: &MotionSpec, skeleton: &Skeleton, poses: &[Pose], source: Source) -> Vec<Vec<f32>> {
    let mut state = MotionState::start(spec, skeleton, &input(poses, 0, source));
    let mut vectors: Vec<Vec<f32>> = Vec::new();
    for t in 1..poses.len() {
        state.advance(spec, skeleton, &input(poses, t, source));
        let (before, now) = state.pair();
        match vectors.last() {
            None => vectors.push(before.to_vec()),
            Some(last) => assert_eq!(last, before),
        }
        vectors.push(now.to_vec());
    }
    vectors
}

fn assert_close(found: &[Vec<f32>], expected: &[Vec<f32>], tolerance: f32) {
    assert_eq!(found.len(), expected.len());
    for (t, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert_eq!(found.len(), expected.len());
        for (i, (f, e)) in found.iter().zip(expected).enumerate() {
            assert!((f - e).abs() < tolerance, "c_{t}[{i}]: {f}, not {e}");
        }
    }
}

#[test]
fn every_slice_agrees_with_matrices_in_double_precision() {
    for parents in [&SMPL_PARENTS[..], &[2, 0, -1]] {
        let (skeleton, motion) = (skeleton(parents), motion(parents.len()));
        for (layout, velocity) in VARIANTS {
            let spec = spec(layout, velocity, parents.len());
            let found = streamed(&spec, &skeleton, &motion.poses(), Source::Clip);
            let expected: Vec<Vec<f32>> = motion_vectors(&spec, &skeleton, &motion)
                .into_iter()
                .map(|c| c.into_iter().map(|x| x as f32).collect())
                .collect();
            assert_eq!(found[0].len(), motion_len(parents.len()));
            let tolerance = match spec.layout {
                MotionLayout::Paper | MotionLayout::PaperRootRelative => 3e-6,
                // Rounding of positions, 1e-6 m, times 30 frames a second.
                MotionLayout::Heading => 5e-5,
            };
            assert_close(&found, &expected, tolerance);
            let contacts = found.iter().flat_map(|c| &c[c.len() - 4..]);
            let share = contacts.sum::<f32>() / (4 * FRAMES) as f32;
            assert!((0.02..0.95).contains(&share), "contacts {share}");
        }
    }
}

#[test]
fn slices_are_those_of_the_paper() {
    let slices = MotionSlices::new(24);
    assert_eq!(motion_len(24), 295);
    assert_eq!(slices.root_orientation, 6..12);
    assert_eq!(slices.joint_rotations, 15..153);
    assert_eq!(slices.joint_velocities, 222..291);
    assert_eq!(slices.contacts, 291..295);
    let normalised: Vec<_> = slices.normalised().collect();
    assert_eq!(normalised, [0..6, 12..15, 153..291]);
    assert_eq!(MotionSlices::new(1).contacts, 15..19);
}

/// Returns the sequence after a rigid motion of the world.
fn moved(skeleton: &Skeleton, poses: &[Pose], by: Rigid) -> Vec<Pose> {
    let (root, bind) = (skeleton.root(), skeleton.joints()[skeleton.root()]);
    let moved = |pose: &Pose| {
        let mut moved = pose.clone();
        moved.local[root] = by.rotation * pose.local[root];
        moved.trans = by.point(bind + pose.trans) - bind;
        moved
    };
    poses.iter().map(moved).collect()
}

#[test]
fn the_heading_layout_is_invariant_to_horizontal_position_and_direction() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for velocity in [VelocityScheme::Forward, VelocityScheme::Backward] {
        let spec = spec(MotionLayout::Heading, velocity, 24);
        let own = streamed(&spec, &skeleton, &poses, Source::Clip);
        let by = Rigid::new(Quat::from_rotation_y(2.2), Vec3::new(4.0, 0.0, -3.0));
        let there = streamed(&spec, &skeleton, &moved(&skeleton, &poses, by), Source::Clip);
        assert_close(&there, &own, 2e-4);
        let tipped = moved(
            &skeleton,
            &poses,
            Rigid::new(Quat::from_rotation_x(0.5), Vec3::ZERO),
        );
        assert_ne!(streamed(&spec, &skeleton, &tipped, Source::Clip), own);
    }
}

#[test]
fn the_paper_layouts_are_invariant_to_rigid_motions_of_the_sequence() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    for (layout, velocity) in VARIANTS.into_iter().filter(|v| v.0 != MotionLayout::Heading) {
        let spec = spec(layout, velocity, 24);
        let own = streamed(&spec, &skeleton, &poses, Source::Clip);
        let rotation = Quat::from_scaled_axis(Vec3::new(1.0, -2.0, 0.5));
        let by = Rigid::new(rotation, Vec3::new(4.0, 2.0, -3.0));
        let there = streamed(&spec, &skeleton, &moved(&skeleton, &poses, by), Source::Clip);
        assert_close(&there, &own, 1e-5);
    }
}

/// A translation track that is added to a clip does not change root-relative positions.
#[test]
fn root_relative_positions_do_not_contain_the_distance_travelled() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let travelling: Vec<Pose> = (poses.iter().enumerate())
        .map(|(t, pose)| Pose {
            trans: pose.trans + Vec3::new(0.05, 0.01, -0.03) * t as f32,
            local: pose.local.clone(),
        })
        .collect();
    let slices = MotionSlices::new(24);
    let positions = [slices.root_position, slices.joint_positions];
    let of = |layout, poses: &[Pose]| -> Vec<Vec<f32>> {
        let spec = spec(layout, VelocityScheme::Backward, 24);
        let vectors = streamed(&spec, &skeleton, poses, Source::Clip);
        let kept = |c: &Vec<f32>| positions.clone().map(|range| c[range].to_vec()).concat();
        vectors.iter().map(kept).collect()
    };
    let relative = MotionLayout::PaperRootRelative;
    assert_close(&of(relative, &travelling), &of(relative, &poses), 2e-6);
    let far = |c: &[Vec<f32>]| c.iter().flatten().fold(0f32, |far, x| far.max(x.abs()));
    assert!(far(&of(MotionLayout::Paper, &travelling)) > far(&of(MotionLayout::Paper, &poses)) + 1.0);
}

/// Motion at velocity v in still air has the velocities of a wind of −v, and different contacts.
#[test]
fn velocities_are_relative_to_the_air_and_contacts_to_the_ground() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let wind = Vec3::new(1.5, -0.25, -2.0);
    let carried: Vec<Pose> = (poses.iter().enumerate())
        .map(|(t, pose)| Pose {
            trans: pose.trans - wind * (t as f32 / 30.0),
            local: pose.local.clone(),
        })
        .collect();
    for (layout, velocity) in VARIANTS.into_iter().filter(|v| v.0 == MotionLayout::Heading) {
        let spec = spec(layout, velocity, 24);
        let run = |poses: &[Pose], wind: Vec3| -> Vec<Vec<f32>> {
            let of = |t: usize| MotionInput {
                wind,
                ..input(poses, t, Source::Live)
            };
            let mut state = MotionState::start(&spec, &skeleton, &of(0));
            (1..poses.len())
                .map(|t| {
                    state.advance(&spec, &skeleton, &of(t));
                    state.pair().1.to_vec()
                })
                .collect()
        };
        let (still, blown, moving) = (
            run(&poses, Vec3::ZERO),
            run(&poses, wind),
            run(&carried, Vec3::ZERO),
        );
        let slices = MotionSlices::new(24);
        for ((still, blown), moving) in still.iter().zip(&blown).zip(&moving) {
            assert_eq!(still[slices.contacts.clone()], blown[slices.contacts.clone()]);
            for velocities in [&slices.root_velocity, &slices.joint_velocities] {
                for i in velocities.clone() {
                    assert!(
                        (blown[i] - moving[i]).abs() < 2e-3,
                        "{i}: {} {}",
                        blown[i],
                        moving[i]
                    );
                }
            }
        }
        let change = (still[9][slices.root_velocity.clone()].iter())
            .zip(&blown[9][slices.root_velocity.clone()])
            .map(|(a, b)| (a - b).powi(2));
        assert!((change.sum::<f32>().sqrt() - wind.length()).abs() < 1e-3);
    }
}
