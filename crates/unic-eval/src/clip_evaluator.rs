//! All predictors of an evaluation on one clip, side by side, one chunk of frames at a time.

use crate::{
    error::{Error, Result},
    event::{Event, Observer, notify},
    kinematics::PreparedClip,
    life::{ClipWindows, LifeMeasure, PredictorLife},
    measure::{FrameContext, MeasureScratch, Nearest, Prediction},
    metrics::{ClipMetrics, FrameSums, PooledMetrics},
    predictor::{Mode, NamedPredictor, PredictorError},
};
use glam::Vec3;
use rayon::prelude::*;
use std::{num::NonZeroUsize, ops::Range};
use unic_core::character::{Character, Garment};

/// Number of frames in memory at once: enough to keep many cores busy.
const CHUNK_FRAMES: usize = 32;

/// Number of predictions before a chunk that its second differences need.
const FRAMES_BEFORE: usize = 2;

/// Sums of one predictor, one entry for each mode in the order of [`MODES`].
pub(crate) type SumsByMode = [PooledMetrics; 2];

/// All modes, in the order of [`SumsByMode`].
const MODES: [Mode; 2] = [Mode::OneStep, Mode::FreeRunning];

/// Measures predictors on clips. Its buffers hold one chunk of frames and are used again.
pub(crate) struct ClipEvaluator<'a> {
    character: &'a Character,
    /// Measurement context of each frame of a chunk.
    contexts: Vec<FrameContext>,
    /// Interval of the frames whose nearest points are searched.
    nearest_every: NonZeroUsize,
    /// Modes in which predictors run, a part of [`MODES`].
    modes: &'a [Mode],
    /// Measures of life in free running.
    life: LifeMeasure<'a>,
}

/// Results of all predictors on one clip.
pub(crate) struct ClipResults {
    /// Sums of each predictor.
    pub(crate) sums: Vec<SumsByMode>,
    /// Windows for the judge. A predictor without free running has none.
    pub(crate) windows: ClipWindows,
}

/// One predictor in one mode on one clip.
struct PredictorRun<'a> {
    predictor: &'a mut NamedPredictor,
    /// Index of the predictor in the evaluation.
    index: usize,
    metrics: ClipMetrics,
    /// Predictions of the [`FRAMES_BEFORE`] frames before the chunk, then of the chunk.
    window: Vec<Vec<Vec3>>,
}

impl<'a> ClipEvaluator<'a> {
    /// Makes an evaluator for clips of one garment on one character.
    ///
    /// # Errors
    /// A garment whose rest mesh cannot be smoothed.
    pub(crate) fn new(
        character: &'a Character,
        garment: &'a Garment,
        modes: &'a [Mode],
        nearest_every: NonZeroUsize,
    ) -> Result<Self> {
        let context = FrameContext::new(character, garment);
        Ok(Self {
            character,
            contexts: vec![context; CHUNK_FRAMES],
            nearest_every,
            modes,
            life: LifeMeasure::new(garment)?,
        })
    }

    /// Measures every predictor on a clip, in every mode that it supports.
    pub(crate) fn run(
        &mut self,
        clip: &PreparedClip,
        predictors: &mut [NamedPredictor],
        observe: &mut Observer,
    ) -> Result<ClipResults> {
        let mut results = ClipResults {
            sums: vec![SumsByMode::default(); predictors.len()],
            windows: ClipWindows {
                truth: Vec::new(),
                predicted: vec![Vec::new(); predictors.len()],
            },
        };
        for (mode_index, mode) in MODES.into_iter().enumerate() {
            if !self.modes.contains(&mode) {
                continue;
            }
            let mut runs = start_runs(clip, predictors, mode)?;
            if runs.is_empty() {
                continue;
            }
            let mut life = match mode {
                Mode::OneStep => None,
                Mode::FreeRunning => Some(self.life.start(clip.captured.clip.fps, runs.len())),
            };
            // Frame 0 is given to every predictor.
            for first in (1..clip.len()).step_by(CHUNK_FRAMES) {
                let frames = first..(first + CHUNK_FRAMES).min(clip.len());
                self.prepare(clip, &frames);
                (runs.par_iter_mut()).try_for_each(|run| run.predict(clip, &frames))?;
                self.measure(&mut runs, &frames);
                if let Some(life) = &mut life {
                    self.life.add(life, clip, &windows(&runs), &frames);
                }
                finish_chunk(clip, &mut runs, mode, &frames, observe)?;
            }
            let lives = life.map(|life| self.life.finish(life, &mut results.windows.truth));
            results.add(mode_index, runs, lives.unwrap_or_default());
        }
        Ok(results)
    }

    /// Poses the body and reads the true garment of each frame of a chunk, in parallel.
    fn prepare(&mut self, clip: &PreparedClip, frames: &Range<usize>) {
        let (character, every) = (self.character, self.nearest_every.get());
        let nearest = |frame: usize| match frame % every {
            0 => Nearest::Searched,
            _ => Nearest::Skipped,
        };
        let contexts = self.contexts.par_iter_mut().zip(frames.clone());
        contexts.for_each(|(context, frame)| context.prepare(character, clip, frame, nearest(frame)));
    }

    /// Measures every frame of every run and adds the results to the runs' metrics.
    fn measure(&self, runs: &mut [PredictorRun], frames: &Range<usize>) {
        let windows = windows(runs);
        let measure = |scratch: &mut MeasureScratch, i: usize| {
            let (run, slot) = (i / frames.len(), i % frames.len());
            let prediction = prediction(windows[run], slot, frames.start + slot);
            self.contexts[slot].measure(&prediction, scratch)
        };
        // Frames are measured in parallel, but added in their order: floating-point sums depend on
        // it, and results must not depend on the number of threads.
        let sums: Vec<FrameSums> = (0..runs.len() * frames.len())
            .into_par_iter()
            .map_init(|| self.contexts[0].scratch(), measure)
            .collect();
        for (run, sums) in runs.iter_mut().zip(sums.chunks_exact(frames.len())) {
            for (frame, sums) in frames.clone().zip(sums) {
                run.metrics.add(frame, sums);
            }
        }
    }
}

impl ClipResults {
    /// Adds the results of all runs in one mode. `lives` has one entry for each run, or none.
    fn add(&mut self, mode_index: usize, runs: Vec<PredictorRun>, lives: Vec<PredictorLife>) {
        let mut lives = lives.into_iter();
        for run in runs {
            let mut sums = run.metrics.finish();
            if let Some(PredictorLife { sums: life, windows }) = lives.next() {
                sums.set_life(life);
                self.windows.predicted[run.index] = windows;
            }
            self.sums[run.index][mode_index] = sums;
        }
    }
}

/// Returns the predictions of each run.
fn windows<'a>(runs: &'a [PredictorRun]) -> Vec<&'a [Vec<Vec3>]> {
    runs.iter().map(|run| run.window.as_slice()).collect()
}

/// Starts the predictors that support a mode on a clip.
fn start_runs<'a>(
    clip: &PreparedClip,
    predictors: &'a mut [NamedPredictor],
    mode: Mode,
) -> Result<Vec<PredictorRun<'a>>> {
    let predictors = predictors.iter_mut().enumerate();
    predictors
        .filter(|(_, named)| named.predictor.modes().contains(&mode))
        .map(|(index, named)| {
            let started = named.predictor.start(clip, mode);
            started.map_err(|e| failed(&named.name, clip, e))?;
            Ok(PredictorRun {
                predictor: named,
                index,
                metrics: ClipMetrics::new(clip.captured.clip.fps, mode),
                window: vec![Vec::new(); CHUNK_FRAMES + FRAMES_BEFORE],
            })
        })
        .collect()
}

/// Adds the names of the predictor and the clip to a predictor's error.
fn failed(predictor: &str, clip: &PreparedClip, source: PredictorError) -> Error {
    Error::Predictor {
        predictor: predictor.to_owned(),
        clip: clip.name().to_owned(),
        source,
    }
}

/// Reports the predictions of a chunk and makes its last frames those before the next chunk.
fn finish_chunk(
    clip: &PreparedClip,
    runs: &mut [PredictorRun],
    mode: Mode,
    frames: &Range<usize>,
    observe: &mut Observer,
) -> Result<()> {
    for run in runs {
        for (slot, frame) in frames.clone().enumerate() {
            let event = Event::Predicted {
                predictor: &run.predictor.name,
                mode,
                frame,
                positions: &run.window[slot + FRAMES_BEFORE],
            };
            notify(clip, observe, &event)?;
        }
        // Swapping keeps the buffers of all entries. The chunk's entries are written anew.
        for before in 0..FRAMES_BEFORE {
            run.window.swap(before, frames.len() + before);
        }
    }
    let (done, total) = (frames.end, clip.len());
    notify(clip, observe, &Event::Progress { mode, done, total })
}

impl PredictorRun<'_> {
    /// Predicts the frames of a chunk, in their order.
    fn predict(&mut self, clip: &PreparedClip, frames: &Range<usize>) -> Result<()> {
        let expected = clip.captured.garment.vertex_count();
        let NamedPredictor { name, predictor } = &mut *self.predictor;
        for (frame, positions) in frames.clone().zip(&mut self.window[FRAMES_BEFORE..]) {
            (predictor.predict(clip, frame, positions)).map_err(|e| failed(name, clip, e))?;
            if positions.len() != expected {
                return Err(Error::Vertices {
                    predictor: name.clone(),
                    clip: clip.name().to_owned(),
                    expected,
                    found: positions.len(),
                });
            }
        }
        Ok(())
    }
}

/// Returns the prediction in slot `slot` of a chunk, which is frame `frame` of the clip, with the
/// two predictions before it.
fn prediction(window: &[Vec<Vec3>], slot: usize, frame: usize) -> Prediction<'_> {
    let [earlier, before, now] = [0, 1, 2].map(|k| window[slot + k].as_slice());
    Prediction {
        now,
        // Frame 0 is no prediction, so that frame 3 is the first with two predictions before it.
        before: (frame >= 3).then_some([before, earlier]),
    }
}
