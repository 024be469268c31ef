//! Frames of a clip that are kept while the rows run over it.
//!
//! The worst seconds of a clip are known only at its end. A recording therefore keeps the frames
//! around the worst frame so far, and drops those that can no longer be in the movie.

use crate::{
    commands::eval::frame_comparison::FrameComparison,
    pictures::evenly_spread,
    worst_frames::{WorstFrame, rmse},
};
use glam::Vec3;
use std::{collections::BTreeMap, ops::Range};
use unic_eval::PreparedClip;
use unic_io::Capture;

/// Smallest frame rate of a movie, if the clip has as much. Slower movies look like single
/// pictures.
const LEAST_FPS: f32 = 12.0;
/// Number of frames, spread over the clip, from which those at the quartiles of the error are
/// chosen.
const SAMPLES: usize = 48;
/// Bytes of positions that one clip may keep. Garments of very many vertices have shorter movies.
const MOST_BYTES: usize = 256 << 20;

/// Length and stride of a movie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct MoviePlan {
    /// Number of consecutive frames of the clip that the movie covers.
    window: usize,
    /// Distance of the frames that are shown, in frames of the clip.
    stride: usize,
}

impl MoviePlan {
    /// Plans a movie of at most `most` frames of a clip of `len` frames.
    ///
    /// The movie covers the whole clip if [`LEAST_FPS`] allows it, else as many seconds as fit.
    fn new(len: usize, fps: f32, most: usize) -> Self {
        // Frame 0 is given and never shown.
        let all = len.saturating_sub(1);
        let largest = (fps / LEAST_FPS).floor().max(1.0) as usize;
        let stride = all.div_ceil(most.max(1)).clamp(1, largest);
        Self {
            window: all.min(most.max(1) * stride),
            stride,
        }
    }

    /// Is the frame, from 1, one of those that a movie may show?
    fn shows(self, frame: usize) -> bool {
        (frame - 1).is_multiple_of(self.stride)
    }
}

/// Predicted positions of the two rows that a movie shows, in metres.
#[derive(Debug)]
struct RecordedFrame {
    model: Vec<Vec3>,
    /// Positions of the baseline, which runs after the model.
    rival: Option<Vec<Vec3>>,
}

/// Frame of a movie.
pub(super) struct ComparedFrame<'a> {
    /// Simulated and predicted garment.
    pub(super) comparison: FrameComparison,
    /// Garment vertices that the baseline predicts, metres.
    pub(super) rival: Option<&'a [Vec3]>,
}

/// Recording of one clip.
#[derive(Debug)]
pub(super) struct ClipRecording {
    pub(super) clip: PreparedClip,
    plan: MoviePlan,
    /// RMSE of the model in metres; the first is that of frame 1.
    errors: Vec<f64>,
    worst: Option<WorstFrame>,
    /// Frames, by their index, that may still be in the movie.
    recorded: BTreeMap<usize, RecordedFrame>,
    /// Positions of the model in frames spread over the clip, by the index of the frame.
    samples: BTreeMap<usize, Vec<Vec3>>,
}

impl ClipRecording {
    /// Creates an empty recording for a movie of at most `most` frames.
    pub(super) fn new(clip: &PreparedClip, most: usize) -> Self {
        // A movie of `most` frames keeps those on both sides of the worst frame, of two rows each.
        let bytes = 4 * size_of::<Vec3>() * clip.captured.garment.vertex_count().max(1);
        let most = most.min(MOST_BYTES / bytes).max(1);
        let spread = evenly_spread(clip.len().saturating_sub(1), SAMPLES);
        Self {
            plan: MoviePlan::new(clip.len(), clip.captured.clip.fps, most),
            clip: clip.clone(),
            errors: Vec::new(),
            worst: None,
            recorded: BTreeMap::new(),
            samples: spread.into_iter().map(|k| (k + 1, Vec::new())).collect(),
        }
    }

    /// Adds the positions that the model predicts for a frame. Frames come in order, from 1.
    pub(super) fn add_model(&mut self, frame: usize, positions: &[Vec3]) {
        let error = rmse(positions, self.clip.captured.garment.frame(frame));
        self.errors.push(error);
        if let Some(sample) = self.samples.get_mut(&frame) {
            sample.extend_from_slice(positions);
        }
        // `total_cmp` orders NaN above all numbers: a diverged frame becomes the worst.
        let worst = self.worst.as_ref();
        if worst.is_none_or(|worst| error.total_cmp(&worst.rmse).is_gt()) {
            self.worst = Some(WorstFrame {
                frame,
                rmse: error,
                positions: positions.to_vec(),
            });
        }
        if self.plan.shows(frame) {
            let model = positions.to_vec();
            self.recorded.insert(frame, RecordedFrame { model, rival: None });
        }
        // The window holds the worst frame, which is the present one or another still to come.
        let (window, worst) = (self.plan.window, self.worst.as_ref().map_or(0, |w| w.frame));
        self.recorded
            .retain(|&k, _| k.abs_diff(worst) < window || frame - k < window);
    }

    /// Adds the positions that the baseline predicts for a frame, after those of the model.
    pub(super) fn add_rival(&mut self, frame: usize, positions: &[Vec3]) {
        if let Some(recorded) = self.recorded.get_mut(&frame) {
            recorded.rival = Some(positions.to_vec());
        }
    }

    /// Frame in which the model has its largest error. `None` before the first frame.
    pub(super) fn worst(&self) -> Option<&WorstFrame> {
        self.worst.as_ref()
    }

    /// Frames of the clip that the movie covers: all, or those with the largest errors around the
    /// worst frame.
    pub(super) fn window(&self) -> Range<usize> {
        let worst = self.worst().map_or(1, |worst| worst.frame);
        worst_window(&self.errors, self.plan.window, worst)
    }

    /// Frame rate of the movie in frames per second.
    pub(super) fn fps(&self) -> f32 {
        self.clip.captured.clip.fps / self.plan.stride as f32
    }

    /// Frames of the movie in the order of time.
    pub(super) fn movie_frames(&self, capture: &Capture) -> Vec<ComparedFrame<'_>> {
        let shown = self.recorded.range(self.window());
        shown
            .map(|(&frame, recorded)| ComparedFrame {
                comparison: FrameComparison::new(capture, &self.clip, frame, &recorded.model),
                rival: recorded.rival.as_deref(),
            })
            .collect()
    }

    /// Frames of the error maps in the order of time: the worst frame of the clip, and those of the
    /// samples that are at the quartiles of the error.
    pub(super) fn error_map_frames(&self, capture: &Capture) -> Vec<FrameComparison> {
        let Some(worst) = &self.worst else {
            return Vec::new();
        };
        let samples: Vec<_> = self.samples.iter().filter(|(_, s)| !s.is_empty()).collect();
        let errors: Vec<f64> = samples
            .iter()
            .map(|(frame, _)| self.errors[**frame - 1])
            .collect();
        let quartiles = super::heat::quartiles(&errors).into_iter().map(|k| samples[k]);
        // A map sorts by time, and keeps a frame once that is both the worst and at a quartile.
        let mut chosen: BTreeMap<usize, &[Vec3]> = quartiles
            .map(|(frame, sample)| (*frame, sample.as_slice()))
            .collect();
        chosen.insert(worst.frame, &worst.positions);
        let comparison = |(frame, positions)| FrameComparison::new(capture, &self.clip, frame, positions);
        chosen.into_iter().map(comparison).collect()
    }
}

/// Range of `window` frames around frame `worst` with the largest sum of squared errors.
///
/// `errors` are in metres; the first is that of frame 1.
fn worst_window(errors: &[f64], window: usize, worst: usize) -> Range<usize> {
    /// Error in metres that stands for every larger one, and for NaN and infinity.
    // A diverged frame must not hide the differences between the others.
    const MOST_M: f64 = 1e3;
    let squared = |error: &f64| {
        if error.is_finite() {
            error.min(MOST_M).powi(2)
        } else {
            MOST_M.powi(2)
        }
    };
    // The first frame of the window lies in `first..=last`: it holds `worst` and ends in the clip.
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
    fn short_clips_are_shown_completely_and_long_ones_in_part() {
        let plan = |len, fps, most| {
            let MoviePlan { window, stride } = MoviePlan::new(len, fps, most);
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
    fn the_window_contains_the_worst_frame_and_the_largest_errors_around_it() {
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
