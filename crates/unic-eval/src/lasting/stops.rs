//! Sudden stops: motion of the hem until it comes to rest.

use super::{hem::hem, runner::Runner, skinned_garment::SkinnedGarment};
use crate::error::Result;
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::ops::Range;
use unic_core::{Start, clip::Clip, skeleton::Skeleton};
use unic_io::CapturedClip;

/// Least speed of a character under way, m/s.
const UNDER_WAY: f32 = 1.0;
/// Largest speed of a character that has stopped, m/s.
const STOPPED: f32 = 0.2;
/// Largest speed of a character that stands and sways, m/s.
const SWAYING: f32 = 0.25;
/// Longest time from the first speed to the second, seconds: two steps of a person.
const BRAKING_S: f32 = 1.0;
/// Time for which the character stands after a stop, seconds. The hem comes to rest in it.
const QUIET_S: f32 = 1.5;
/// Time over which speeds are measured, centred, seconds. Steps shake the root, so that shorter
/// times give false stops.
const SPEED_S: f32 = 0.2;
/// Time of free running before the stop, from a true garment, seconds.
const LEAD_S: f32 = 10.0;
/// Time after the stop within which the largest swing is found, seconds.
const SWING_S: f32 = 0.5;
/// Share of the standing time, at its end, whose mean is the position at rest.
const REST_SHARE: f64 = 1.0 / 3.0;

/// Motion of the hem after one sudden stop.
///
/// A sudden stop is one where the root's speed over the ground falls from 1 m/s to 0.2 m/s within a
/// second and stays below 0.25 m/s for 1.5 s. The hem is the lowest boundary of the rest shape.
///
/// δ_i(t) is the displacement of the hem's vertex i, less its mean over the last half second of
/// those 1.5 s. t₀ is the time within half a second of the stop at which the RMS of δ over the hem
/// is largest.
///
/// - The **decay time** is the time from t₀ until the RMS of δ stays below 1/e of its value at t₀.
///   It is undefined where this happens in the last half second: a hem that still moves then has
///   not come to rest.
/// - The **first overshoot** is the largest swing to the other side before the hem comes back: the
///   RMS of δ at t₀ times −min s(t) over the first interval with s(t) < 0, where s(t) = Σ_i
///   δ_i(t)·δ_i(t₀) / Σ_i |δ_i(t₀)|².
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stop {
    /// Name of the clip.
    pub clip: String,
    /// Name of the clip's split. A model may have been trained on the clip.
    pub split: &'static str,
    /// Time at which the speed falls below 0.2 m/s, seconds into the clip.
    pub at_s: f64,
    /// Decay time, seconds. `None` where the hem has not come to rest.
    pub decay_s: Comparison<Option<f64>>,
    /// First overshoot, mm. 0 where the hem does not swing back.
    pub overshoot_mm: Comparison<f64>,
}

impl Stop {
    /// Returns the decay times where the true hem comes to rest. That of a prediction that does not
    /// is infinite.
    pub(super) fn decay(&self) -> Option<Comparison<f64>> {
        Some(Comparison {
            predicted: self.decay_s.predicted.unwrap_or(f64::INFINITY),
            truth: self.decay_s.truth?,
        })
    }
}

/// Number of a free-running prediction and of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison<T> {
    /// Number of the prediction.
    pub predicted: T,
    /// Number of the truth.
    pub truth: T,
}

/// Measures all sudden stops in all clips.
pub(super) fn measure(runner: &mut Runner) -> Result<Vec<Stop>> {
    let mut found = Vec::new();
    let mut frames = 0;
    for (name, split) in runner.capture.manifest.splits.iter() {
        let captured = runner.capture.load_clip(name)?;
        for stop in find(runner.skeleton(), &captured.clip) {
            let first = stop.saturating_sub(frames_in(LEAD_S, captured.clip.fps));
            let end = stop + frames_in(QUIET_S, captured.clip.fps) + 1;
            frames += end - first;
            found.push((captured.clone(), split, stop, first..end));
        }
    }
    // Stops are found first, so that the progress knows the number of frames.
    runner.begin_measure("sudden stops", frames);
    let vertices = hem(&runner.capture.garment.rest);
    let of_stop = |(captured, split, stop, frames): (CapturedClip, unic_io::Split, usize, Range<usize>)| {
        let [predicted, truth] = hem_motions(runner, &captured, frames, stop, &vertices)?;
        let fps = f64::from(captured.clip.fps);
        let [predicted, truth] = [HemSwing::measure(&predicted, fps), HemSwing::measure(&truth, fps)];
        Ok(Stop {
            clip: captured.clip.name.clone(),
            split: split.name(),
            at_s: stop as f64 / fps,
            decay_s: Comparison {
                predicted: predicted.decay_s,
                truth: truth.decay_s,
            },
            overshoot_mm: Comparison {
                predicted: 1e3 * predicted.overshoot,
                truth: 1e3 * truth.overshoot,
            },
        })
    };
    found.into_iter().map(of_stop).collect()
}

/// Returns the number of frames in a time, rounded.
fn frames_in(seconds: f32, fps: f32) -> usize {
    (seconds * fps).round() as usize
}

/// Returns the frames of sudden stops, at which the speed falls below [`STOPPED`].
pub(super) fn find(skeleton: &Skeleton, clip: &Clip) -> Vec<usize> {
    let speeds = speeds(skeleton, clip);
    let [braking, quiet] = [BRAKING_S, QUIET_S].map(|s| frames_in(s, clip.fps));
    let mut stops = Vec::new();
    let mut frame = 1;
    // The character must stand for the whole quiet time within the clip.
    while frame + quiet < speeds.len() {
        let before = &speeds[frame.saturating_sub(braking)..frame];
        let falls = speeds[frame] < STOPPED && speeds[frame - 1] >= STOPPED;
        let stays = speeds[frame..=frame + quiet].iter().all(|&v| v < SWAYING);
        if falls && stays && before.iter().any(|&v| v > UNDER_WAY) {
            stops.push(frame);
            // A second stop within the quiet time would be the same one.
            frame += quiet;
        }
        frame += 1;
    }
    stops
}

/// Returns the speed of the root over the ground in each frame, m/s.
fn speeds(skeleton: &Skeleton, clip: &Clip) -> Vec<f32> {
    let half = frames_in(SPEED_S / 2.0, clip.fps).max(1);
    let mut joints = Vec::new();
    let mut place = |pose| {
        skeleton.forward_kinematics(pose, &mut joints);
        joints[skeleton.root()].translation.with_y(0.0)
    };
    let places: Vec<Vec3> = clip.poses.iter().map(&mut place).collect();
    let speed = |frame: usize| {
        // Central differences end at the first and the last frame, where the interval is shorter.
        let (from, to) = (frame.saturating_sub(half), (frame + half).min(places.len() - 1));
        places[from].distance(places[to]) * clip.fps / (to - from).max(1) as f32
    };
    (0..places.len()).map(speed).collect()
}

/// Displacements of the hem's vertices in each frame from the stop on, metres.
type HemMotion = Vec<Vec<DVec3>>;

/// Returns the motion of the hem in a free run and in the truth.
fn hem_motions(
    runner: &mut Runner,
    captured: &CapturedClip,
    frames: Range<usize>,
    stop: usize,
    vertices: &[usize],
) -> Result<[HemMotion; 2]> {
    let (clip, garment) = (&captured.clip, &captured.garment);
    let mut skinned = SkinnedGarment::new(runner.capture);
    let mut motions = [Vec::new(), Vec::new()];
    let start = Start::Positions(garment.frame(frames.start));
    runner.run(clip, frames, start, &mut |frame, animator| {
        // Only frames from the stop on are measured. Those before it let the model forget its true
        // start.
        if frame < stop {
            return;
        }
        skinned.pose(&clip.poses[frame]);
        let shown = [animator.garment().positions, garment.frame(frame)];
        for (motion, world) in motions.iter_mut().zip(shown) {
            let of = |&vertex: &usize| skinned.displacement(vertex, world[vertex]).as_dvec3();
            motion.push(vertices.iter().map(of).collect());
        }
    })?;
    Ok(motions)
}

/// Decay and overshoot of a hem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HemSwing {
    /// Decay time, seconds. `None` where the hem does not come to rest in time.
    pub(super) decay_s: Option<f64>,
    /// First overshoot as RMS over the hem, in the unit of the displacements.
    pub(super) overshoot: f64,
}

impl HemSwing {
    /// Measures displacements from the stop on. The hem is at rest in the last third.
    pub(super) fn measure(motion: &[Vec<DVec3>], fps: f64) -> Self {
        let deviations = deviations(motion);
        let rms: Vec<f64> = deviations.iter().map(|d| product(d, d).sqrt()).collect();
        let latest = ((f64::from(SWING_S) * fps).round() as usize + 1).min(rms.len());
        let peak = (0..latest).max_by(|&a, &b| rms[a].total_cmp(&rms[b]));
        // A hem that does not move at all has no largest swing.
        let Some(peak) = peak.filter(|&t| rms[t] > 0.0) else {
            return Self {
                decay_s: Some(0.0),
                overshoot: 0.0,
            };
        };
        let along = deviations[peak..].iter();
        // s(t) of the definition: 1 at the peak, negative on the other side.
        let shares = along.map(|d| product(d, &deviations[peak]) / (rms[peak] * rms[peak]));
        let other_side = shares.skip_while(|s| *s >= 0.0).take_while(|s| *s < 0.0);
        // The hem is at rest by definition in the last part, so that a decay must end before it.
        let moving = rms.len() - resting(rms.len());
        Self {
            decay_s: decay(&rms[peak..])
                .filter(|frames| peak as f64 + frames <= moving as f64)
                .map(|frames| frames / fps),
            overshoot: -other_side.fold(0.0, f64::min) * rms[peak],
        }
    }
}

/// Returns the number of frames, at the end of `frames`, in which the hem is at rest.
fn resting(frames: usize) -> usize {
    let share = (frames as f64 * REST_SHARE).round() as usize;
    share.max(1).min(frames)
}

/// Returns δ for each frame and vertex.
fn deviations(motion: &[Vec<DVec3>]) -> HemMotion {
    let last = &motion[motion.len() - resting(motion.len())..];
    let vertices = motion.first().map_or(0, Vec::len);
    let mean = |vertex: usize| last.iter().map(|frame| frame[vertex]).sum::<DVec3>() / last.len() as f64;
    let rest: Vec<DVec3> = (0..vertices).map(mean).collect();
    let deviation = |frame: &Vec<DVec3>| frame.iter().zip(&rest).map(|(u, r)| *u - *r).collect();
    motion.iter().map(deviation).collect()
}

/// Returns the mean of the products of two deviations.
fn product(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>() / a.len().max(1) as f64
}

/// Returns the number of frames until an amplitude stays below 1/e of its first value, interpolated
/// linearly. `None` where it does not.
fn decay(amplitude: &[f64]) -> Option<f64> {
    let level = amplitude.first()? / std::f64::consts::E;
    let above = amplitude.iter().rposition(|&a| a >= level)?;
    let below = amplitude.get(above + 1)?;
    // The amplitude crosses the level between `above` and the frame after it.
    Some(above as f64 + (amplitude[above] - level) / (amplitude[above] - below))
}
