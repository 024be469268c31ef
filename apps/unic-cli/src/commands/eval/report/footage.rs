//! Frames of a clip that are kept while rows run through it: enough to show its worst seconds, wherever they are.

use super::super::moment::Moment;
use crate::{
    pictures::evenly_spread,
    worst_frames::{WorstFrame, rmse},
};
use glam::Vec3;
use std::{collections::BTreeMap, ops::Range};
use unic_eval::PreparedClip;
use unic_io::Capture;

/// Frames a second of a movie at least, where the clip has as many: slower ones do not look like motion.
const LEAST_FPS: f32 = 12.0;
/// Frames spread over the clip that pictures of the usual error are chosen from.
const SAMPLES: usize = 48;
/// Bytes of positions that one clip may keep; garments of very many vertices have shorter movies.
const MOST_BYTES: usize = 256 << 20;

/// Frames of a movie, and what of the clip they cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Plan {
    /// Consecutive frames of the clip.
    window: usize,
    /// One in so many of them is shown.
    stride: usize,
}

impl Plan {
    /// The whole clip where that leaves it [`LEAST_FPS`], else as many of its seconds as `most` frames hold then.
    fn new(len: usize, fps: f32, most: usize) -> Self {
        let all = len.saturating_sub(1);
        let largest = (fps / LEAST_FPS).floor().max(1.0) as usize;
        let stride = all.div_ceil(most.max(1)).clamp(1, largest);
        Self {
            window: all.min(most.max(1) * stride),
            stride,
        }
    }

    /// Whether a movie may show a frame.
    fn shows(self, frame: usize) -> bool {
        (frame - 1).is_multiple_of(self.stride)
    }
}

/// A frame of the two rows that are shown.
#[derive(Debug)]
struct Taken {
    model: Vec<Vec3>,
    rival: Option<Vec<Vec3>>,
}

/// One clip.
#[derive(Debug)]
pub(super) struct Footage {
    pub(super) clip: PreparedClip,
    plan: Plan,
    /// RMSE of the model, metres, from frame 1 on.
    errors: Vec<f64>,
    worst: Option<WorstFrame>,
    /// Frames that the movie may show, as long as they may be in its window.
    taken: BTreeMap<usize, Taken>,
    /// The model's positions in the frames that are spread over the clip.
    samples: BTreeMap<usize, Vec<Vec3>>,
}

impl Footage {
    /// Nothing yet; a movie of the clip has at most `most` frames.
    pub(super) fn new(clip: &PreparedClip, most: usize) -> Self {
        // Two rows on both sides of the worst frame.
        let bytes = 4 * size_of::<Vec3>() * clip.captured.garment.vertex_count().max(1);
        let most = most.min(MOST_BYTES / bytes).max(1);
        let spread = evenly_spread(clip.len().saturating_sub(1), SAMPLES);
        Self {
            plan: Plan::new(clip.len(), clip.captured.clip.fps, most),
            clip: clip.clone(),
            errors: Vec::new(),
            worst: None,
            taken: BTreeMap::new(),
            samples: spread.into_iter().map(|k| (k + 1, Vec::new())).collect(),
        }
    }

    /// A frame of the model; frames come in order, from 1 on.
    pub(super) fn add_model(&mut self, frame: usize, positions: &[Vec3]) {
        let error = rmse(positions, self.clip.captured.garment.frame(frame));
        self.errors.push(error);
        if let Some(sample) = self.samples.get_mut(&frame) {
            sample.extend_from_slice(positions);
        }
        if self
            .worst
            .as_ref()
            .is_none_or(|w| error.total_cmp(&w.rmse).is_gt())
        {
            self.worst = Some(WorstFrame {
                frame,
                rmse: error,
                positions: positions.to_vec(),
            });
        }
        if self.plan.shows(frame) {
            let model = positions.to_vec();
            self.taken.insert(frame, Taken { model, rival: None });
        }
        let (window, worst) = (self.plan.window, self.worst.as_ref().map_or(0, |w| w.frame));
        self.taken
            .retain(|&k, _| k.abs_diff(worst) < window || frame - k < window);
    }

    /// A frame of the row beside the model; it comes after the model's.
    pub(super) fn add_rival(&mut self, frame: usize, positions: &[Vec3]) {
        if let Some(taken) = self.taken.get_mut(&frame) {
            taken.rival = Some(positions.to_vec());
        }
    }

    /// The model's worst frame of the clip, and its RMSE in metres.
    pub(super) fn worst(&self) -> Option<(usize, f64)> {
        self.worst.as_ref().map(|w| (w.frame, w.rmse))
    }

    /// Frames of the clip that its movie covers: all, or those around the worst one with the largest errors.
    pub(super) fn window(&self) -> Range<usize> {
        let worst = self.worst().map_or(1, |(frame, _)| frame);
        worst_window(&self.errors, self.plan.window, worst)
    }

    /// Frames a second of the movie.
    pub(super) fn fps(&self) -> f32 {
        self.clip.captured.clip.fps / self.plan.stride as f32
    }

    /// The movie's frames in the order of time.
    pub(super) fn shots(&self, capture: &Capture) -> Vec<(Moment, Option<&[Vec3]>)> {
        let shown = self.taken.range(self.window());
        let shot =
            |(&frame, taken): (&usize, &'_ Taken)| Moment::new(capture, &self.clip, frame, &taken.model);
        shown
            .map(|entry| (shot(entry), entry.1.rival.as_deref()))
            .collect()
    }

    /// The worst frame of the clip and those at the quartiles of the error, in the order of time.
    pub(super) fn moments(&self, capture: &Capture) -> Vec<Moment> {
        let Some(worst) = &self.worst else {
            return Vec::new();
        };
        let samples: Vec<_> = self.samples.iter().filter(|(_, s)| !s.is_empty()).collect();
        let errors: Vec<f64> = samples
            .iter()
            .map(|(frame, _)| self.errors[**frame - 1])
            .collect();
        let usual = super::heat::quartiles(&errors).into_iter().map(|k| samples[k]);
        let mut chosen: BTreeMap<usize, &[Vec3]> =
            usual.map(|(frame, sample)| (*frame, sample.as_slice())).collect();
        chosen.insert(worst.frame, &worst.positions);
        let moment = |(frame, positions)| Moment::new(capture, &self.clip, frame, positions);
        chosen.into_iter().map(moment).collect()
    }
}

/// The range of `window` frames with the largest squared errors among those that hold frame `worst`; `errors` begin
/// with frame 1.
fn worst_window(errors: &[f64], window: usize, worst: usize) -> Range<usize> {
    /// A frame that has left the numbers counts as much as one that is so far off, metres.
    const MOST_M: f64 = 1e3;
    let squared = |error: &f64| {
        if error.is_finite() {
            error.min(MOST_M).powi(2)
        } else {
            MOST_M.powi(2)
        }
    };
    let end = errors.len() + 1;
    let window = window.clamp(1, errors.len().max(1));
    let last = worst.min(end.saturating_sub(window)).max(1);
    let first = (worst + 1).saturating_sub(window).max(1).min(last);
    let sum = |start: usize| -> f64 {
        let part = errors.iter().skip(start - 1).take(window);
        part.map(squared).sum()
    };
    let best = (first..=last).map(|start| (sum(start), start));
    let start = best
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(1, |(_, start)| start);
    start..(start + window).min(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_clips_are_shown_whole_and_long_ones_in_part() {
        let plan = |len, fps, most| {
            let Plan { window, stride } = Plan::new(len, fps, most);
            (window, stride)
        };
        assert_eq!(plan(150, 30.0, 270), (149, 1));
        assert_eq!(plan(480, 30.0, 270), (479, 2));
        assert_eq!(plan(480, 30.0, 135), (270, 2));
        assert_eq!(plan(3000, 60.0, 90), (450, 5));
        assert_eq!(plan(3000, 10.0, 90), (90, 1));
        assert_eq!((plan(1, 30.0, 90).0, plan(0, 30.0, 90).0), (0, 0));
    }

    #[test]
    fn a_window_holds_the_worst_frame_and_the_seconds_around_it() {
        // A peak at frame 40 of 100, steeper before it than after it.
        let error = |frame: usize| match frame {
            0..40 => 0.0,
            40 => 9.0,
            41..60 => 5.0,
            _ => 1.0,
        };
        let errors: Vec<f64> = (1..100).map(error).collect();
        assert_eq!(worst_window(&errors, 20, 40), 40..60);
        assert_eq!(worst_window(&errors, 99, 40), 1..100);
        assert_eq!(worst_window(&errors, 500, 40), 1..100);
        // At the ends of the clip.
        assert_eq!(worst_window(&[3.0, 1.0, 1.0], 2, 1), 1..3);
        assert_eq!(worst_window(&[1.0, 1.0, 3.0], 2, 3), 2..4);
        assert_eq!(worst_window(&[1.0, f64::NAN, 3.0], 2, 2), 2..4);
        assert_eq!(worst_window(&[], 5, 1), 1..1);
    }
}
