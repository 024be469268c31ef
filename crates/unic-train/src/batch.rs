//! One training step's data: windows of consecutive frames, a random subset of vertices in each.
//!
//! Rows of all arrays are windows × points, window by window; motion vectors are frame-major
//! (all windows of frame 1, all of frame 2, ...), so that one frame of the rollout is a contiguous
//! block.

use crate::{
    config::TrainConfig,
    field_data::FieldData,
    mirror::View,
    network::WindowRows,
    noise::SmoothNoise,
    stream::{Stream, generator},
};
use glam::Vec3;
use rand::{RngExt, rngs::ChaCha8Rng};
use rayon::prelude::*;
use std::ops::Range;
use unic_core::{
    config::{DisplacementConfig, StateConfig},
    features::{PointFrame, PointHistory, StepConditions, write_frame_inputs},
};
use unic_eval::PreparedClip;

/// Training window: its clip, its first frame, its view and its vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Index of the training clip.
    pub clip: usize,
    /// Frame that the rollout starts from; the first predicted one is the next.
    pub start: usize,
    /// View of the window: direct or mirrored.
    pub view: View,
    /// Vertices, each once.
    pub points: Vec<u32>,
}

/// Size of a random sample of the training clips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sample {
    /// Number of windows, drawn with replacement.
    pub(crate) windows: usize,
    /// Largest number of vertices of a window.
    pub(crate) points: usize,
    /// Number of frames of a window after its start.
    pub(crate) frames: usize,
}

/// Consecutive frames of a training clip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    /// Index of the clip.
    pub(crate) clip: usize,
    /// Its frames.
    pub(crate) frames: Range<usize>,
}

impl Stretch {
    /// The stretches of all clips, each whole.
    fn all(data: &FieldData) -> Vec<Self> {
        let whole = |(clip, prepared): (usize, &PreparedClip)| Self {
            clip,
            frames: 0..prepared.len(),
        };
        data.clips.iter().enumerate().map(whole).collect()
    }
}

/// Views that windows are drawn in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Views {
    /// The captured view alone.
    Direct,
    /// Captured and mirrored view, each with probability one half.
    Both,
}

/// Data of one step, on the host.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// The windows.
    pub windows: Vec<Window>,
    /// Points of each window.
    pub points: usize,
    /// Frames K of the rollout.
    pub frames: usize,
    /// Pairs (c_{t−1}, c_t), normalised: `[K · W, 2 D]`.
    pub motion: Vec<f32>,
    /// Inputs of the field that do not depend on the state, a frame: [W · n, F].
    pub frame_inputs: Vec<Vec<f32>>,
    /// States that the rollout should reach, a frame: `[W · n, 3]`.
    pub targets: Vec<Vec<f32>>,
    /// State at the start: `[W · n, 3]`.
    pub start: Vec<f32>,
    /// State a frame earlier: `[W · n, 3]`.
    pub before_start: Vec<f32>,
    /// Factors of the garment's mask on the field's output: `[W · n]`. Empty without a mask.
    pub shares: Vec<f32>,
}

/// Inputs and states of one window.
struct Gathered {
    frame_inputs: Vec<Vec<f32>>,
    /// States at start − 1, start, start + 1, ..., start + K.
    states: Vec<Vec<f32>>,
}

impl Batch {
    /// The batch of one step: a function of the seed and the step alone.
    pub fn gather(data: &FieldData, config: &TrainConfig, step: u64) -> Self {
        Self::gather_from(data, &Stretch::all(data), config, step)
    }

    /// The batch of one step from a part of the motion.
    pub(crate) fn gather_from(
        data: &FieldData,
        stretches: &[Stretch],
        config: &TrainConfig,
        step: u64,
    ) -> Self {
        let longest = stretches.iter().map(|s| s.frames.len().saturating_sub(1)).max();
        let frames = config.unroll(step).min(longest.unwrap_or(0));
        let mut rng = generator(config.seed, Stream::Windows, step);
        let sample = Sample {
            windows: config.batch.windows,
            points: config.batch.points,
            frames,
        };
        let views = match data.mirrors() {
            true => Views::Both,
            false => Views::Direct,
        };
        let windows = draw_windows(data, stretches, &mut rng, sample, views);
        let mut batch = Self::of_windows(data, windows, frames);
        batch.add_noise(data, config, step);
        batch
    }

    /// A sample of the training clips as captured, without noise: a function of the seed alone.
    pub(crate) fn sample(data: &FieldData, seed: u64, sample: Sample) -> Self {
        let mut rng = generator(seed, Stream::OneStep, 0);
        let windows = draw_windows(data, &Stretch::all(data), &mut rng, sample, Views::Direct);
        Self::of_windows(data, windows, sample.frames)
    }

    /// Gathers the given windows without noise. All must have the same number of points, and at
    /// least `frames` frames after their start.
    pub fn of_windows(data: &FieldData, windows: Vec<Window>, frames: usize) -> Self {
        let gathered: Vec<Gathered> = windows
            .par_iter()
            .map(|w| gather_window(data, w, frames))
            .collect();
        let states = |frame: usize| {
            gathered
                .iter()
                .map(|g| g.states[frame].as_slice())
                .collect::<Vec<_>>()
                .concat()
        };
        let inputs = |k: usize| {
            gathered
                .iter()
                .map(|g| g.frame_inputs[k].as_slice())
                .collect::<Vec<_>>()
                .concat()
        };
        Self {
            points: windows.first().map_or(0, |w| w.points.len()),
            frames,
            motion: motion_pairs(data, &windows, frames),
            frame_inputs: (0..frames).map(inputs).collect(),
            // Index 0 of the gathered states is the frame before the start, index 1 the start.
            targets: (0..frames).map(|k| states(k + 2)).collect(),
            start: states(1),
            before_start: states(0),
            shares: shares(data, &windows),
            windows,
        }
    }

    /// The same windows side by side `count` times.
    pub(crate) fn repeated(self, count: usize) -> Self {
        let windows = self.windows.len();
        let width = self.motion.len() / (self.frames * windows).max(1);
        // Motion is frame-major: the windows of a frame are repeated frame by frame.
        let by_frame = self.motion.chunks_exact((windows * width).max(1));
        let repeat = |rows: Vec<Vec<f32>>| rows.into_iter().map(|row| row.repeat(count)).collect();
        Self {
            motion: by_frame.flat_map(|frame| frame.repeat(count)).collect(),
            frame_inputs: repeat(self.frame_inputs),
            targets: repeat(self.targets),
            start: self.start.repeat(count),
            before_start: self.before_start.repeat(count),
            shares: self.shares.repeat(count),
            windows: vec![self.windows; count].concat(),
            points: self.points,
            frames: self.frames,
        }
    }

    /// Returns the number of rows that the encoder reads, by frame and window.
    pub fn encoder_rows(&self) -> WindowRows {
        WindowRows {
            frames: self.frames,
            windows: self.windows.len(),
        }
    }

    /// Number of rows of the per-point arrays.
    pub fn rows(&self) -> usize {
        self.windows.len() * self.points
    }

    fn add_noise(&mut self, data: &FieldData, config: &TrainConfig, step: u64) {
        let noise = &config.regularisation;
        if noise.state_noise_m > 0.0 {
            let mut rng = generator(config.seed, Stream::StateNoise, step);
            self.add_state_noise(data, &mut rng, noise.state_noise_m);
        }
    }

    fn add_state_noise(&mut self, data: &FieldData, rng: &mut ChaCha8Rng, deviation_m: f32) {
        let garment = &data.capture.garment;
        // At least one point: `chunks_exact_mut` panics on a length of zero.
        let row = 3 * self.points.max(1);
        let rows = self
            .start
            .chunks_exact_mut(row)
            .zip(self.before_start.chunks_exact_mut(row));
        for (window, (start, before)) in self.windows.iter().zip(rows) {
            let noise = SmoothNoise::draw(rng, deviation_m);
            let states = start.chunks_exact_mut(3).zip(before.chunks_exact_mut(3));
            for (&vertex, (start, before)) in window.points.iter().zip(states) {
                // Masked vertices follow the skinning, so their noise shrinks with the model's
                // share.
                let share = garment.share(vertex as usize);
                let (now, earlier) = noise.at(garment.rest.vertices[vertex as usize]);
                (0..3).for_each(|i| start[i] += now[i] * share);
                (0..3).for_each(|i| before[i] += earlier[i] * share);
            }
        }
    }
}

fn draw_windows(
    data: &FieldData,
    stretches: &[Stretch],
    rng: &mut ChaCha8Rng,
    sample: Sample,
    views: Views,
) -> Vec<Window> {
    // Every start of every stretch is equally likely.
    let starts: Vec<usize> = stretches
        .iter()
        // A window covers `frames` + 1 frames. Stretches that are too short have no start.
        .map(|s| s.frames.len().saturating_sub(sample.frames))
        .collect();
    let total: usize = starts.iter().sum();
    let vertices = data.capture.garment.rest.vertices.len();
    let points = sample.points.min(vertices);
    (0..sample.windows)
        .map(|_| {
            let (stretch, start) = locate(&starts, rng.random_range(0..total.max(1)));
            let Stretch { clip, frames } = &stretches[stretch];
            // Drawn for every window, also without mirroring, so that both cases draw the same
            // starts and vertices.
            let view = match rng.random::<bool>() && views == Views::Both {
                true => View::Mirrored,
                false => View::Direct,
            };
            Window {
                clip: *clip,
                start: frames.start + start,
                view,
                points: draw_points(rng, vertices, points),
            }
        })
        .collect()
}

fn locate(starts: &[usize], mut index: usize) -> (usize, usize) {
    for (stretch, &count) in starts.iter().enumerate() {
        if index < count {
            return (stretch, index);
        }
        index -= count;
    }
    // Not reached: `index` is below the sum of `starts` where a stretch fits the window.
    (0, 0)
}

/// Draws distinct vertices; all of them in their order where `points` is their number.
pub(crate) fn draw_points(rng: &mut ChaCha8Rng, vertices: usize, points: usize) -> Vec<u32> {
    if points == vertices {
        // A permutation of all vertices would only change the order of summation.
        return (0..vertices as u32).collect();
    }
    let chosen = rand::seq::index::sample(rng, vertices, points);
    chosen.into_iter().map(|v| v as u32).collect()
}

fn shares(data: &FieldData, windows: &[Window]) -> Vec<f32> {
    let garment = &data.capture.garment;
    let points = windows.iter().flat_map(|w| &w.points);
    match garment.mask {
        Some(_) => points.map(|&v| garment.share(v as usize)).collect(),
        None => Vec::new(),
    }
}

fn motion_pairs(data: &FieldData, windows: &[Window], frames: usize) -> Vec<f32> {
    let mut pairs = Vec::with_capacity(frames * windows.len() * 2 * data.normalisation.mean.len());
    for k in 0..frames {
        for w in windows {
            let vectors = &data.motion[w.clip];
            pairs.extend_from_slice(vectors.frame(w.start + k, w.view));
            pairs.extend_from_slice(vectors.frame(w.start + k + 1, w.view));
        }
    }
    pairs
}

fn gather_window(data: &FieldData, window: &Window, frames: usize) -> Gathered {
    match &data.config.state {
        StateConfig::RootRelative => gather_positions(data, window, frames),
        StateConfig::Displacement(config) => gather_displacements(data, config, window, frames),
    }
}

fn gather_positions(data: &FieldData, window: &Window, frames: usize) -> Gathered {
    let clip = &data.clips[window.clip];
    let positions = |t: usize| {
        let state_from_world = clip.kinematics.world_from_state(t).inverse();
        let garment = clip.captured.garment.frame(t);
        let place = |&v: &u32| window.view.of(state_from_world.point(garment[v as usize]));
        flat(window.points.iter().map(place))
    };
    let before = window.start.saturating_sub(1);
    Gathered {
        frame_inputs: vec![Vec::new(); frames],
        states: std::iter::once(before)
            .chain(window.start..=window.start + frames)
            .map(positions)
            .collect(),
    }
}

fn gather_displacements(
    data: &FieldData,
    config: &DisplacementConfig,
    window: &Window,
    frames: usize,
) -> Gathered {
    let inputs = 3 * config.inputs.iter().filter(|i| !i.is_state()).count();
    let rows = window.points.len();
    let mut gathered = Gathered {
        frame_inputs: vec![vec![0.0; rows * inputs]; frames],
        states: vec![vec![0.0; rows * 3]; frames + 2],
    };
    for (row, &vertex) in window.points.iter().enumerate() {
        let mut track = Track::new(data, window, vertex as usize);
        track.write_state(row, &mut gathered.states[0]);
        // A window at frame 0 has no earlier frame: both states are the same, and it starts at
        // rest.
        if window.start > 0 {
            track.advance();
        }
        track.write_state(row, &mut gathered.states[1]);
        for k in 0..frames {
            track.advance();
            track.write_state(row, &mut gathered.states[k + 2]);
            let out = &mut gathered.frame_inputs[k][row * inputs..(row + 1) * inputs];
            track.write_inputs(config, out);
        }
    }
    gathered
}

/// State of one vertex while it is followed through a window.
struct Track<'a> {
    data: &'a FieldData,
    window: &'a Window,
    vertex: usize,
    frame: usize,
    history: PointHistory,
}

impl<'a> Track<'a> {
    /// Begins at the frame before the window's start, or at the start of a window at frame 0.
    fn new(data: &'a FieldData, window: &'a Window, vertex: usize) -> Self {
        let frame = window.start.saturating_sub(1);
        let mut track = Self {
            data,
            window,
            vertex,
            frame,
            history: PointHistory::default(),
        };
        let now = track.point_frame();
        track.history = PointHistory {
            now,
            before: now.skinned,
        };
        track
    }

    fn point_frame(&self) -> PointFrame {
        let kinematics = &self.data.clips[self.window.clip].kinematics;
        PointFrame::new(
            &self.data.capture.garment,
            self.vertex,
            kinematics.world_from_rest(self.frame),
        )
    }

    fn advance(&mut self) {
        self.frame += 1;
        self.history.advance(self.point_frame());
    }

    /// Writes the state d = u − p, displacement minus prior, mirrored with the window.
    fn write_state(&self, row: usize, out: &mut [f32]) {
        let world = self.data.clips[self.window.clip]
            .captured
            .garment
            .frame(self.frame)[self.vertex];
        let coefficients = &self.data.coefficients[self.window.clip][self.frame];
        let d = self.history.now.blended_displacement(world)
            - self.data.prior.displacement(self.vertex, coefficients);
        out[3 * row..3 * row + 3].copy_from_slice(&self.window.view.of(d).to_array());
    }

    /// Writes the inputs of the field. A mirrored vertex has the rest position M·rest, and M times
    /// every vector, with M the reflection of x.
    fn write_inputs(&self, config: &DisplacementConfig, out: &mut [f32]) {
        let rest = self.data.capture.garment.rest.vertices[self.vertex];
        // The mirrored position is normalised, then mirrored back: the reflection of all vectors
        // below includes it.
        let view = self.window.view;
        let rest = view.of(self.data.rest_box.normalised(view.of(rest)));
        let clip = &self.data.clips[self.window.clip].captured.clip;
        let tick = StepConditions {
            dt: 1.0 / self.data.config.fps,
            wind: clip.wind_at(self.frame),
        };
        write_frame_inputs(config, rest, &self.history, tick, out);
        if view == View::Mirrored {
            out.chunks_exact_mut(3).for_each(|v| v[0] = -v[0]);
        }
    }
}

fn flat(points: impl Iterator<Item = Vec3>) -> Vec<f32> {
    points.flat_map(|p| p.to_array()).collect()
}
