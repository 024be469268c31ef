//! Repeating a cycle of a short motion.

use glam::{Quat, Vec3};
use std::ops::RangeInclusive;
use unic_core::{Pose, clip::Clip, heading::Heading, skeleton::Skeleton, transform::Rigid};

/// Number of frames up to which every pair of frames is compared. Longer clips are searched in
/// steps, because the number of pairs grows with the square.
const COMPARED_FRAMES: usize = 700;

/// Weight of velocities in the distance of two poses, whose unit is metres: seconds.
const VELOCITY_WEIGHT: f32 = 0.1;

/// Tolerance within which a longer cycle is preferred to the one with the nearest ends: a root mean
/// square over joints, metres.
const DISTANCE_TOLERANCE_M: f32 = 0.005;
/// Relative part of that tolerance: a factor on the distance of the nearest ends.
const DISTANCE_FACTOR: f32 = 1.2;

/// Options of [`repeat_cycle`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeat {
    /// Part of the motion that is repeated.
    pub cycle: Cycle,
    /// Number of rounds of the cycle in the result, 1 or more.
    pub times: usize,
    /// Duration on each side of a seam in which the ends are blended, seconds. At most half of the
    /// cycle is used.
    pub blend_seconds: f32,
}

impl Default for Repeat {
    /// Two rounds of the best cycle of at least 0.6 s, blended over 0.25 s.
    fn default() -> Self {
        Self {
            cycle: Cycle::Best { min_seconds: 0.6 },
            times: 2,
            blend_seconds: 0.25,
        }
    }
}

/// Part of a motion that is repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cycle {
    /// All frames; the first and the last show the same moment of the cycle.
    Whole,
    /// The longest part whose ends are similar in pose and velocity, independent of place and
    /// heading.
    Best {
        /// Shortest duration of the cycle, seconds.
        min_seconds: f32,
    },
}

/// A motion that repeats a cycle.
#[derive(Clone, Debug)]
pub struct RepeatedMotion {
    /// The repeated motion.
    pub clip: Clip,
    /// Frames of the original motion that are repeated, both ends included.
    pub source_frames: RangeInclusive<usize>,
}

/// Repeats a cycle of a motion. Each round starts at the place and heading where the one before it
/// ended.
///
/// The last frame of a round is the first of the next. Both ends are corrected by cubic curves, so
/// that they meet halfway in pose and velocity. Frames away from the seams do not change.
///
/// A clip of fewer than three frames and `times` of zero return the clip unchanged.
pub fn repeat_cycle(clip: &Clip, skeleton: &Skeleton, options: &Repeat) -> RepeatedMotion {
    let last = clip.len().saturating_sub(1);
    if last < 2 || options.times == 0 {
        return RepeatedMotion {
            clip: clip.clone(),
            source_frames: 0..=last,
        };
    }
    let (first, end) = match options.cycle {
        Cycle::Whole => (0, last),
        Cycle::Best { min_seconds } => best_cycle(clip, skeleton, min_seconds),
    };
    let seam = Seam::new(clip, skeleton, first, end);
    // Blends of the two seams of a round must not overlap.
    let window = (options.blend_seconds * clip.fps).min(0.5 * (end - first) as f32);
    let round: Vec<Pose> = (first..=end)
        .map(|t| seam.blended(&clip.poses[t], t - first, end - t, window, clip.fps))
        .collect();
    let mut poses = Vec::new();
    let mut world_from_round = Rigid::IDENTITY;
    for _ in 0..options.times {
        // The last frame of a round and the first of the next are one: only one of them stays.
        let moved = round.iter().map(|pose| seam.moved(pose, &world_from_round));
        poses.pop();
        poses.extend(moved);
        world_from_round = world_from_round * seam.next_from_round;
    }
    let frames = if clip.wind.is_empty() { 0 } else { poses.len() };
    // The wind repeats with the cycle.
    let wind = (0..frames).map(|t| clip.wind_at(first + t % (end - first)));
    let clip = Clip {
        name: clip.name.clone(),
        fps: clip.fps,
        poses,
        ground_height: clip.ground_height,
        wind: wind.collect(),
    };
    RepeatedMotion {
        clip,
        source_frames: first..=end,
    }
}

/// Difference between the start of the next round and the end of this one.
#[derive(Clone, Copy, Debug, Default)]
struct Jump {
    /// Difference of the values.
    value: Vec3,
    /// Difference of their rates, per second.
    rate: Vec3,
}

/// Junction between the end of a round and the start of the next.
struct Seam {
    root: usize,
    /// Bind position of the root joint.
    origin: Vec3,
    /// Transform from a round to the next: a rotation about the vertical and a horizontal shift.
    next_from_round: Rigid,
    /// Jump of the root's translation, metres.
    translation: Jump,
    /// Jump of each joint's local rotation: rotation vectors that multiply from the right, radians.
    rotations: Vec<Jump>,
}

impl Seam {
    fn new(clip: &Clip, skeleton: &Skeleton, first: usize, end: usize) -> Self {
        let (a, b) = (&clip.poses[first], &clip.poses[end]);
        let root = skeleton.root();
        let origin = skeleton.joints()[root];
        // Position on the ground and heading; height and tilt stay those of the motion.
        let place = |pose: &Pose| {
            let position = pose.trans + origin;
            let ground = Vec3::new(position.x, 0.0, position.z);
            Rigid::new(Heading::start(pose.local[root]).rotation(), ground)
        };
        let mut seam = Self {
            root,
            origin,
            next_from_round: place(b) * place(a).inverse(),
            translation: Jump::default(),
            rotations: Vec::new(),
        };
        // Velocities are one-sided: one frame before the seam in this round, one after it in the
        // next.
        let next = |pose: &Pose| seam.moved(pose, &seam.next_from_round);
        let (now, after) = (next(a), next(&clip.poses[first + 1]));
        let before = &clip.poses[end - 1];
        let rate = (after.trans - now.trans) - (b.trans - before.trans);
        let translation = Jump {
            value: now.trans - b.trans,
            rate: rate * clip.fps,
        };
        let rotations = (0..b.local.len())
            .map(|j| {
                // `leaving` points backwards in time, hence the sum.
                let leaving = turn(b.local[j], before.local[j]);
                let arriving = turn(now.local[j], after.local[j]);
                Jump {
                    value: turn(b.local[j], now.local[j]),
                    rate: (arriving + leaving) * clip.fps,
                }
            })
            .collect();
        (seam.translation, seam.rotations) = (translation, rotations);
        seam
    }

    /// Moves a pose rigidly.
    fn moved(&self, pose: &Pose, by: &Rigid) -> Pose {
        let mut moved = pose.clone();
        moved.trans = by.point(pose.trans + self.origin) - self.origin;
        moved.local[self.root] = (by.rotation * pose.local[self.root]).normalize();
        moved
    }

    /// Returns a pose with the corrections of the seams around it: the end of a round moves half
    /// the way towards the next start, and the start half the way back.
    ///
    /// The pose is `after` frames behind a seam and `before` frames ahead of the next; corrections
    /// reach over `window` frames.
    fn blended(&self, pose: &Pose, after: usize, before: usize, window: f32, fps: f32) -> Pose {
        let mut blended = pose.clone();
        let round_from_next = self.next_from_round.rotation.inverse();
        for (frames, side) in [(before, -1.0), (after, 1.0)] {
            let Some(share) = BlendShare::new(frames as f32, window, side) else {
                continue;
            };
            // Jumps are known in the frame of the round before the seam. The start of a round is
            // corrected in its own frame, which is that of the next round.
            let rotation = if side > 0.0 {
                round_from_next
            } else {
                Quat::IDENTITY
            };
            let rate = share.rate / fps;
            let Jump { value: v, rate: r } = self.translation;
            blended.trans -= rotation * (v * share.value * side + r * rate * side);
            for (local, jump) in blended.local.iter_mut().zip(&self.rotations) {
                let by = (jump.value * share.value + jump.rate * rate) * -side;
                *local = (*local * Quat::from_scaled_axis(by)).normalize();
            }
        }
        blended
    }
}

/// Shares of a [`Jump`] that are corrected some frames away from a seam.
///
/// They are the cubic Hermite basis functions, halved, because each side takes half of the jump.
struct BlendShare {
    /// Factor on the jump of the values.
    value: f32,
    /// Factor on the jump of the rates, frames.
    rate: f32,
}

impl BlendShare {
    /// Returns the shares `frames` away from the seam, or `None` outside the window of `window`
    /// frames. `side` is −1 before the seam, 1 after it.
    fn new(frames: f32, window: f32, side: f32) -> Option<Self> {
        if frames >= window {
            return None;
        }
        let u = 1.0 - frames / window;
        let value = u * u * (3.0 - 2.0 * u);
        let slope = u * u * (u - 1.0) * window;
        Some(Self {
            value: 0.5 * value,
            rate: -0.5 * side * slope,
        })
    }
}

/// Returns the rotation vector that takes `from` to `to` when applied on the right, radians.
fn turn(from: Quat, to: Quat) -> Vec3 {
    let by = from.inverse() * to;
    // Of the two quaternions the one with w ≥ 0: the shorter way round.
    (if by.w < 0.0 { -by } else { by }).to_scaled_axis()
}

/// Returns the first and the last frame of the best cycle.
fn best_cycle(clip: &Clip, skeleton: &Skeleton, min_seconds: f32) -> (usize, usize) {
    let last = clip.len() - 1;
    let least = ((min_seconds * clip.fps).ceil() as usize).clamp(2, last);
    let features = features(clip, skeleton);
    let stride = clip.len().div_ceil(COMPARED_FRAMES);
    let pairs = || {
        let starts = (0..=last - least).step_by(stride);
        starts.flat_map(move |a| (a + least..=last).step_by(stride).map(move |b| (a, b)))
    };
    let distance = |&(a, b): &(usize, usize)| {
        let squares = features[a]
            .iter()
            .zip(&features[b])
            .map(|(p, q)| p.distance_squared(*q));
        (squares.sum::<f32>() / features[a].len() as f32).sqrt()
    };
    let found: Vec<((usize, usize), f32)> = pairs().map(|pair| (pair, distance(&pair))).collect();
    let best = found.iter().map(|(_, d)| *d).fold(f32::INFINITY, f32::min);
    let limit = best * DISTANCE_FACTOR + DISTANCE_TOLERANCE_M;
    let good = found.iter().filter(|(_, d)| *d <= limit);
    // The longest cycle; of equally long ones the one with the nearest ends.
    let longest = good.max_by(|(p, d), (q, e)| (p.1 - p.0).cmp(&(q.1 - q.0)).then(e.total_cmp(d)));
    longest.map_or((0, last), |(pair, _)| *pair)
}

/// Computes the features of every frame that poses are compared by: joint positions and weighted
/// velocities in the coordinate frame of the heading.
///
/// They do not depend on the place on the ground and the heading of a pose. They depend on its
/// height.
fn features(clip: &Clip, skeleton: &Skeleton) -> Vec<Vec<Vec3>> {
    let mut world = Vec::new();
    let mut positions = |pose: &Pose| -> Vec<Vec3> {
        skeleton.forward_kinematics(pose, &mut world);
        world.iter().map(|w| w.translation).collect()
    };
    let frames: Vec<Vec<Vec3>> = clip.poses.iter().map(&mut positions).collect();
    let root = skeleton.root();
    let features_of = |t: usize| {
        let heading = Heading::start(clip.poses[t].local[root]).rotation().inverse();
        // The height is kept: a crouch is not similar to a stance.
        let place = Vec3::new(frames[t][root].x, 0.0, frames[t][root].z);
        let (before, after) = (t.saturating_sub(1), (t + 1).min(frames.len() - 1));
        let rate = VELOCITY_WEIGHT * clip.fps / (after - before) as f32;
        let positions = frames[t].iter().map(|p| heading * (p - place));
        let velocities = frames[after].iter().zip(&frames[before]);
        let velocities = velocities.map(|(p, q)| heading * (p - q) * rate);
        positions.chain(velocities).collect()
    };
    (0..frames.len()).map(features_of).collect()
}
