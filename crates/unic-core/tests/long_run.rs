//! Contract of long runs: ten thousand frames of a motion unlike any training motion (jumps,
//! teleports, cartwheels, frozen poses) give finite positions and normals in every frame, and
//! displacements stay within the bound of their decay.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use std::{f32::consts::TAU, sync::Arc};
use unic_core::{Animator, Corrects, IntersectionMode, Pose, Start, StepInput, config::StateConfig};

const FRAMES: usize = 10_000;
/// Frames of each phase of the motion.
const PHASE_FRAMES: usize = 100;

/// Kind of motion during a phase.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    /// Every joint swings.
    Smooth,
    /// All joints jump to other angles at its start.
    Jump,
    /// The character jumps by up to 100 km at its start.
    Teleport,
    /// The pose stays the same to the bit for a second.
    Frozen,
    /// The character makes full turns about the forward axis.
    Cartwheels,
}

const PHASES: [Phase; 5] = [
    Phase::Smooth,
    Phase::Jump,
    Phase::Teleport,
    Phase::Frozen,
    Phase::Cartwheels,
];

/// Swing of one joint.
struct Swing {
    /// Axis times amplitude, radians.
    axis: Vec3,
    /// Angular frequency, rad/s.
    frequency: f32,
    /// Phase, radians.
    phase: f32,
}

/// Random swings of all joints.
struct Swings(Vec<Swing>);

impl Swings {
    fn new(noise: &mut Noise) -> Self {
        let swing = |noise: &mut Noise| {
            let frequency = 3.0 + 2.5 * noise.number();
            Swing {
                axis: 1.5 * noise.vector(),
                frequency,
                phase: 3.0 * noise.number(),
            }
        };
        Self((0..JOINTS).map(|_| swing(noise)).collect())
    }

    /// Rotations of the joints after `t` seconds.
    fn local(&self, t: f32) -> Vec<Quat> {
        let rotation = |s: &Swing| Quat::from_scaled_axis(s.axis * (s.frequency * t + s.phase).sin());
        self.0.iter().map(rotation).collect()
    }
}

/// A motion through all phases.
fn rough_motion(seed: u64) -> Vec<Pose> {
    let mut noise = Noise(seed);
    let (mut swings, mut position) = (Swings::new(&mut noise), Vec3::ZERO);
    let mut poses: Vec<Pose> = Vec::with_capacity(FRAMES);
    for frame in 0..FRAMES {
        let (index, within) = (frame / PHASE_FRAMES, frame % PHASE_FRAMES);
        let phase = PHASES[(index * 7 + seed as usize) % PHASES.len()];
        if within == 0 {
            match phase {
                Phase::Jump => swings = Swings::new(&mut noise),
                Phase::Teleport => position = noise.vector() * 10f32.powf(2.5 * (noise.number() + 1.0)),
                _ => {}
            }
        }
        if let (Phase::Frozen, 1..30, Some(last)) = (phase, within, poses.last()) {
            poses.push(last.clone());
            continue;
        }
        let t = frame as f32 / FPS;
        let mut local = swings.local(t);
        if phase == Phase::Cartwheels {
            local[0] = Quat::from_rotation_z(TAU * within as f32 / FPS) * local[0];
        }
        let trans = position + Vec3::new((0.7 * t).sin(), 0.05 * (6.0 * t).sin(), (0.7 * t).cos());
        poses.push(Pose { trans, local });
    }
    poses
}

#[test]
fn ten_thousand_frames_of_rough_motion_stay_finite_and_bounded() {
    let poses = rough_motion(3);
    let margin_m = 0.003;
    for (name, mode) in [
        // Corrections change the state.
        ("paper", IntersectionMode::Paper { relaxation_m: 0.005 }),
        (
            "second order",
            IntersectionMode::Robust {
                margin_m,
                corrects: Corrects::Display,
            },
        ),
        (
            "second order",
            IntersectionMode::Robust {
                margin_m,
                corrects: Corrects::State,
            },
        ),
        ("short limit", IntersectionMode::Paper { relaxation_m: 0.005 }),
    ] {
        let variant = variant(name);
        let mut animator = Animator::new(model(&variant));
        animator.set_intersection(mode);
        let farthest = farthest_of(&mut animator, &poses);
        if let StateConfig::Displacement(config) = &variant.state {
            let bound = config.scale_m * config.output_limit / (1.0 - config.decay(1.0 / FPS));
            // 4 m for the character's own size, its prior, corrections, and rounding 100 km away.
            assert!(
                farthest < bound + 4.0,
                "{name}, {mode:?}: {farthest} m, bound {bound} m"
            );
        }
    }
}

/// Runs through the poses, checks that all numbers are finite, and returns the largest distance of
/// a vertex from the root, metres.
fn farthest_of(animator: &mut Animator, poses: &[Pose]) -> f32 {
    let mut farthest = 0.0f32;
    for (t, pose) in poses.iter().enumerate() {
        let input = StepInput {
            pose,
            next_pose: poses.get(t + 1),
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        let frame = match t {
            0 => animator.reset(&input, Start::MeanShape),
            _ => animator.step(&input),
        }
        .unwrap();
        let mut all = frame.positions.iter().chain(frame.normals);
        assert!(all.all(|v| v.is_finite()), "frame {t}");
        let distances = frame.positions.iter().map(|p| p.distance(pose.trans));
        farthest = distances.fold(farthest, f32::max);
    }
    farthest
}

#[test]
fn a_root_relative_model_that_diverges_stays_finite() {
    // A root-relative state sums the field's outputs, which are scaled up here.
    let variant = variant("paper");
    let mut parts = parts(&variant);
    let head = parts.field.last_mut().unwrap();
    head.weight.iter_mut().for_each(|w| *w *= 1e4);
    let model = Arc::new(unic_core::Model::new(parts).unwrap());
    let mut animator = Animator::new(model);
    let poses = motion(600);
    for frame in run(&mut animator, &poses) {
        assert!(frame.iter().all(|p| p.is_finite()));
    }
    let positions = animator.garment().positions;
    let farthest = positions.iter().map(|p| p.length()).fold(0.0, f32::max);
    assert!(farthest > 1e4, "the model does not diverge: {farthest} m");
}
