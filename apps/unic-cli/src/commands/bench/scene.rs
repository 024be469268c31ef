//! Model and motion of a measurement.

use anyhow::{Result, anyhow, bail};
use std::sync::Arc;
use unic_builtin::scale::{NetworkSize, random_model, walk};
use unic_core::{Model, Pose, StepInput, clip::Clip, config::StateConfig};

/// Duration of the motion that errors are measured over, seconds.
const SECONDS: f32 = 10.0;

/// Model and motion of a measurement.
pub(super) struct Scene {
    /// Model in f32 at all vertices.
    pub(super) model: Arc<Model>,
    /// Name of the preset whose kind or size the networks have.
    pub(super) network: String,
    pub(super) poses: Vec<Pose>,
    ground_height: f32,
}

impl Scene {
    /// Makes a scene of a model with random weights that walks.
    pub(super) fn random(network: NetworkSize, vertices: usize) -> Result<Self> {
        let model = random_model(network, vertices).map_err(|e| anyhow!("--vertices: {e}"))?;
        let frames = (SECONDS * model.config().fps) as usize + 1;
        Ok(Self {
            model: Arc::new(model),
            network: network.name().to_owned(),
            poses: (0..frames).map(walk).collect(),
            ground_height: 0.0,
        })
    }

    /// Makes a scene of a trained model with a motion.
    pub(super) fn trained(model: Model, clip: Clip) -> Result<Self> {
        let frames = (SECONDS * model.config().fps) as usize + 1;
        if clip.len() < 2 {
            bail!("expected a motion of two frames or more, found {}", clip.len());
        }
        let network = match model.config().state {
            StateConfig::RootRelative => NetworkSize::Paper,
            StateConfig::Displacement(_) => NetworkSize::Standard,
        };
        Ok(Self {
            // The reference for errors has all vertices, whatever sampling the model was written
            // with.
            model: Arc::new(model.with_sampling(1.0)?),
            network: network.name().to_owned(),
            ground_height: clip.ground_height,
            poses: clip.poses.into_iter().take(frames).collect(),
        })
    }

    /// Returns the input of frame `t`. The motion goes forwards and backwards in turn, without
    /// jumps.
    pub(super) fn input(&self, t: usize) -> StepInput<'_> {
        let last = self.poses.len() - 1;
        let at = |t: usize| {
            let within = t % (2 * last);
            &self.poses[within.min(2 * last - within)]
        };
        StepInput {
            pose: at(t),
            next_pose: Some(at(t + 1)),
            ground_height: self.ground_height,
            wind: glam::Vec3::ZERO,
        }
    }
}
