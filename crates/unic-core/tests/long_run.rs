//! Ten thousand frames of a motion that no one would train on (jumps, teleports, cartwheels, standing
//! frozen) leave every model with numbers: positions and normals are finite in every frame, and
//! displacements stay within the bound that their decay sets.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use std::{f32::consts::TAU, sync::Arc};
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::{Corrects, IntersectionMode, StateConfig},
    skeleton::Pose,
};

const FRAMES: usize = 10_000;
/// Frames between one kind of trouble and the next.
const SPELL: usize = 100;

/// What a spell of the motion is like.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    /// Every joint swings.
    Smooth,
    /// All joints start from elsewhere.
    Jump,
    /// Another place, up to 100 km away.
    Teleport,
    /// Not a bit changes for a second.
    Frozen,
    /// Full turns about the forward axis.
    Cartwheels,
}

const TROUBLES: [Trouble; 5] = [
    Trouble::Smooth,
    Trouble::Jump,
    Trouble::Teleport,
    Trouble::Frozen,
    Trouble::Cartwheels,
];

/// Swings of random amplitude, speed and phase.
struct Swings(Vec<(Vec3, f32, f32)>);

impl Swings {
    fn new(noise: &mut Noise) -> Self {
        let swing = |noise: &mut Noise| {
            let speed = 3.0 + 2.5 * noise.number();
            (1.5 * noise.vector(), speed, 3.0 * noise.number())
        };
        Self((0..JOINTS).map(|_| swing(noise)).collect())
    }

    fn local(&self, t: f32) -> Vec<Quat> {
        let turn = |&(axis, speed, phase): &(Vec3, f32, f32)| {
            Quat::from_scaled_axis(axis * (speed * t + phase).sin())
        };
        self.0.iter().map(turn).collect()
    }
}

fn troubled_motion(seed: u64) -> Vec<Pose> {
    let mut noise = Noise(seed);
    let (mut swings, mut place) = (Swings::new(&mut noise), Vec3::ZERO);
    let mut poses: Vec<Pose> = Vec::with_capacity(FRAMES);
    for frame in 0..FRAMES {
        let (spell, within) = (frame / SPELL, frame % SPELL);
        let trouble = TROUBLES[(spell * 7 + seed as usize) % TROUBLES.len()];
        if within == 0 {
            match trouble {
                Trouble::Jump => swings = Swings::new(&mut noise),
                Trouble::Teleport => place = noise.vector() * 10f32.powf(2.5 * (noise.number() + 1.0)),
                _ => {}
            }
        }
        if let (Trouble::Frozen, 1..30, Some(last)) = (trouble, within, poses.last()) {
            poses.push(last.clone());
            continue;
        }
        let t = frame as f32 / FPS;
        let mut local = swings.local(t);
        if trouble == Trouble::Cartwheels {
            local[0] = Quat::from_rotation_z(TAU * within as f32 / FPS) * local[0];
        }
        let trans = place + Vec3::new((0.7 * t).sin(), 0.05 * (6.0 * t).sin(), (0.7 * t).cos());
        poses.push(Pose { trans, local });
    }
    poses
}

#[test]
fn ten_thousand_frames_of_trouble_stay_numbers() {
    let poses = troubled_motion(3);
    let margin_m = 0.003;
    for (name, mode) in [
        // Small corrections enter the state, as they do in a game.
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
            // The figure's own size, its prior, corrections, and rounding 100 km away.
            assert!(
                farthest < bound + 4.0,
                "{name}, {mode:?}: {farthest} m, bound {bound} m"
            );
        }
    }
}

/// Runs through the poses: all is finite. The farthest that a vertex is from the root, metres.
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
fn a_position_model_that_drifts_off_stays_numbers() {
    // The paper's state adds up what the field says: this field says ever more.
    let variant = variant("paper");
    let mut parts = parts(&variant);
    let head = parts.field.last_mut().unwrap();
    head.weight.iter_mut().for_each(|w| *w *= 1e4);
    let model = Arc::new(unic_core::model::Model::new(parts).unwrap());
    let mut animator = Animator::new(model);
    let poses = motion(600);
    for frame in run(&mut animator, &poses) {
        assert!(frame.iter().all(|p| p.is_finite()));
    }
    let positions = animator.garment().positions;
    let farthest = positions.iter().map(|p| p.length()).fold(0.0, f32::max);
    assert!(farthest > 1e4, "a model that stays tests nothing: {farthest} m");
}
