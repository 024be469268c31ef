//! Running predictors over clips and measuring every frame.

use crate::{
    error::{Error, Result},
    kinematics::PreparedClip,
    measure::{FrameContext, MeasureScratch, Prediction},
    metrics::{ClipMetrics, FrameSums, PooledMetrics},
    predictor::{Mode, Predictor, PredictorError},
    report::{ByMode, Evaluation, Scores},
    training::TrainingSet,
};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use unic_core::{
    character::{Character, Garment},
    motion::{MotionLayout, MotionSpec, VelocityScheme},
};
use unic_io::{Capture, Split};

/// Frames that are in memory at once: enough to keep many cores busy.
const CHUNK_FRAMES: usize = 32;

/// Name of the row that stands beside the baselines.
pub const MODEL: &str = "model";

/// A predictor with its name in the table.
pub struct Row {
    /// As in JSON; [`MODEL`] or a baseline's.
    pub name: String,
    /// What is measured.
    pub predictor: Box<dyn Predictor>,
}

impl Row {
    /// The model under evaluation.
    pub fn model(predictor: impl Predictor + 'static) -> Self {
        Self::baseline(MODEL, predictor)
    }

    /// Something to compare it with.
    pub fn baseline(name: &str, predictor: impl Predictor + 'static) -> Self {
        Self {
            name: name.to_owned(),
            predictor: Box::new(predictor),
        }
    }
}

/// What an evaluation tells while it runs; see [`evaluate`].
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A clip has been read.
    ClipStarted {
        /// The clip.
        clip: &'a PreparedClip,
        /// Its place among the clips, from 0.
        index: usize,
        /// Number of clips.
        count: usize,
    },
    /// A row has predicted a frame.
    Predicted {
        /// The row's name.
        row: &'a str,
        /// How it ran.
        mode: Mode,
        /// The frame, from 1.
        frame: usize,
        /// World positions, metres.
        positions: &'a [Vec3],
    },
    /// Frames of the clip are done, in one of the modes.
    Progress {
        /// How the rows ran.
        mode: Mode,
        /// Frames done, frame 0 included.
        done: usize,
        /// Frames of the clip.
        total: usize,
    },
    /// All rows have run over the clip.
    ClipFinished,
}

/// Listens to an evaluation: a progress bar, a [`Dump`](crate::Dump). An error ends it.
pub type Observer<'a> = dyn FnMut(&Event) -> std::result::Result<(), PredictorError> + 'a;

/// Measures all rows on the named clips of a capture.
///
/// Clips are read one at a time and frames in chunks, so that memory does not grow with them. The
/// posed body and its trees are made once a frame and mode and shared by the rows. The result has
/// the same bits for any number of threads.
///
/// # Errors
/// No clips, files that cannot be used, predictors or observers that give up.
pub fn evaluate(
    capture: &Capture,
    rows: &mut [Row],
    clips: &[String],
    observe: &mut Observer,
) -> Result<Evaluation> {
    if clips.is_empty() {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoClips { capture });
    }
    let spec = motion_spec(capture)?;
    let mut bench = Bench::new(&capture.character, &capture.garment);
    let mut pooled = vec![[PooledMetrics::default(), PooledMetrics::default()]; rows.len()];
    let mut evaluation = Evaluation::default();
    for (index, name) in clips.iter().enumerate() {
        let captured = capture.load_clip(name)?;
        let clip = PreparedClip::new(&spec, &capture.character.skeleton, captured);
        let count = clips.len();
        let started = Event::ClipStarted {
            clip: &clip,
            index,
            count,
        };
        tell(&clip, observe, &started)?;
        let sums = bench.run(&clip, rows, observe)?;
        tell(&clip, observe, &Event::ClipFinished)?;
        evaluation.clips.insert(name.clone(), scores(rows, &sums));
        for (all, clip) in pooled.iter_mut().flatten().zip(sums.iter().flatten()) {
            all.pool(clip);
        }
    }
    evaluation.pooled = scores(rows, &pooled);
    Ok(evaluation)
}

/// Reads the clips that baselines are fitted on.
///
/// Clips whose garment is a `.npy` file are mapped and take no memory of their own; garments in
/// npz files are read whole.
///
/// # Errors
/// No training clips, files that cannot be used.
pub fn training_set(capture: &Capture) -> Result<TrainingSet> {
    let spec = motion_spec(capture)?;
    let load = |split| -> Result<Vec<PreparedClip>> {
        let names = capture.clip_names(split).iter();
        let prepare = |name: &String| {
            let captured = capture.load_clip(name)?;
            Ok(PreparedClip::new(&spec, &capture.character.skeleton, captured))
        };
        names.map(prepare).collect()
    };
    let train = load(Split::Train)?;
    if train.iter().all(|clip| clip.len() < 2) {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoTraining { capture });
    }
    Ok(TrainingSet {
        garment: capture.garment.clone(),
        train,
        validation: load(Split::Validation)?,
    })
}

/// The motion vector that baselines read: heading layout, backward velocities.
fn motion_spec(capture: &Capture) -> Result<MotionSpec> {
    let (layout, velocity) = (MotionLayout::Heading, VelocityScheme::Backward);
    Ok(MotionSpec::new(layout, velocity, capture.contact_joints, &capture.character)?)
}

/// One [`PooledMetrics`] a mode, in the order of [`MODES`].
type ModeSums = [PooledMetrics; 2];

/// In this order everywhere.
const MODES: [Mode; 2] = [Mode::OneStep, Mode::FreeRunning];

fn scores(rows: &[Row], sums: &[ModeSums]) -> Scores {
    let mut scores = Scores::default();
    for (row, [one_step, free_running]) in rows.iter().zip(sums) {
        let metrics = |s: &PooledMetrics| (s.frames() > 0).then(|| s.metrics());
        let by_mode = ByMode {
            one_step: metrics(one_step),
            free_running: metrics(free_running),
        };
        if row.name == MODEL {
            scores.model = Some(by_mode);
        } else {
            scores.baselines.insert(row.name.clone(), by_mode);
        }
    }
    scores
}

fn tell(clip: &PreparedClip, observe: &mut Observer, event: &Event) -> Result<()> {
    observe(event).map_err(|source| Error::Observer {
        clip: clip.name().to_owned(),
        source,
    })
}

/// Buffers of a chunk of frames, reused over chunks and clips.
struct Bench<'a> {
    character: &'a Character,
    contexts: Vec<FrameContext>,
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
    fn new(character: &'a Character, garment: &Garment) -> Self {
        let context = FrameContext::new(character, garment);
        Self {
            character,
            contexts: vec![context; CHUNK_FRAMES],
        }
    }

    fn run(
        &mut self,
        clip: &PreparedClip,
        rows: &mut [Row],
        observe: &mut Observer,
    ) -> Result<Vec<ModeSums>> {
        let mut sums = vec![ModeSums::default(); rows.len()];
        for (slot, mode) in MODES.into_iter().enumerate() {
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
        let character = self.character;
        let contexts = self.contexts.par_iter_mut().zip(frames.clone());
        contexts.for_each(|(context, frame)| context.prepare(character, clip, frame));
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

fn start_tracks<'a>(
    clip: &PreparedClip,
    rows: &'a mut [Row],
    mode: Mode,
) -> Result<Vec<Track<'a>>> {
    let rows = rows.iter_mut().enumerate();
    rows.filter(|(_, row)| row.predictor.modes().contains(&mode))
        .map(|(index, row)| {
            row.predictor.start(clip, mode).map_err(|e| failed(&row.name, clip, e))?;
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
