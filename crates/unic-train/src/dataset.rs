//! The training clips of a capture, and what must be measured on them before training.

use crate::{
    config::{ModelSettings, StateSettings, TrainConfig},
    error::TrainError,
    mirror::MirrorMap,
    stream::{Stream, generator},
};
use glam::Vec3;
use rand::RngExt;
use rayon::prelude::*;
use unic_core::{
    character::Garment,
    config::{DisplacementConfig, IntersectionMode, ModelConfig, StateConfig},
    features::{PointFrame, RestBox},
    motion::{MotionSpec, Normalisation},
};
use unic_eval::PreparedClip;
use unic_io::{Capture, Split};

/// Clips to train and to validate on, and the measured parts of the model.
pub struct Dataset {
    /// The capture that it comes from.
    pub capture: Capture,
    /// The model's configuration, scales filled in.
    pub config: ModelConfig,
    /// Training clips.
    pub clips: Vec<PreparedClip>,
    /// Clips that the free-running error is validated on; never trained on.
    pub validation: Vec<PreparedClip>,
    /// Statistics of the training clips' motion vectors.
    pub normalisation: Normalisation,
    /// Normalised motion vectors of each training clip, T × D.
    pub motion: Vec<MotionVectors>,
    /// ū of each vertex, zeros where the state is a position.
    pub mean_displacement: Vec<Vec3>,
    /// Bounding box of the rest shape.
    pub rest_box: RestBox,
}

/// Normalised motion vectors of one clip, as they are and mirrored.
pub struct MotionVectors {
    /// Numbers in a vector.
    pub len: usize,
    plain: Vec<f32>,
    mirrored: Option<Vec<f32>>,
}

impl MotionVectors {
    /// The vector of one frame; the mirrored one where there is a mirror map.
    pub fn frame(&self, frame: usize, mirrored: bool) -> &[f32] {
        let all = self.mirrored.as_ref().filter(|_| mirrored).unwrap_or(&self.plain);
        &all[frame * self.len..(frame + 1) * self.len]
    }
}

impl Dataset {
    /// Opens the training and validation clips; test clips stay closed.
    ///
    /// # Errors
    /// Clips that cannot be read, no clip to train on, settings that fit no network.
    pub fn new(capture: Capture, settings: &TrainConfig) -> Result<Self, TrainError> {
        let spec = MotionSpec::new(
            settings.model.layout,
            settings.model.velocity,
            capture.contact_joints,
            &capture.character,
        )?;
        let (train, validation) = split(&capture, settings.seed)?;
        let load = |names: &[String]| -> Result<Vec<PreparedClip>, TrainError> {
            let prepare = |name: &String| {
                let captured = capture.load_clip(name)?;
                Ok(PreparedClip::new(&spec, &capture.character.skeleton, captured))
            };
            names.par_iter().map(prepare).collect()
        };
        let (clips, validation) = (load(&train)?, load(&validation)?);
        let joints = capture.character.skeleton.len();
        let vectors = clips.iter().flat_map(|c| (0..c.len()).map(|t| c.kinematics.motion(t)));
        let normalisation = Normalisation::fit(joints, settings.model.normalisation, vectors)?;
        let mirror = settings.regularisation.mirror;
        let mirror = mirror.then(|| MirrorMap::new(&capture.character.skeleton)).flatten();
        let motion = clips.iter().map(|c| motion_vectors(c, &normalisation, mirror.as_ref())).collect();
        let measured = measure(&settings.model, &capture, &clips);
        let config = model_config(settings, spec, &capture, measured.as_ref());
        config.check(joints)?;
        Ok(Self {
            config,
            normalisation,
            motion,
            mean_displacement: measured.map_or_else(
                || vec![Vec3::ZERO; capture.garment.rest.vertices.len()],
                |m| m.mean,
            ),
            rest_box: RestBox::of(&capture.garment.rest.vertices),
            clips,
            validation,
            capture,
        })
    }

    /// Can windows be mirrored?
    pub fn mirrors(&self) -> bool {
        self.motion.iter().all(|m| m.mirrored.is_some())
    }

    /// Frames of the longest window that fits every clip, the first frame not counted.
    pub fn longest_unroll(&self) -> usize {
        self.clips.iter().map(|c| c.len().saturating_sub(1)).min().unwrap_or(0)
    }

    /// Seconds of training motion.
    pub fn seconds(&self) -> f64 {
        let frames: usize = self.clips.iter().map(PreparedClip::len).sum();
        frames as f64 / f64::from(self.config.fps)
    }
}

/// Names of the clips to train and to validate on: the capture's validation clips, else one
/// training clip drawn by the seed. A single training clip is both, which is better than nothing.
fn split(capture: &Capture, seed: u64) -> Result<(Vec<String>, Vec<String>), TrainError> {
    let mut train = capture.clip_names(Split::Train).to_vec();
    let mut validation = capture.clip_names(Split::Validation).to_vec();
    if train.is_empty() {
        return Err(TrainError::NoClips { capture: capture.root.clone() });
    }
    if validation.is_empty() {
        let drawn = generator(seed, Stream::Validation, 0).random_range(0..train.len());
        validation = vec![train[drawn].clone()];
        if train.len() > 1 {
            train.remove(drawn);
        }
    }
    Ok((train, validation))
}

fn motion_vectors(clip: &PreparedClip, normalisation: &Normalisation, mirror: Option<&MirrorMap>) -> MotionVectors {
    let normalised = |mut vector: Vec<f32>| {
        normalisation.apply(&mut vector);
        vector
    };
    let frames = || (0..clip.len()).map(|t| clip.kinematics.motion(t));
    MotionVectors {
        len: normalisation.mean.len(),
        plain: frames().flat_map(|c| normalised(c.to_vec())).collect(),
        mirrored: mirror.map(|m| frames().flat_map(|c| normalised(m.apply(c))).collect()),
    }
}

/// What a displacement state needs to know of the training frames.
struct Measured {
    mean: Vec<Vec3>,
    scale_m: f32,
    output_limit: f32,
}

/// Share by which a field output may exceed the largest one of training.
const OUTPUT_MARGIN: f32 = 1.25;

fn measure(settings: &ModelSettings, capture: &Capture, clips: &[PreparedClip]) -> Option<Measured> {
    let StateSettings::Displacement { memory_s, ref inputs } = settings.state else {
        return None;
    };
    let decay = DisplacementConfig { memory_s, scale_m: 1.0, output_limit: 1.0, inputs: inputs.clone() }
        .decay(1.0 / capture.manifest.fps);
    let vertices = capture.garment.rest.vertices.len();
    let by_vertex: Vec<(Vec3, f64, f32)> =
        (0..vertices).into_par_iter().map(|v| measure_vertex(&capture.garment, clips, v, decay)).collect();
    let variance: f64 = by_vertex.iter().map(|m| m.1).sum::<f64>() / (3 * vertices).max(1) as f64;
    let scale_m = (variance.sqrt() as f32).max(1e-4);
    let largest = by_vertex.iter().map(|m| m.2).fold(0.0, f32::max);
    Some(Measured {
        mean: by_vertex.into_iter().map(|m| m.0).collect(),
        scale_m,
        output_limit: OUTPUT_MARGIN * largest / scale_m,
    })
}

/// Mean displacement of a vertex, mean squared deviation from it, and the longest field output
/// |d_t − γ d_{t−1}| that training would ask for.
fn measure_vertex(garment: &Garment, clips: &[PreparedClip], vertex: usize, decay: f32) -> (Vec3, f64, f32) {
    let displacement = |clip: &PreparedClip, t: usize| {
        let frame = PointFrame::new(garment, vertex, clip.kinematics.world_from_rest(t));
        frame.displacement(clip.captured.garment.frame(t)[vertex])
    };
    let tracks: Vec<Vec<Vec3>> = (clips.iter())
        .map(|clip| (0..clip.len()).map(|t| displacement(clip, t)).collect())
        .collect();
    let count = tracks.iter().map(Vec::len).sum::<usize>().max(1);
    let sum = tracks.iter().flatten().fold(glam::DVec3::ZERO, |sum, u| sum + u.as_dvec3());
    let mean = (sum / count as f64).as_vec3();
    let variance = tracks.iter().flatten().map(|&u| f64::from((u - mean).length_squared())).sum::<f64>();
    let steps = tracks.iter().flat_map(|track| track.windows(2));
    let output = |pair: &[Vec3]| ((pair[1] - mean) - (pair[0] - mean) * decay).length();
    (mean, variance / count as f64, steps.map(output).fold(0.0, f32::max))
}

fn model_config(
    settings: &TrainConfig,
    spec: MotionSpec,
    capture: &Capture,
    measured: Option<&Measured>,
) -> ModelConfig {
    let model = &settings.model;
    let state = match (&model.state, measured) {
        (StateSettings::Displacement { memory_s, inputs }, Some(measured)) => {
            StateConfig::Displacement(DisplacementConfig {
                memory_s: *memory_s,
                scale_m: measured.scale_m,
                output_limit: measured.output_limit,
                inputs: inputs.clone(),
            })
        }
        _ => StateConfig::Position,
    };
    ModelConfig {
        fps: capture.manifest.fps,
        motion: spec,
        encoder: model.encoder.clone(),
        field: model.field,
        state,
        intersection: match settings.intersection.at_inference {
            true => IntersectionMode::Paper { relaxation_m: settings.intersection.relaxation_m },
            false => IntersectionMode::Off,
        },
    }
}
