//! Trained networks as predictors.

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

/// Largest predicted coefficient, as a multiple of its largest absolute value in training. The
/// limit keeps a diverging network finite.
const RANGE_FACTOR: f32 = 10.0;

/// Error of a clip whose skeleton has another number of joints.
#[derive(Debug, Error)]
#[error("expected a clip of {expected} joints, found {found}")]
struct JointsError {
    expected: usize,
    found: usize,
}

/// Trained network of another method, with what inference needs of its training samples.
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
    /// Largest absolute value of each predicted coefficient, metres.
    limits: Vec<f32>,
    runtime: Runtime,
}

impl Trained {
    /// Keeps the parts of the samples that inference needs.
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

    /// Returns the coefficients of the true garment in a frame, metres.
    fn project(&self, clip: &PreparedClip, frame: usize) -> Vec<f32> {
        self.space
            .project(&self.surface.of_frame(&self.garment, clip, frame))
    }
}

/// Predictor that runs a trained network frame by frame.
#[derive(Clone, Debug)]
pub(crate) struct ComparisonPredictor {
    trained: Arc<Trained>,
    mode: Mode,
    clip: Option<Clip>,
    /// Coefficients of the previous frame, metres.
    state: Vec<f32>,
    scratch: Scratch,
}

/// Current clip.
#[derive(Clone, Debug)]
struct Clip {
    /// Clip with the motion vectors that the network reads.
    prepared: PreparedClip,
    /// Normalised motion vectors.
    motion: MotionVectors,
}

/// Buffers of a step.
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

    /// Computes the coefficients of a frame from its motion and the previous coefficients.
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
            // A network that reads the garment predicts its change, others the garment itself.
            let before = if trained.runtime.reads_garment() { *z } else { 0.0 };
            *z = (before + *next * output).clamp(-limit, *limit);
        }
    }
}

impl Predictor for ComparisonPredictor {
    /// Without the previous garment both modes predict the same.
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
        // The clip's own motion vectors have the layout of the baselines.
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
