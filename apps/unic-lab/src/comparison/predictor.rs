//! A trained network as a row of an evaluation.

use super::{
    config::SurfaceKind,
    features::Features,
    network::{Runtime, RuntimeScratch, Shape},
    samples::{Samples, Units},
    space::Subspace,
};
use glam::Vec3;
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    character::Garment,
    motion::{MotionSpec, Normalisation},
    skeleton::Skeleton,
};
use unic_eval::{FrameRateError, Mode, Predictor, PredictorError, PreparedClip};
use unic_train::{MotionVectors, TrainError, View};

/// Coefficients may leave the range seen in training by this factor, no further: a network that
/// feeds on itself and diverges is then far off, and stays finite.
const RANGE_FACTOR: f32 = 10.0;

/// A clip of another skeleton than the network is trained on.
#[derive(Debug, Error)]
#[error("expected a clip of {expected} joints, found {found}")]
struct JointsError {
    expected: usize,
    found: usize,
}

/// What training leaves.
#[derive(Debug)]
pub(super) struct Trained {
    garment: Garment,
    surface: SurfaceKind,
    spec: MotionSpec,
    skeleton: Skeleton,
    fps: f32,
    normalisation: Normalisation,
    features: Features,
    space: Subspace,
    units: Units,
    limits: Vec<f32>,
    runtime: Runtime,
}

impl Trained {
    pub(super) fn new(shape: &Shape, values: &[Vec<f32>], samples: Samples) -> Result<Self, TrainError> {
        Ok(Self {
            runtime: Runtime::new(shape, values)?,
            limits: samples.ranges.iter().map(|r| r * RANGE_FACTOR).collect(),
            garment: samples.garment,
            surface: samples.surface,
            spec: samples.spec,
            skeleton: samples.skeleton,
            fps: samples.fps,
            normalisation: samples.normalisation,
            features: samples.features,
            space: samples.space,
            units: samples.units,
        })
    }

    fn project(&self, clip: &PreparedClip, frame: usize) -> Vec<f32> {
        self.space
            .project(&self.surface.of_frame(&self.garment, clip, frame))
    }
}

/// Runs a trained network frame by frame.
#[derive(Clone, Debug)]
pub(crate) struct ComparisonPredictor {
    trained: Arc<Trained>,
    mode: Mode,
    clip: Option<Clip>,
    /// Coefficients of the frame predicted last, metres.
    state: Vec<f32>,
    scratch: Scratch,
}

/// The clip at hand.
#[derive(Clone, Debug)]
struct Clip {
    /// With the motion vectors that the network reads.
    prepared: PreparedClip,
    /// Normalised.
    motion: MotionVectors,
}

#[derive(Clone, Debug, Default)]
struct Scratch {
    runtime: RuntimeScratch,
    features: Vec<f32>,
    garment: Vec<f32>,
    next: Vec<f32>,
    surface: Vec<f32>,
}

impl ComparisonPredictor {
    pub(super) fn new(trained: Arc<Trained>) -> Self {
        Self {
            trained,
            mode: Mode::FreeRunning,
            clip: None,
            state: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Coefficients of a frame from its motion and the coefficients before.
    fn advance(&mut self, frame: usize) {
        let Self {
            trained,
            clip: Some(Clip { motion, .. }),
            state,
            scratch,
            ..
        } = self
        else {
            return;
        };
        let Units { garment, output } = trained.units;
        scratch.features.clear();
        (trained.features).write(motion, View::Direct, frame, &mut scratch.features);
        scratch.garment.clear();
        scratch.garment.extend(state.iter().map(|z| z / garment));
        scratch.next.resize(state.len(), 0.0);
        let Scratch {
            features,
            garment,
            next,
            runtime,
            ..
        } = scratch;
        trained.runtime.outputs(features, garment, runtime, next);
        for ((z, next), limit) in state.iter_mut().zip(next).zip(&trained.limits) {
            let before = if trained.runtime.reads_garment() { *z } else { 0.0 };
            *z = (before + *next * output).clamp(-limit, *limit);
        }
    }
}

impl Predictor for ComparisonPredictor {
    /// Without the garment before both modes are one.
    fn modes(&self) -> &[Mode] {
        match self.trained.runtime.reads_garment() {
            true => &[Mode::OneStep, Mode::FreeRunning],
            false => &[Mode::FreeRunning],
        }
    }

    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError> {
        FrameRateError::check(self.trained.fps, clip.captured.clip.fps)?;
        self.mode = mode;
        let trained = &self.trained;
        let (expected, found) = (trained.skeleton.len(), clip.kinematics.joints());
        if expected != found {
            return Err(JointsError { expected, found }.into());
        }
        let prepared = PreparedClip::new(&trained.spec, &trained.skeleton, clip.captured.clone());
        self.state = trained.project(&prepared, 0);
        let motion = MotionVectors::new(&prepared, &trained.normalisation, None);
        self.clip = Some(Clip { prepared, motion });
        Ok(())
    }

    fn predict(
        &mut self,
        _: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        if let (Mode::OneStep, Some(clip)) = (self.mode, &self.clip) {
            self.state = self.trained.project(&clip.prepared, frame - 1);
        }
        self.advance(frame);
        let Some(clip) = &self.clip else { return Ok(()) };
        let (trained, u) = (&self.trained, &mut self.scratch.surface);
        trained.space.reconstruct(&self.state, u);
        let count = u.len() / 3;
        let surface = (0..count).map(|v| Vec3::new(u[v], u[count + v], u[2 * count + v]));
        let kinematics = &clip.prepared.kinematics;
        (trained.surface).to_world(&trained.garment, kinematics, frame, surface, positions);
        Ok(())
    }
}
