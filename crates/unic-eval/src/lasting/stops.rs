//! How does the hem come to rest after a sudden stop?

use super::{
    hem::hem,
    subject::{Carried, Subject},
};
use crate::error::Result;
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::ops::Range;
use unic_core::{animator::Start, clip::Clip, skeleton::Skeleton};
use unic_io::CapturedClip;

/// Faster is under way, slower has come to a stop, and what stands sways up to the third, m/s.
const UNDER_WAY: f32 = 1.0;
const STOPPED: f32 = 0.2;
const SWAYING: f32 = 0.25;
/// Longest from the first speed to the second, seconds: two steps of a person.
const BRAKING_S: f32 = 1.0;
/// The character stands for as long after a stop, seconds; the hem comes to rest in it.
const QUIET_S: f32 = 1.5;
/// Speeds are over this time, centred, seconds: steps shake the root.
const SPEED_S: f32 = 0.2;
/// Free running begins as long before the stop, from the true garment, seconds.
const LEAD_S: f32 = 10.0;
/// The largest swing is looked for this long after the stop, seconds.
const SWING_S: f32 = 0.5;
/// Share of the quiet time, at its end, whose mean is where the hem comes to rest.
const REST_SHARE: f64 = 1.0 / 3.0;

/// The hem after one sudden stop.
///
/// The root's speed over the ground falls from 1 m/s to 0.2 m/s within a second and stays below 0.25 m/s
/// for 1.5 s. The hem is the lowest boundary of the rest shape. With δ_i(t) the displacement of its vertex
/// i less its mean over the last half second of those 1.5 s, and t₀ the time within half a second of the
/// stop at which the RMS of δ over the hem is largest:
/// - the **decay time** is that from t₀ until the RMS of δ stays below 1/e of its value at t₀, if it does
///   before the last half second: a hem that still moves then has not come to rest;
/// - the **first overshoot** is the largest swing to the other side before the hem comes back: the RMS of δ
///   at t₀ times −min s(t) over the first stretch of s(t) = Σ_i δ_i(t)·δ_i(t₀) / Σ_i |δ_i(t₀)|² below 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stop {
    /// The clip.
    pub clip: String,
    /// Its split's name: the model may have seen it.
    pub split: &'static str,
    /// When the speed falls below 0.2 m/s, seconds into the clip.
    pub at_s: f64,
    /// Decay time, seconds; none where the hem has not come to rest.
    pub decay_s: Pair<Option<f64>>,
    /// First overshoot, mm; 0 where the hem does not swing back.
    pub overshoot_mm: Pair<f64>,
}

impl Stop {
    /// Decay times where the truth comes to rest; infinite for a prediction that does not.
    pub(super) fn decay(&self) -> Option<Pair<f64>> {
        Some(Pair {
            predicted: self.decay_s.predicted.unwrap_or(f64::INFINITY),
            truth: self.decay_s.truth?,
        })
    }
}

/// A number of the free-running prediction and of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pair<T> {
    /// Of the prediction.
    pub predicted: T,
    /// Of the truth.
    pub truth: T,
}

/// All stops in all clips.
pub(super) fn measure(subject: &mut Subject) -> Result<Vec<Stop>> {
    let mut found = Vec::new();
    let mut frames = 0;
    for (name, split) in subject.capture.manifest.splits.iter() {
        let captured = subject.capture.load_clip(name)?;
        for stop in find(subject.skeleton(), &captured.clip) {
            let first = stop.saturating_sub(frames_in(LEAD_S, captured.clip.fps));
            let end = stop + frames_in(QUIET_S, captured.clip.fps) + 1;
            frames += end - first;
            found.push((captured.clone(), split, stop, first..end));
        }
    }
    subject.begin("sudden stops", frames);
    let vertices = hem(&subject.capture.garment.rest);
    let of_stop = |(captured, split, stop, frames): (CapturedClip, unic_io::Split, usize, Range<usize>)| {
        let [predicted, truth] = swings(subject, &captured, frames, stop, &vertices)?;
        let fps = f64::from(captured.clip.fps);
        let [predicted, truth] = [Swing::of(&predicted, fps), Swing::of(&truth, fps)];
        Ok(Stop {
            clip: captured.clip.name.clone(),
            split: split.name(),
            at_s: stop as f64 / fps,
            decay_s: Pair {
                predicted: predicted.decay_s,
                truth: truth.decay_s,
            },
            overshoot_mm: Pair {
                predicted: 1e3 * predicted.overshoot,
                truth: 1e3 * truth.overshoot,
            },
        })
    };
    found.into_iter().map(of_stop).collect()
}

fn frames_in(seconds: f32, fps: f32) -> usize {
    (seconds * fps).round() as usize
}

/// The frames at which the speed falls below [`STOPPED`].
pub(super) fn find(skeleton: &Skeleton, clip: &Clip) -> Vec<usize> {
    let speeds = speeds(skeleton, clip);
    let [braking, quiet] = [BRAKING_S, QUIET_S].map(|s| frames_in(s, clip.fps));
    let mut stops = Vec::new();
    let mut frame = 1;
    while frame + quiet < speeds.len() {
        let before = &speeds[frame.saturating_sub(braking)..frame];
        let falls = speeds[frame] < STOPPED && speeds[frame - 1] >= STOPPED;
        let stays = speeds[frame..=frame + quiet].iter().all(|&v| v < SWAYING);
        if falls && stays && before.iter().any(|&v| v > UNDER_WAY) {
            stops.push(frame);
            frame += quiet;
        }
        frame += 1;
    }
    stops
}

/// Of the root over the ground, m/s, by frame.
fn speeds(skeleton: &Skeleton, clip: &Clip) -> Vec<f32> {
    let half = frames_in(SPEED_S / 2.0, clip.fps).max(1);
    let mut joints = Vec::new();
    let mut place = |pose| {
        skeleton.forward_kinematics(pose, &mut joints);
        joints[skeleton.root()].translation.with_y(0.0)
    };
    let places: Vec<Vec3> = clip.poses.iter().map(&mut place).collect();
    let speed = |frame: usize| {
        let (from, to) = (frame.saturating_sub(half), (frame + half).min(places.len() - 1));
        places[from].distance(places[to]) * clip.fps / (to - from).max(1) as f32
    };
    (0..places.len()).map(speed).collect()
}

/// Displacements of the hem from the stop to the end of the frames, by frame, metres.
type HemMotion = Vec<Vec<DVec3>>;

/// Of a free run and of the truth.
fn swings(
    subject: &mut Subject,
    captured: &CapturedClip,
    frames: Range<usize>,
    stop: usize,
    vertices: &[usize],
) -> Result<[HemMotion; 2]> {
    let (clip, garment) = (&captured.clip, &captured.garment);
    let mut carried = Carried::new(subject.capture);
    let mut motions = [Vec::new(), Vec::new()];
    let start = Start::Positions(garment.frame(frames.start));
    subject.run(clip, frames, start, &mut |frame, animator| {
        if frame < stop {
            return;
        }
        carried.pose(&clip.poses[frame]);
        let shown = [animator.garment().positions, garment.frame(frame)];
        for (motion, world) in motions.iter_mut().zip(shown) {
            let of = |&vertex: &usize| carried.displacement(vertex, world[vertex]).as_dvec3();
            motion.push(vertices.iter().map(of).collect());
        }
    })?;
    Ok(motions)
}

/// A hem that comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Swing {
    /// None where it does not come to rest in time.
    pub(super) decay_s: Option<f64>,
    /// RMS over the hem, in the unit of the displacements.
    pub(super) overshoot: f64,
}

impl Swing {
    /// Of displacements from the stop on; the last third is at rest.
    pub(super) fn of(motion: &[Vec<DVec3>], fps: f64) -> Self {
        let deviations = deviations(motion);
        let rms: Vec<f64> = deviations.iter().map(|d| product(d, d).sqrt()).collect();
        let latest = ((f64::from(SWING_S) * fps).round() as usize + 1).min(rms.len());
        let peak = (0..latest).max_by(|&a, &b| rms[a].total_cmp(&rms[b]));
        let Some(peak) = peak.filter(|&t| rms[t] > 0.0) else {
            return Self {
                decay_s: Some(0.0),
                overshoot: 0.0,
            };
        };
        let along = deviations[peak..].iter();
        let shares = along.map(|d| product(d, &deviations[peak]) / (rms[peak] * rms[peak]));
        let other_side = shares.skip_while(|s| *s >= 0.0).take_while(|s| *s < 0.0);
        let moving = rms.len() - resting(rms.len());
        Self {
            decay_s: decay(&rms[peak..])
                .filter(|frames| peak as f64 + frames <= moving as f64)
                .map(|frames| frames / fps),
            overshoot: -other_side.fold(0.0, f64::min) * rms[peak],
        }
    }
}

/// Frames at the end of so many that the hem is at rest in.
fn resting(frames: usize) -> usize {
    let share = (frames as f64 * REST_SHARE).round() as usize;
    share.max(1).min(frames)
}

/// δ by frame and vertex.
fn deviations(motion: &[Vec<DVec3>]) -> HemMotion {
    let last = &motion[motion.len() - resting(motion.len())..];
    let vertices = motion.first().map_or(0, Vec::len);
    let mean = |vertex: usize| last.iter().map(|frame| frame[vertex]).sum::<DVec3>() / last.len() as f64;
    let rest: Vec<DVec3> = (0..vertices).map(mean).collect();
    let deviation = |frame: &Vec<DVec3>| frame.iter().zip(&rest).map(|(u, r)| *u - *r).collect();
    motion.iter().map(deviation).collect()
}

/// Mean of the products of two deviations.
fn product(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>() / a.len().max(1) as f64
}

/// Frames until an amplitude stays below 1/e of its first value, interpolated; none where it does not.
fn decay(amplitude: &[f64]) -> Option<f64> {
    let level = amplitude.first()? / std::f64::consts::E;
    let above = amplitude.iter().rposition(|&a| a >= level)?;
    let below = amplitude.get(above + 1)?;
    Some(above as f64 + (amplitude[above] - level) / (amplitude[above] - below))
}
