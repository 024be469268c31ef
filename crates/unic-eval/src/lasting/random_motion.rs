//! Random motion, and the largest displacement in it.

use super::{Settings, runner::Runner, skinned_garment::SkinnedGarment};
use crate::error::Result;
use glam::{Quat, Vec2, Vec3};
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use rayon::prelude::*;
use serde::Serialize;
use std::{f32::consts::PI, ops::RangeInclusive};
use unic_core::{AnimatorState, Pose, Start, clip::Clip, heading::Heading, skeleton::Skeleton};
use unic_io::{Capture, Split};

/// Name of the stream of random numbers. With the seed it is the key of the generator.
const STREAM: &[u8; 24] = b"lasting: random motion  ";
/// Duration of a blend from one pose to the next, seconds.
const BLEND_S: RangeInclusive<f32> = 0.3..=1.5;
/// Largest turning rate about the vertical, rad/s: twice that of a person who turns on the spot.
const TURN: f32 = 1.5 * PI;
/// Largest speed along the ground in any direction, m/s: a brisk run.
const SPEED: f32 = 4.0;
/// Number of poses that are drawn from each clip, to blend between.
const POSES_A_CLIP: usize = 200;
/// Number of frames at which the motion is cut short, to see the character stand.
const ENDS: usize = 10;

/// Largest displacement in random motion.
///
/// The motion blends smoothly between random poses of all clips, 0.3 to 1.5 s each. The root turns
/// at up to 270°/s and runs at up to 4 m/s in random directions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RandomMotion {
    /// Seed of the motion.
    pub seed: u64,
    /// Number of frames of the motion.
    pub frames: usize,
    /// Largest displacement of any vertex in any frame, mm.
    pub largest_mm: f64,
    /// Largest displacement of the true garments of all training clips, mm.
    pub training_largest_mm: f64,
    /// `largest_mm` / `training_largest_mm`.
    pub ratio: f64,
    /// Number of frames with a position that is not finite.
    pub frames_not_finite: usize,
}

/// Pose and animator state at which the random motion is cut short.
pub(super) struct StoppingPoint {
    pub(super) pose: Pose,
    pub(super) state: AnimatorState,
}

/// Measures the random motion. Returns also where it is cut short.
pub(super) fn measure(
    runner: &mut Runner,
    settings: &Settings,
) -> Result<(RandomMotion, Vec<StoppingPoint>)> {
    let training = largest_in(runner.capture, Split::Train)?;
    let clip = clip(runner.capture, runner.fps(), settings)?;
    runner.begin_measure("random motion", clip.len());
    let mut skinned = SkinnedGarment::new(runner.capture);
    let (mut largest, mut frames_not_finite, mut stopping_points) = (0.0_f32, 0, Vec::new());
    runner.run(&clip, 0..clip.len(), Start::MeanShape, &mut |frame, animator| {
        skinned.pose(&clip.poses[frame]);
        let found = skinned.largest_displacement(animator.garment().positions);
        // A frame that is not finite is counted, but is no largest displacement.
        match found.is_finite() {
            true => largest = largest.max(found),
            false => frames_not_finite += 1,
        }
        // Evenly spaced, the last at the end of the motion.
        if (frame + 1) * ENDS / clip.len() > stopping_points.len() {
            stopping_points.push(StoppingPoint {
                pose: clip.poses[frame].clone(),
                state: animator.state().clone(),
            });
        }
    })?;
    let random = RandomMotion {
        seed: settings.seed,
        frames: clip.len(),
        largest_mm: 1e3 * f64::from(largest),
        training_largest_mm: 1e3 * f64::from(training),
        ratio: f64::from(largest) / f64::from(training),
        frames_not_finite,
    };
    Ok((random, stopping_points))
}

/// Returns the largest displacement of the true garments of a split, metres.
fn largest_in(capture: &Capture, split: Split) -> Result<f32> {
    let of_clip = |name: &String| -> Result<f32> {
        let captured = capture.load_clip(name)?;
        let frames = captured.clip.poses.par_iter().enumerate();
        let largest = frames.map_init(
            || SkinnedGarment::new(capture),
            |skinned, (frame, pose)| {
                skinned.pose(pose);
                skinned.largest_displacement(captured.garment.frame(frame))
            },
        );
        // A maximum does not depend on the order of its terms, unlike a sum.
        Ok(largest.reduce(|| 0.0, f32::max))
    };
    let names = capture.clip_names(split).iter();
    names
        .map(of_clip)
        .try_fold(0.0, |most, found| Ok(found?.max(most)))
}

/// Makes the random motion of a capture.
pub(super) fn clip(capture: &Capture, fps: f32, settings: &Settings) -> Result<Clip> {
    // One generator serves poses and blends: the order of draws is part of the definition of a
    // seed.
    let mut generator = generator(settings.seed);
    let library = library(capture, &mut generator)?;
    let mut wanderer = RandomWalk::new(&capture.character.skeleton, &library, generator, fps);
    Ok(Clip {
        name: "random motion".into(),
        fps,
        poses: (0..settings.random_frames)
            .map(|_| wanderer.next_pose())
            .collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    })
}

/// Returns the generator of the random numbers.
fn generator(seed: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..].copy_from_slice(STREAM);
    ChaCha8Rng::from_seed(key)
}

/// Draws random poses of all clips. Each stands on the ground at the origin and faces +Z.
fn library(capture: &Capture, generator: &mut ChaCha8Rng) -> Result<Vec<Pose>> {
    let mut poses = Vec::new();
    for (name, _) in capture.manifest.splits.iter() {
        let clip = capture.load_clip(name)?.clip;
        for _ in 0..POSES_A_CLIP.min(clip.len()) {
            let pose = &clip.poses[generator.random_range(0..clip.len())];
            poses.push(at_origin(&capture.character.skeleton, pose, clip.ground_height));
        }
    }
    Ok(poses)
}

/// Returns a pose without its heading and its place on the ground. The ground is at height 0.
pub(super) fn at_origin(skeleton: &Skeleton, pose: &Pose, ground_height: f32) -> Pose {
    let mut local = pose.local.clone();
    let root = &mut local[skeleton.root()];
    *root = (Heading::start(*root).rotation().inverse() * *root).normalize();
    let trans = Vec3::Y * (pose.trans.y - ground_height);
    Pose { trans, local }
}

/// Returns a pose turned by `yaw` about the vertical through its root joint and moved by `at` over
/// the ground.
pub(super) fn moved_to(skeleton: &Skeleton, pose: &Pose, yaw: f32, at: Vec2) -> Pose {
    let mut moved_to = pose.clone();
    let root = &mut moved_to.local[skeleton.root()];
    *root = (Quat::from_rotation_y(yaw) * *root).normalize();
    moved_to.trans += Vec3::new(at.x, 0.0, at.y);
    moved_to
}

/// Returns Perlin's smootherstep of `t` in 0..1: from 0 to 1, without velocity and acceleration at
/// either end.
pub(super) fn smootherstep(t: f32) -> f32 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Start or end of a blend.
#[derive(Clone, Debug)]
struct BlendTarget {
    pose: Pose,
    /// Turning rate, rad/s.
    turn: f32,
    /// Velocity over the ground, m/s.
    velocity: Vec2,
}

/// Generator of the poses of a random motion.
struct RandomWalk<'a> {
    skeleton: &'a Skeleton,
    library: &'a [Pose],
    generator: ChaCha8Rng,
    /// Time between frames, seconds.
    dt: f32,
    from: BlendTarget,
    to: BlendTarget,
    /// Time since the blend began, seconds.
    elapsed_s: f32,
    /// Duration of the blend, seconds.
    duration_s: f32,
    yaw: f32,
    at: Vec2,
}

impl<'a> RandomWalk<'a> {
    fn new(skeleton: &'a Skeleton, library: &'a [Pose], generator: ChaCha8Rng, fps: f32) -> Self {
        let still = BlendTarget {
            pose: skeleton.bind_pose(),
            turn: 0.0,
            velocity: Vec2::ZERO,
        };
        Self {
            skeleton,
            library,
            generator,
            dt: 1.0 / fps,
            from: still.clone(),
            to: still,
            // The first blend is over at once, so that the first pose is drawn.
            elapsed_s: 0.0,
            duration_s: 0.0,
            yaw: 0.0,
            at: Vec2::ZERO,
        }
    }

    /// Returns the pose of the next frame.
    fn next_pose(&mut self) -> Pose {
        if self.elapsed_s >= self.duration_s {
            self.from = self.draw_over(self.to.clone());
            std::mem::swap(&mut self.from, &mut self.to);
            self.elapsed_s = 0.0;
            self.duration_s = self.generator.random_range(BLEND_S);
        }
        let share = smootherstep((self.elapsed_s / self.duration_s).min(1.0));
        let (from, to) = (&self.from, &self.to);
        // Turning rate and velocity are blended and then integrated, so that neither jumps between
        // blends.
        self.yaw += (from.turn + (to.turn - from.turn) * share) * self.dt;
        self.at += from.velocity.lerp(to.velocity, share) * self.dt;
        let pose = from.pose.interpolate(&to.pose, share);
        self.elapsed_s += self.dt;
        moved_to(self.skeleton, &pose, self.yaw, self.at)
    }

    /// Draws the end of the next blend. Returns `old` where there are no poses to draw from.
    fn draw_over(&mut self, old: BlendTarget) -> BlendTarget {
        if self.library.is_empty() {
            return old;
        }
        let generator = &mut self.generator;
        let pose = self.library[generator.random_range(0..self.library.len())].clone();
        let direction = generator.random_range(-PI..=PI);
        BlendTarget {
            pose,
            turn: generator.random_range(-TURN..=TURN),
            velocity: Vec2::from_angle(direction) * generator.random_range(0.0..=SPEED),
        }
    }
}
