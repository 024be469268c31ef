//! A free run over a whole clip, kept as far as several measures look at it.

use super::subject::{Carried, Subject};
use crate::{
    error::Result,
    measure::second_difference,
    metrics::{Squared, ratio},
};
use glam::Vec3;
use unic_core::animator::{AnimatorState, Start};
use unic_io::CapturedClip;

/// Vertices whose displacements are kept, spread over the mesh by their indices.
const VERTICES: usize = 200;
/// Seconds between the states that are kept.
const EVENT_S: f32 = 5.0;
/// At most so many of them.
const EVENTS: usize = 12;

/// From the true garment of frame 0 to the clip's end.
pub(super) struct ClipRun {
    pub(super) captured: CapturedClip,
    /// By frame.
    pub(super) errors: Vec<Squared>,
    /// Displacements of a few vertices by frame, metres: predicted and true.
    pub(super) displacements: [Vec<Vec<Vec3>>; 2],
    pub(super) jitter_ratio: f64,
    /// The animator's state after some frames.
    pub(super) events: Vec<(usize, AnimatorState)>,
}

impl ClipRun {
    pub(super) fn record(subject: &mut Subject, captured: CapturedClip) -> Result<Self> {
        let (clip, garment) = (&captured.clip, &captured.garment);
        let vertices = spread(garment.vertex_count());
        let event_frames = event_frames(clip.len(), clip.fps);
        let mut carried = Carried::new(subject.capture);
        let (mut errors, mut displacements, mut events) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let mut jitter = Jitter::default();
        let start = Start::Positions(garment.frame(0));
        subject.run(clip, 0..clip.len(), start, &mut |frame, animator| {
            let (predicted, truth) = (animator.garment().positions, garment.frame(frame));
            errors.push(Squared::between(predicted, truth));
            carried.pose(&clip.poses[frame]);
            for (kept, world) in displacements.iter_mut().zip([predicted, truth]) {
                let of = |&vertex: &usize| carried.displacement(vertex, world[vertex]);
                kept.push(vertices.iter().map(of).collect());
            }
            if frame > 0 {
                jitter.add([predicted, truth]);
            }
            if event_frames.contains(&frame) {
                events.push((frame, animator.state().clone()));
            }
        })?;
        let jitter_ratio = ratio(jitter.squared);
        Ok(Self {
            captured,
            errors,
            displacements,
            jitter_ratio,
            events,
        })
    }
}

fn spread(vertices: usize) -> Vec<usize> {
    let count = vertices.min(VERTICES);
    (0..count).map(|k| k * vertices / count).collect()
}

/// Evenly spread, so that a second and three follow before and after each.
fn event_frames(len: usize, fps: f32) -> Vec<usize> {
    let at = |seconds: f32| (seconds * fps).round() as usize;
    let (first, last) = (at(1.0), len.saturating_sub(at(3.0) + 1));
    if last < first {
        return Vec::new();
    }
    let count = ((last - first) / at(EVENT_S) + 1).min(EVENTS);
    (0..count)
        .map(|k| first + (last - first) * (2 * k + 1) / (2 * count))
        .collect()
}

/// Second differences of prediction and truth, from frame 3 on as in [`crate::Metrics`].
#[derive(Default)]
struct Jitter {
    /// The last two frames of each, the latest first.
    before: [[Vec<Vec3>; 2]; 2],
    squared: [f64; 2],
}

impl Jitter {
    fn add(&mut self, now: [&[Vec3]; 2]) {
        for ((before, now), squared) in self.before.iter_mut().zip(now).zip(&mut self.squared) {
            if before[1].len() == now.len() {
                *squared += second_difference(now, [&before[0], &before[1]]);
            }
            before.swap(0, 1);
            before[0].clear();
            before[0].extend_from_slice(now);
        }
    }
}
