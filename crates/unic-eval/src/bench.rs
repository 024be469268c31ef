//! Rows side by side on one clip, a chunk of frames at a time.

use crate::{
    error::{Error, Result},
    evaluate::{Event, Observer, Row},
    kinematics::PreparedClip,
    measure::{FrameContext, MeasureScratch, Nearest, Prediction},
    metrics::{ClipMetrics, FrameSums, PooledMetrics},
    predictor::{Mode, PredictorError},
};
use glam::Vec3;
use rayon::prelude::*;
use std::{num::NonZeroUsize, ops::Range};
use unic_core::character::{Character, Garment};

/// Frames that are in memory at once: enough to keep many cores busy.
const CHUNK_FRAMES: usize = 32;

/// One [`PooledMetrics`] a mode, in the order of [`MODES`].
pub(crate) type ModeSums = [PooledMetrics; 2];

/// In this order everywhere.
const MODES: [Mode; 2] = [Mode::OneStep, Mode::FreeRunning];

/// Buffers of a chunk of frames, reused over chunks and clips.
pub(crate) struct Bench<'a> {
    character: &'a Character,
    contexts: Vec<FrameContext>,
    /// Nearest points are looked for in every so many frames.
    nearest_every: NonZeroUsize,
    /// Those of [`MODES`] that rows run in.
    pub(crate) modes: &'a [Mode],
}

/// One row in one mode on one clip.
struct Track<'a> {
    row: &'a mut Row,
    index: usize,
    metrics: ClipMetrics,
    /// Predictions of the two frames before the chunk, then of the chunk.
    window: Vec<Vec<Vec3>>,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(character: &'a Character, garment: &Garment, nearest_every: NonZeroUsize) -> Self {
        let context = FrameContext::new(character, garment);
        Self {
            character,
            contexts: vec![context; CHUNK_FRAMES],
            nearest_every,
            modes: &MODES,
        }
    }

    /// Sums of every row in every mode that it has.
    pub(crate) fn run(
        &mut self,
        clip: &PreparedClip,
        rows: &mut [Row],
        observe: &mut Observer,
    ) -> Result<Vec<ModeSums>> {
        let mut sums = vec![ModeSums::default(); rows.len()];
        for (slot, mode) in MODES.into_iter().enumerate() {
            if !self.modes.contains(&mode) {
                continue;
            }
            let mut tracks = start_tracks(clip, rows, mode)?;
            if tracks.is_empty() {
                continue;
            }
            for first in (1..clip.len()).step_by(CHUNK_FRAMES) {
                let frames = first..(first + CHUNK_FRAMES).min(clip.len());
                self.prepare(clip, &frames);
                (tracks.par_iter_mut()).try_for_each(|t| t.predict(clip, &frames))?;
                self.measure(&mut tracks, &frames);
                report(clip, &mut tracks, mode, &frames, observe)?;
            }
            for track in tracks {
                sums[track.index][slot] = track.metrics.finish();
            }
        }
        Ok(sums)
    }

    fn prepare(&mut self, clip: &PreparedClip, frames: &Range<usize>) {
        let (character, every) = (self.character, self.nearest_every.get());
        let nearest = |frame: usize| match frame % every {
            0 => Nearest::Found,
            _ => Nearest::LeftOut,
        };
        let contexts = self.contexts.par_iter_mut().zip(frames.clone());
        contexts.for_each(|(context, frame)| context.prepare(character, clip, frame, nearest(frame)));
    }

    /// Measures in parallel, adds up in order.
    fn measure(&self, tracks: &mut [Track], frames: &Range<usize>) {
        let windows: Vec<&[Vec<Vec3>]> = tracks.iter().map(|t| t.window.as_slice()).collect();
        let measure = |scratch: &mut MeasureScratch, i: usize| {
            let (track, slot) = (i / frames.len(), i % frames.len());
            let prediction = prediction(windows[track], slot, frames.start + slot);
            self.contexts[slot].measure(&prediction, scratch)
        };
        let sums: Vec<FrameSums> = (0..tracks.len() * frames.len())
            .into_par_iter()
            .map_init(|| self.contexts[0].scratch(), measure)
            .collect();
        for (track, sums) in tracks.iter_mut().zip(sums.chunks_exact(frames.len())) {
            for (frame, sums) in frames.clone().zip(sums) {
                track.metrics.add(frame, sums);
            }
        }
    }
}

fn start_tracks<'a>(clip: &PreparedClip, rows: &'a mut [Row], mode: Mode) -> Result<Vec<Track<'a>>> {
    let rows = rows.iter_mut().enumerate();
    rows.filter(|(_, row)| row.predictor.modes().contains(&mode))
        .map(|(index, row)| {
            row.predictor
                .start(clip, mode)
                .map_err(|e| failed(&row.name, clip, e))?;
            Ok(Track {
                row,
                index,
                metrics: ClipMetrics::new(clip.captured.clip.fps, mode),
                window: vec![Vec::new(); CHUNK_FRAMES + 2],
            })
        })
        .collect()
}

fn failed(row: &str, clip: &PreparedClip, source: PredictorError) -> Error {
    Error::Predictor {
        row: row.to_owned(),
        clip: clip.name().to_owned(),
        source,
    }
}

/// Tells what has been predicted and moves the windows on.
fn report(
    clip: &PreparedClip,
    tracks: &mut [Track],
    mode: Mode,
    frames: &Range<usize>,
    observe: &mut Observer,
) -> Result<()> {
    for track in tracks {
        for (slot, frame) in frames.clone().enumerate() {
            let event = Event::Predicted {
                row: &track.row.name,
                mode,
                frame,
                positions: &track.window[slot + 2],
            };
            tell(clip, observe, &event)?;
        }
        track.window.swap(0, frames.len());
        track.window.swap(1, frames.len() + 1);
    }
    let (done, total) = (frames.end, clip.len());
    tell(clip, observe, &Event::Progress { mode, done, total })
}

impl Track<'_> {
    fn predict(&mut self, clip: &PreparedClip, frames: &Range<usize>) -> Result<()> {
        let expected = clip.captured.garment.vertex_count();
        for (frame, positions) in frames.clone().zip(&mut self.window[2..]) {
            let Row { name, predictor } = &mut *self.row;
            (predictor.predict(clip, frame, positions)).map_err(|e| failed(name, clip, e))?;
            if positions.len() != expected {
                return Err(Error::Vertices {
                    row: name.clone(),
                    clip: clip.name().to_owned(),
                    expected,
                    found: positions.len(),
                });
            }
        }
        Ok(())
    }
}

/// The prediction in a slot of a chunk, which begins at the window's third frame.
fn prediction(window: &[Vec<Vec3>], slot: usize, frame: usize) -> Prediction<'_> {
    let [earlier, before, now] = [0, 1, 2].map(|k| window[slot + k].as_slice());
    Prediction {
        now,
        before: (frame >= 3).then_some([before, earlier]),
    }
}

pub(crate) fn tell(clip: &PreparedClip, observe: &mut Observer, event: &Event) -> Result<()> {
    observe(event).map_err(|source| Error::Observer {
        clip: clip.name().to_owned(),
        source,
    })
}
