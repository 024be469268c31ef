//! The trained asset: everything that the runtime needs, immutable and shared by all instances.

use crate::{
    character::{Character, Garment},
    config::{ConfigError, ModelConfig, StateConfig},
    features::RestBox,
    mesh::{MeshError, TriMesh},
    motion::{MotionError, Normalisation, motion_len},
    network::{Encoder, Field, LayerError, Linear, Precision},
    prior::Prior,
    sampling::{Sampling, SamplingError},
    surface_map::{SurfaceMap, SurfaceMapError},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Where a model comes from; shown by `unic inspect`, read by nobody else.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Name of the capture.
    #[serde(default)]
    pub name: String,
    /// Source and licence of the training data.
    #[serde(default)]
    pub provenance: String,
    /// Training settings and results, as the trainer wrote them.
    #[serde(default)]
    pub training: serde_json::Value,
}

/// The parts of a model, as training leaves them or a file holds them.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelParts {
    /// Sizes and meanings.
    pub config: ModelConfig,
    /// Body and skeleton.
    pub character: Character,
    /// Rest shape and skinning weights.
    pub garment: Garment,
    /// Where the garment hangs in a given motion; zeros where the state is a position.
    pub prior: Prior,
    /// Bounding box that rest positions are scaled to.
    pub rest_box: RestBox,
    /// Statistics of the motion vector.
    pub normalisation: Normalisation,
    /// Linear maps of the encoder.
    pub encoder: Vec<Linear>,
    /// Linear maps of the field.
    pub field: Vec<Linear>,
    /// Provenance.
    pub about: About,
}

/// A checked model, ready to run. Share it by `Arc` between [`crate::animator::Animator`]s.
#[derive(Clone, Debug)]
pub struct Model {
    pub(crate) config: ModelConfig,
    pub(crate) character: Character,
    pub(crate) garment: Garment,
    pub(crate) prior: Prior,
    pub(crate) rest_box: RestBox,
    pub(crate) normalisation: Normalisation,
    pub(crate) encoder: Encoder,
    pub(crate) field: Field,
    /// None where all vertices carry the state.
    pub(crate) sampling: Option<Sampling>,
    pub(crate) about: About,
}

/// Parts that do not fit together.
#[derive(Debug, Error, PartialEq)]
pub enum ModelError {
    /// A configuration that means nothing.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A layer of another size than the configuration's.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// Two arrays that should have the same length.
    #[error("model: expected {expected} {what}, found {found}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// By the other parts.
        expected: usize,
        /// In this part.
        found: usize,
    },
    /// A face that names no vertex, a position that is not finite.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A mesh that nothing can be carried over from or to.
    #[error(transparent)]
    Surface(#[from] SurfaceMapError),
    /// A motion vector that cannot be made for this skeleton, statistics that cannot normalise it.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Samples that are none.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// NaN or infinity, or zero and less where a size or a limit is meant.
    #[error("model: {0} has numbers that are not usable")]
    Unusable(&'static str),
}

impl Model {
    /// Checks that the parts fit together and packs the networks for this machine, in f32.
    ///
    /// # Errors
    /// Sizes that differ from the configuration's or from one another, numbers that are not finite.
    pub fn new(parts: ModelParts) -> Result<Self, ModelError> {
        let joints = parts.character.skeleton.len();
        parts.config.check(joints)?;
        parts.config.motion.check(&parts.character.skeleton)?;
        parts.garment.rest.check()?;
        parts.character.body.check()?;
        check_counts(&parts, joints)?;
        let motion = motion_len(joints);
        check_recurrence(&parts.prior, 2 * motion)?;
        parts.normalisation.check(joints)?;
        check_numbers(&parts)?;
        let config = parts.config;
        let inputs = 2 * motion;
        let latent = config.encoder.latent_len();
        Ok(Self {
            encoder: Encoder::new(&config.encoder, inputs, parts.encoder)?,
            field: Field::new(&config.field, config.state.input_len(), latent, parts.field)?,
            config,
            character: parts.character,
            garment: parts.garment,
            prior: parts.prior,
            rest_box: parts.rest_box,
            normalisation: parts.normalisation,
            sampling: None,
            about: parts.about,
        })
    }

    /// The same model with networks that calculate in another precision; its file stays f32.
    ///
    /// Packed weights belong to the model, so that all animators that share it share them.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.encoder = self.encoder.with_precision(precision);
        self.field = self.field.with_precision(precision);
        self
    }

    /// What the networks calculate in.
    pub fn precision(&self) -> Precision {
        self.field.precision()
    }

    /// The same model with its state on a well-spread `share` of the vertices (0 to 1) and the others
    /// interpolated; all of them at 1.
    ///
    /// # Errors
    /// A share that is none.
    pub fn with_sampling(mut self, share: f32) -> Result<Self, ModelError> {
        let sampling = Sampling::of_share(&self.garment.rest, share)?;
        self.sampling = (share < 1.0).then_some(sampling);
        Ok(self)
    }

    /// Vertices that carry the state; none where all do.
    pub fn sampling(&self) -> Option<&Sampling> {
        self.sampling.as_ref()
    }

    /// The parts again, for writing or changing them.
    pub fn to_parts(&self) -> ModelParts {
        ModelParts {
            config: self.config.clone(),
            character: self.character.clone(),
            garment: self.garment.clone(),
            prior: self.prior.clone(),
            rest_box: self.rest_box,
            normalisation: self.normalisation.clone(),
            encoder: self.encoder.layers().to_vec(),
            field: self.field.layers().to_vec(),
            about: self.about.clone(),
        }
    }

    /// Sizes and meanings.
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }

    /// The body that the garment is worn on.
    pub fn character(&self) -> &Character {
        &self.character
    }

    /// Rest shape and skinning weights of the garment.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }

    /// Where the garment hangs in a given motion.
    pub fn prior(&self) -> &Prior {
        &self.prior
    }

    /// Bounding box that rest positions are scaled to.
    pub fn rest_box(&self) -> &RestBox {
        &self.rest_box
    }

    /// Statistics of the motion vector.
    pub fn normalisation(&self) -> &Normalisation {
        &self.normalisation
    }

    /// Motion encoder.
    pub fn encoder(&self) -> &Encoder {
        &self.encoder
    }

    /// Deformation field.
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// Provenance.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Number of garment vertices V.
    pub fn vertex_count(&self) -> usize {
        self.garment.rest.vertices.len()
    }

    /// Number of trained numbers of the networks: encoder, field and the prior's recurrence.
    pub fn parameter_count(&self) -> usize {
        let count = |l: &Linear| l.weight.len() + l.bias.len();
        let recurrence = self
            .prior
            .recurrence
            .iter()
            .flat_map(|r| r.layers().map(|(_, l)| l));
        (self.encoder.layers().iter())
            .chain(self.field.layers())
            .chain(recurrence)
            .map(count)
            .sum()
    }

    /// The same model under a mask: a number in [0, 1] a vertex, the share of its displacement from skinning
    /// that it keeps. Shares multiply with those of a mask that is there already.
    ///
    /// # Errors
    /// Another number of values than vertices, values outside [0, 1], a state without skinning.
    pub fn with_mask(&self, mask: &[f32]) -> Result<Self, ModelError> {
        if mask.len() != self.vertex_count() {
            return Err(ModelError::Count {
                what: "numbers in the garment's mask",
                expected: self.vertex_count(),
                found: mask.len(),
            });
        }
        let mut parts = self.to_parts();
        let share = |(vertex, m): (usize, &f32)| m * self.garment.share(vertex);
        parts.garment.mask = Some(mask.iter().enumerate().map(share).collect());
        let shapes = self.prior.len().max(1);
        let vertices = parts.prior.mean.iter_mut().zip(mask);
        vertices.for_each(|(mean, m)| *mean *= *m);
        let vertices = parts.prior.shapes.chunks_exact_mut(shapes).zip(mask);
        vertices.for_each(|(shapes, m)| shapes.iter_mut().for_each(|s| *s *= *m));
        self.changed(parts)
    }

    /// The same model on another mesh of the same garment, given in the same rest space: a field
    /// does not know about meshes. Skinning weights, the mask and the prior's shapes are taken from the
    /// closest points of the rest shape that the model was trained on.
    ///
    /// # Errors
    /// A rest shape without a usable face; points that are not finite.
    pub fn with_mesh(&self, mesh: TriMesh) -> Result<Self, ModelError> {
        let map = SurfaceMap::new(&self.garment.rest, &mesh.vertices)?;
        let mut parts = self.to_parts();
        parts.prior = self.prior.on_mesh(&map)?;
        parts.garment.weights = map.weights(&self.garment.weights)?;
        parts.garment.mask = self.garment.mask.as_ref().map(|m| map.numbers(m)).transpose()?;
        parts.garment.rest = mesh;
        self.changed(parts)
    }

    /// Of changed parts, with this model's precision and share of samples.
    fn changed(&self, parts: ModelParts) -> Result<Self, ModelError> {
        let share = self.sampling.as_ref().map_or(1.0, Sampling::share);
        let changed = Self::new(parts)?.with_precision(self.precision());
        changed.with_sampling(share)
    }
}

fn check_counts(parts: &ModelParts, joints: usize) -> Result<(), ModelError> {
    let vertices = parts.garment.rest.vertices.len();
    let body = parts.character.body.vertices.len();
    let motion = motion_len(joints);
    let counts = [
        ("garment vertices or more", 1, vertices.min(1)),
        (
            "rows of garment skinning weights",
            vertices,
            parts.garment.weights.len(),
        ),
        (
            "numbers in the garment's mask",
            vertices,
            parts.garment.mask.as_ref().map_or(vertices, Vec::len),
        ),
        (
            "joints in the garment's skinning weights",
            joints,
            parts.garment.weights.joint_count(),
        ),
        ("mean displacements", vertices, parts.prior.mean.len()),
        (
            "displacement shapes",
            vertices * parts.prior.len(),
            parts.prior.shapes.len(),
        ),
        ("inputs of the prior", 2 * motion, parts.prior.map.inputs),
        (
            "weights of the prior",
            2 * motion * parts.prior.len(),
            parts.prior.map.weight.len(),
        ),
        (
            "biases of the prior",
            parts.prior.len(),
            parts.prior.map.bias.len(),
        ),
        (
            "rows of body skinning weights",
            body,
            parts.character.weights.len(),
        ),
        (
            "joints in the body's skinning weights",
            joints,
            parts.character.weights.joint_count(),
        ),
    ];
    match counts.into_iter().find(|(_, expected, found)| expected != found) {
        None => Ok(()),
        Some((what, expected, found)) => Err(ModelError::Count {
            what,
            expected,
            found,
        }),
    }
}

fn check_recurrence(prior: &Prior, inputs: usize) -> Result<(), ModelError> {
    match &prior.recurrence {
        Some(_) if prior.is_empty() => Err(ModelError::Unusable("a recurrence without shapes")),
        Some(recurrence) => Ok(recurrence.check(inputs, prior.len())?),
        None => Ok(()),
    }
}

fn check_numbers(parts: &ModelParts) -> Result<(), ModelError> {
    let finite = |values: &[f32]| values.iter().all(|x| x.is_finite());
    let layers = |layers: &[Linear]| layers.iter().all(|l| finite(&l.weight) && finite(&l.bias));
    let points = |points: &[Vec3]| points.iter().all(|p| p.is_finite());
    let positive = |x: f32| x.is_finite() && x > 0.0;
    let mask = parts.garment.mask.as_deref().unwrap_or_default();
    let checks = [
        ("the garment's mask", mask.iter().all(|m| (0.0..=1.0).contains(m))),
        (
            "a mask, where the state is no displacement from skinning,",
            parts.garment.mask.is_none() || parts.config.state != StateConfig::RootRelative,
        ),
        ("the encoder", layers(&parts.encoder)),
        ("the field", layers(&parts.field)),
        (
            "the prior",
            points(&parts.prior.mean) && points(&parts.prior.shapes),
        ),
        ("the prior's map", layers(std::slice::from_ref(&parts.prior.map))),
        (
            "the prior's recurrence",
            (parts.prior.recurrence.iter())
                .all(|r| r.is_stable() && r.layers().iter().all(|(_, l)| layers(std::slice::from_ref(*l)))),
        ),
        (
            "the limit of the normalisation",
            parts.normalisation.limit.is_none_or(positive),
        ),
        (
            "the bounding box",
            parts.rest_box.centre.is_finite() && positive(parts.rest_box.half_extent),
        ),
    ];
    match checks.into_iter().find(|(_, usable)| !usable) {
        None => Ok(()),
        Some((what, _)) => Err(ModelError::Unusable(what)),
    }
}
