//! Short motions made long.

use glam::{Quat, Vec3};
use std::ops::RangeInclusive;
use unic_core::{
    clip::Clip,
    heading::Heading,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};

/// Frames up to which every pair is compared; longer clips are searched in steps.
const FRAMES_COMPARED: usize = 700;

/// Weight of velocities beside positions in the distance of two poses, seconds.
const VELOCITY_WEIGHT: f32 = 0.1;

/// A longer cycle is taken if it closes this well beside the best: metres (a joint, root mean
/// square), and a share of the best.
const AS_GOOD: f32 = 0.005;
const AS_GOOD_SHARE: f32 = 1.2;

/// How to repeat a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeat {
    /// What is repeated.
    pub cycle: Cycle,
    /// How often it appears in the result, 1 or more.
    pub times: usize,
    /// Time on each side of a seam in which the ends are bent towards each other, seconds; half
    /// the cycle at most.
    pub blend_seconds: f32,
}

impl Default for Repeat {
    /// The best cycle, twice, blended over 0.25 s.
    fn default() -> Self {
        Self {
            cycle: Cycle::Best { least_seconds: 0.6 },
            times: 2,
            blend_seconds: 0.25,
        }
    }
}

/// A part of a motion that is repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cycle {
    /// From the first frame to the last, which are one moment.
    Whole,
    /// The longest part of at least that many seconds of those whose ends are most alike in pose and
    /// velocity, wherever they are and whichever way they face.
    Best {
        /// Shortest cycle, seconds.
        least_seconds: f32,
    },
}

/// Repeats a motion; each round goes on where the one before it ended and the way it faced.
///
/// The last frame of a round is the first of the next. Both ends are bent by cubic corrections so
/// that they meet halfway in pose and velocity; away from the seams nothing changes. Returns the
/// motion and the range of frames of `clip` that it repeats, both ends included.
///
/// Clips of fewer than three frames and zero `times` come back as they are.
pub fn looped(clip: &Clip, skeleton: &Skeleton, options: &Repeat) -> (Clip, RangeInclusive<usize>) {
    let last = clip.len().saturating_sub(1);
    if last < 2 || options.times == 0 {
        return (clip.clone(), 0..=last);
    }
    let (first, end) = match options.cycle {
        Cycle::Whole => (0, last),
        Cycle::Best { least_seconds } => best_cycle(clip, skeleton, least_seconds),
    };
    let seam = Seam::new(clip, skeleton, first, end);
    let window = (options.blend_seconds * clip.fps).min(0.5 * (end - first) as f32);
    let round: Vec<Pose> = (first..=end)
        .map(|t| seam.bent(&clip.poses[t], t - first, end - t, window, clip.fps))
        .collect();
    let mut poses = Vec::new();
    let mut world_from_round = Rigid::IDENTITY;
    for _ in 0..options.times {
        // The last frame is the next round's first, which follows or closes the motion.
        let moved = round.iter().map(|pose| seam.moved(pose, &world_from_round));
        poses.pop();
        poses.extend(moved);
        world_from_round = world_from_round * seam.next_from_round;
    }
    let frames = if clip.wind.is_empty() { 0 } else { poses.len() };
    let wind = (0..frames).map(|t| clip.wind_at(first + t % (end - first)));
    let looped = Clip {
        name: clip.name.clone(),
        fps: clip.fps,
        poses,
        ground_height: clip.ground_height,
        wind: wind.collect(),
    };
    (looped, first..=end)
}

/// Where the end of a round meets the beginning of the next.
struct Seam {
    root: usize,
    /// Bind position of the root joint.
    origin: Vec3,
    /// Moves a round to where the next one is: a turn about the vertical and a horizontal shift.
    next_from_round: Rigid,
    /// From the round's end to the next one's beginning, at the seam: root displacement, its rate a
    /// second, and for every joint the rotation vector on its right and its rate.
    shift: [Vec3; 2],
    turns: Vec<[Vec3; 2]>,
}

impl Seam {
    fn new(clip: &Clip, skeleton: &Skeleton, first: usize, end: usize) -> Self {
        let (a, b) = (&clip.poses[first], &clip.poses[end]);
        let root = skeleton.root();
        let origin = skeleton.joints()[root];
        let place = |pose: &Pose| {
            let position = pose.trans + origin;
            let ground = Vec3::new(position.x, 0.0, position.z);
            Rigid::new(Heading::start(pose.local[root]).rotation(), ground)
        };
        let mut seam = Self {
            root,
            origin,
            next_from_round: place(b) * place(a).inverse(),
            shift: [Vec3::ZERO; 2],
            turns: Vec::new(),
        };
        // One frame before the seam in this round, one after it in the next: with both the velocities.
        let next = |pose: &Pose| seam.moved(pose, &seam.next_from_round);
        let (now, after) = (next(a), next(&clip.poses[first + 1]));
        let before = &clip.poses[end - 1];
        let rate = (after.trans - now.trans) - (b.trans - before.trans);
        let shift = [now.trans - b.trans, rate * clip.fps];
        let turns = (0..b.local.len())
            .map(|j| {
                let leaving = turn(b.local[j], before.local[j]);
                let arriving = turn(now.local[j], after.local[j]);
                [turn(b.local[j], now.local[j]), (arriving + leaving) * clip.fps]
            })
            .collect();
        (seam.shift, seam.turns) = (shift, turns);
        seam
    }

    /// A pose moved as a whole.
    fn moved(&self, pose: &Pose, by: &Rigid) -> Pose {
        let mut moved = pose.clone();
        moved.trans = by.point(pose.trans + self.origin) - self.origin;
        moved.local[self.root] = (by.rotation * pose.local[self.root]).normalize();
        moved
    }

    /// A pose some frames after a seam and before the next, with both corrections: the end of a
    /// round takes half the way towards the next beginning, the beginning half the way back.
    fn bent(&self, pose: &Pose, after: usize, before: usize, window: f32, fps: f32) -> Pose {
        let mut bent = pose.clone();
        let round_from_next = self.next_from_round.rotation.inverse();
        for (frames, side) in [(before, -1.0), (after, 1.0)] {
            let Some((value, rate)) = hermite(frames as f32, window, side) else {
                continue;
            };
            // What happens at a round's beginning happens in the frame of the round before.
            let here = if side > 0.0 {
                round_from_next
            } else {
                Quat::IDENTITY
            };
            let rate = rate / fps;
            bent.trans -= here * (self.shift[0] * value * side + self.shift[1] * rate * side);
            for (local, [offset, speed]) in bent.local.iter_mut().zip(&self.turns) {
                let by = (*offset * value + *speed * rate) * -side;
                *local = (*local * Quat::from_scaled_axis(by)).normalize();
            }
        }
        bent
    }
}

/// Halves of the cubic that carries a jump and a kink of one at a seam, `frames` away from it: value
/// for the jump, and value in frames for the kink. `side` is −1 before the seam, 1 after it.
fn hermite(frames: f32, window: f32, side: f32) -> Option<(f32, f32)> {
    if frames >= window {
        return None;
    }
    let u = 1.0 - frames / window;
    let value = u * u * (3.0 - 2.0 * u);
    let slope = u * u * (u - 1.0) * window;
    Some((0.5 * value, -0.5 * side * slope))
}

/// Rotation vector that takes `from` to `to` when applied on the right, radians.
fn turn(from: Quat, to: Quat) -> Vec3 {
    let by = from.inverse() * to;
    (if by.w < 0.0 { -by } else { by }).to_scaled_axis()
}

/// First and last frame of the best cycle.
fn best_cycle(clip: &Clip, skeleton: &Skeleton, least_seconds: f32) -> (usize, usize) {
    let last = clip.len() - 1;
    let least = ((least_seconds * clip.fps).ceil() as usize).clamp(2, last);
    let features = features(clip, skeleton);
    let stride = clip.len().div_ceil(FRAMES_COMPARED);
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
    let limit = best * AS_GOOD_SHARE + AS_GOOD;
    let good = found.iter().filter(|(_, d)| *d <= limit);
    let longest = good.max_by(|(p, d), (q, e)| (p.1 - p.0).cmp(&(q.1 - q.0)).then(e.total_cmp(d)));
    longest.map_or((0, last), |(pair, _)| *pair)
}

/// Positions of the joints and their weighted velocities in the frame of the heading: the same for a
/// pose anywhere, whichever way it faces. Height counts.
fn features(clip: &Clip, skeleton: &Skeleton) -> Vec<Vec<Vec3>> {
    let mut world = Vec::new();
    let mut positions = |pose: &Pose| -> Vec<Vec3> {
        skeleton.forward_kinematics(pose, &mut world);
        world.iter().map(|w| w.translation).collect()
    };
    let frames: Vec<Vec<Vec3>> = clip.poses.iter().map(&mut positions).collect();
    let root = skeleton.root();
    let of = |t: usize| {
        let heading = Heading::start(clip.poses[t].local[root]).rotation().inverse();
        let place = Vec3::new(frames[t][root].x, 0.0, frames[t][root].z);
        let (before, after) = (t.saturating_sub(1), (t + 1).min(frames.len() - 1));
        let rate = VELOCITY_WEIGHT * clip.fps / (after - before) as f32;
        let positions = frames[t].iter().map(|p| heading * (p - place));
        let velocities = frames[after].iter().zip(&frames[before]);
        let velocities = velocities.map(|(p, q)| heading * (p - q) * rate);
        positions.chain(velocities).collect()
    };
    (0..frames.len()).map(of).collect()
}
