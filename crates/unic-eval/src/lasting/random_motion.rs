//! Motion that nobody has recorded, and the largest displacement in it.

use super::{
    Settings,
    subject::{Carried, Subject},
};
use crate::error::Result;
use glam::{Quat, Vec2, Vec3};
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use rayon::prelude::*;
use serde::Serialize;
use std::{f32::consts::PI, ops::RangeInclusive};
use unic_core::{
    animator::{AnimatorState, Start},
    clip::Clip,
    heading::Heading,
    skeleton::{Pose, Skeleton},
};
use unic_io::{Capture, Split};

/// Names the stream of random numbers; the seed makes up the rest of the generator's key.
const STREAM: &[u8; 24] = b"lasting: random motion  ";
/// Seconds from one pose to the next.
const BLEND_S: RangeInclusive<f32> = 0.3..=1.5;
/// Fastest turn about the vertical, rad/s: twice as fast as a person turns on the spot.
const TURN: f32 = 1.5 * PI;
/// Fastest way along the ground in any direction, m/s: a brisk run.
const SPEED: f32 = 4.0;
/// Poses to blend between: frames that are drawn from each clip.
const POSES_A_CLIP: usize = 200;
/// How many times the motion is cut short to see the character stand.
const ENDS: usize = 10;

/// How far a garment gets in random motion: smooth blends between random poses of all clips, 0.3 to 1.5 s
/// each, while the root turns at up to 270°/s and runs at up to 4 m/s in random directions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RandomMotion {
    /// Of the motion.
    pub seed: u64,
    /// Of the motion.
    pub frames: usize,
    /// Largest displacement of any vertex in any frame, mm.
    pub largest_mm: f64,
    /// The same over the true garments of all training clips, mm.
    pub training_largest_mm: f64,
    /// The first by the second.
    pub ratio: f64,
    /// Frames with a position that is not finite.
    pub frames_not_finite: usize,
}

/// Where the random motion stops, and the animator's state there.
pub(super) struct End {
    pub(super) pose: Pose,
    pub(super) state: AnimatorState,
}

pub(super) fn measure(subject: &mut Subject, settings: &Settings) -> Result<(RandomMotion, Vec<End>)> {
    let training = largest_in(subject.capture, Split::Train)?;
    let clip = clip(subject.capture, subject.fps(), settings)?;
    subject.begin("random motion", clip.len());
    let mut carried = Carried::new(subject.capture);
    let (mut largest, mut frames_not_finite, mut ends) = (0.0_f32, 0, Vec::new());
    subject.run(&clip, 0..clip.len(), Start::MeanShape, &mut |frame, animator| {
        carried.pose(&clip.poses[frame]);
        let found = carried.largest(animator.garment().positions);
        match found.is_finite() {
            true => largest = largest.max(found),
            false => frames_not_finite += 1,
        }
        if (frame + 1) * ENDS / clip.len() > ends.len() {
            ends.push(End {
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
    Ok((random, ends))
}

/// Largest displacement in the true garments of a split, metres.
fn largest_in(capture: &Capture, split: Split) -> Result<f32> {
    let of_clip = |name: &String| -> Result<f32> {
        let captured = capture.load_clip(name)?;
        let frames = captured.clip.poses.par_iter().enumerate();
        let largest = frames.map_init(
            || Carried::new(capture),
            |carried, (frame, pose)| {
                carried.pose(pose);
                carried.largest(captured.garment.frame(frame))
            },
        );
        Ok(largest.reduce(|| 0.0, f32::max))
    };
    let names = capture.clip_names(split).iter();
    names
        .map(of_clip)
        .try_fold(0.0, |most, found| Ok(found?.max(most)))
}

/// The random motion of a capture.
pub(super) fn clip(capture: &Capture, fps: f32, settings: &Settings) -> Result<Clip> {
    let mut generator = generator(settings.seed);
    let library = library(capture, &mut generator)?;
    let mut wanderer = Wanderer::new(&capture.character.skeleton, &library, generator, fps);
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

fn generator(seed: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..].copy_from_slice(STREAM);
    ChaCha8Rng::from_seed(key)
}

/// Random poses of all clips, each over its clip's ground and facing +Z at the origin.
fn library(capture: &Capture, generator: &mut ChaCha8Rng) -> Result<Vec<Pose>> {
    let mut poses = Vec::new();
    for (name, _) in capture.manifest.splits.iter() {
        let clip = capture.load_clip(name)?.clip;
        for _ in 0..POSES_A_CLIP.min(clip.len()) {
            let pose = &clip.poses[generator.random_range(0..clip.len())];
            poses.push(placeless(&capture.character.skeleton, pose, clip.ground_height));
        }
    }
    Ok(poses)
}

/// A pose without its heading and its place on the ground, which is at height 0.
pub(super) fn placeless(skeleton: &Skeleton, pose: &Pose, ground_height: f32) -> Pose {
    let mut local = pose.local.clone();
    let root = &mut local[skeleton.root()];
    *root = (Heading::start(*root).rotation().inverse() * *root).normalize();
    let trans = Vec3::Y * (pose.trans.y - ground_height);
    Pose { trans, local }
}

/// The pose turned by `yaw` about the vertical through its root joint and moved by `at` over the ground.
pub(super) fn placed(skeleton: &Skeleton, pose: &Pose, yaw: f32, at: Vec2) -> Pose {
    let mut placed = pose.clone();
    let root = &mut placed.local[skeleton.root()];
    *root = (Quat::from_rotation_y(yaw) * *root).normalize();
    placed.trans += Vec3::new(at.x, 0.0, at.y);
    placed
}

/// 0 to 1 with no velocity and no acceleration at either end.
pub(super) fn ease(t: f32) -> f32 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// What a blend goes from or to.
#[derive(Clone, Debug)]
struct Aim {
    pose: Pose,
    turn: f32,
    velocity: Vec2,
}

struct Wanderer<'a> {
    skeleton: &'a Skeleton,
    library: &'a [Pose],
    generator: ChaCha8Rng,
    dt: f32,
    from: Aim,
    to: Aim,
    /// Seconds since the blend began, and its length.
    clock: [f32; 2],
    yaw: f32,
    at: Vec2,
}

impl<'a> Wanderer<'a> {
    fn new(skeleton: &'a Skeleton, library: &'a [Pose], generator: ChaCha8Rng, fps: f32) -> Self {
        let still = Aim {
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
            // Over before it has begun: the first pose is drawn.
            clock: [0.0; 2],
            yaw: 0.0,
            at: Vec2::ZERO,
        }
    }

    fn next_pose(&mut self) -> Pose {
        if self.clock[0] >= self.clock[1] {
            self.from = self.draw_over(self.to.clone());
            std::mem::swap(&mut self.from, &mut self.to);
            self.clock = [0.0, self.generator.random_range(BLEND_S)];
        }
        let share = ease((self.clock[0] / self.clock[1]).min(1.0));
        let (from, to) = (&self.from, &self.to);
        self.yaw += (from.turn + (to.turn - from.turn) * share) * self.dt;
        self.at += from.velocity.lerp(to.velocity, share) * self.dt;
        let pose = from.pose.interpolate(&to.pose, share);
        self.clock[0] += self.dt;
        placed(self.skeleton, &pose, self.yaw, self.at)
    }

    /// Something new to aim at; `old` where there are no poses to draw from.
    fn draw_over(&mut self, old: Aim) -> Aim {
        if self.library.is_empty() {
            return old;
        }
        let generator = &mut self.generator;
        let pose = self.library[generator.random_range(0..self.library.len())].clone();
        let direction = generator.random_range(-PI..=PI);
        Aim {
            pose,
            turn: generator.random_range(-TURN..=TURN),
            velocity: Vec2::from_angle(direction) * generator.random_range(0.0..=SPEED),
        }
    }
}
