//! Trained model: everything that the runtime needs, immutable and shared by all animators.
//!
//! For engines, which read a [`Model`] from its file ([`Model::from_bytes`]). Training and tools
//! make models from [`ModelParts`].

use crate::{
    animator::component_sizes,
    character::{Character, Garment},
    config::{ConfigError, ModelConfig, StateConfig},
    features::RestBox,
    mesh::{MeshError, TriMesh},
    motion::{MotionError, Normalisation},
    network::{Encoder, Field, LayerError, Linear, Precision},
    prior::Prior,
    projection::{LimitCountError, StrainLimit, StrainProjection},
    recurrence::Recurrence,
    replay::ReplayError,
    sampling::{Sampling, SamplingError},
    surface_map::{SurfaceMap, SurfaceMapError},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Provenance of a model. The runtime reads nothing but the errors by precision
/// ([`PrecisionErrors`](crate::PrecisionErrors)).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Name of the capture.
    #[serde(default)]
    pub name: String,
    /// Source and licence of the training data.
    #[serde(default)]
    pub provenance: String,
    /// Settings and results of training.
    #[serde(default)]
    pub training: serde_json::Value,
}

/// Parts of a model, not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelParts {
    /// Sizes of the networks and meaning of the state.
    pub config: ModelConfig,
    /// Body and skeleton.
    pub character: Character,
    /// Rest shape and skinning weights.
    pub garment: Garment,
    /// Expected displacements in a given motion; not read if the state is a root-relative position.
    pub prior: Prior,
    /// Bounding box that rest positions are scaled by.
    pub rest_box: RestBox,
    /// Statistics of the motion vector.
    pub normalisation: Normalisation,
    /// Linear maps of the encoder.
    pub encoder: Vec<Linear>,
    /// Linear maps of the field.
    pub field: Vec<Linear>,
    /// Limits of the [`limited_pairs`](crate::projection::limited_pairs), in their order; empty
    /// without a projection.
    pub strain_limits: Vec<StrainLimit>,
    /// Provenance.
    pub about: About,
}

/// Trained model, checked and packed for this machine; shared by [`Animator`](crate::Animator)s
/// through an `Arc`.
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
    /// Mean square lengths of the prior's components, square metres.
    pub(crate) component_sizes: Vec<f32>,
    /// Strain projection of the shown garment, if the model has one.
    pub(crate) projection: Option<StrainProjection>,
    /// Vertices that carry the state; `None` if all vertices do.
    pub(crate) sampling: Option<Sampling>,
    pub(crate) about: About,
}

/// Error: parts that do not make a model.
#[derive(Debug, Error, PartialEq)]
pub enum ModelError {
    /// A configuration with a value that is not accepted.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A layer of another size than the configuration's.
    #[error(transparent)]
    Layer(#[from] LayerError),
    /// Two arrays that should have the same length.
    #[error("model: expected {expected} {what}, found {found}")]
    Count {
        /// Name of the counted things.
        what: &'static str,
        /// Number in the other parts.
        expected: usize,
        /// Number in this part.
        found: usize,
    },
    /// A face with an index beyond the vertices, or a position that is not finite.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Limits of the strain projection that are not those of the garment.
    #[error(transparent)]
    Limits(#[from] LimitCountError),
    /// A mesh that nothing can be transferred from or to.
    #[error(transparent)]
    Surface(#[from] SurfaceMapError),
    /// A motion specification or a normalisation that is not usable for the skeleton.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A replay that fits no prior, or with numbers that are not usable.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A share or a list of samples that is not usable.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// A number that is NaN or infinite, or not above zero where it is a size or a limit.
    #[error("model: {0} has numbers that are not usable")]
    Unusable(&'static str),
}

impl Model {
    /// Makes a model in f32 from parts that fit together.
    ///
    /// # Errors
    /// Sizes that differ from the configuration's or from one another, numbers that are not finite.
    pub fn new(parts: ModelParts) -> Result<Self, ModelError> {
        // Ordered so that each check can rely on the ones before it.
        let joints = parts.character.skeleton.len();
        parts.config.check(joints)?;
        parts.config.motion.check(&parts.character.skeleton)?;
        parts.garment.rest.check()?;
        parts.character.body.check()?;
        if let Some(mesh) = &parts.character.file_mesh {
            mesh.check(parts.character.body.vertices.len())?;
        }
        check_counts(&parts, joints)?;
        let motion = parts.config.motion.len(joints);
        check_strain_limits(&parts)?;
        check_recurrence(&parts.prior, 2 * motion)?;
        check_replay(&parts.prior, motion)?;
        parts.normalisation.check(motion)?;
        check_numbers(&parts)?;
        let config = parts.config;
        let inputs = 2 * motion;
        let latent = config.encoder.latent_len();
        let mask = parts.garment.mask.as_deref();
        let projection = (config.projection)
            .map(|p| StrainProjection::new(p, &parts.garment.rest, mask, parts.strain_limits))
            .transpose()?;
        let field = Field::new(&config.field, config.state.input_len(), latent, parts.field)?;
        check_excursion(&config, &field)?;
        Ok(Self {
            projection,
            encoder: Encoder::new(&config.encoder, inputs, parts.encoder)?,
            field,
            component_sizes: component_sizes(&parts.prior),
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

    /// Returns the same model with networks in another precision; in its file they stay f32.
    ///
    /// Packed weights belong to the model, so that animators which share it share them.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.encoder = self.encoder.with_precision(precision);
        self.field = self.field.with_precision(precision);
        self
    }

    /// Returns the same model without a [replay](crate::replay) of wrinkles.
    pub fn without_replay(&self) -> Self {
        let prior = self.prior.without_replay();
        Self {
            component_sizes: component_sizes(&prior),
            prior,
            ..self.clone()
        }
    }

    /// Number format of the networks' products.
    pub fn precision(&self) -> Precision {
        self.field.precision()
    }

    /// Returns the same model with the networks evaluated at a share of the vertices, 0 to 1.
    ///
    /// The sampled vertices are spread evenly over the garment. The state of all others is
    /// interpolated. At a share of 1 all vertices are evaluated.
    ///
    /// # Errors
    /// A share outside of that range.
    pub fn with_sampling(mut self, share: f32) -> Result<Self, ModelError> {
        // Made at a share of 1, too, because this checks the share.
        let sampling = Sampling::of_share(&self.garment.rest, share)?;
        self.sampling = (share < 1.0).then_some(sampling);
        Ok(self)
    }

    /// Sampled vertices that carry the state; `None` if all vertices do.
    pub fn sampling(&self) -> Option<&Sampling> {
        self.sampling.as_ref()
    }

    /// Copies the parts of the model, to write or change them.
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
            strain_limits: self
                .projection
                .as_ref()
                .map_or(Vec::new(), |p| p.limits().to_vec()),
            about: self.about.clone(),
        }
    }

    /// Configuration: frame rate, sizes of the networks, meaning of the state.
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }

    /// Character that wears the garment: body and skeleton.
    pub fn character(&self) -> &Character {
        &self.character
    }

    /// Rest shape and skinning weights of the garment.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }

    /// Expected displacements in a given motion.
    pub fn prior(&self) -> &Prior {
        &self.prior
    }

    /// Bounding box that rest positions are scaled by.
    pub fn rest_box(&self) -> &RestBox {
        &self.rest_box
    }

    /// Means and standard deviations of the motion vector.
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

    /// Strain projection of the shown garment, if the model has one.
    pub fn projection(&self) -> Option<&StrainProjection> {
        self.projection.as_ref()
    }

    /// Provenance of the model.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Returns true if a step leaves encoder and field out: the field's output is zero, and is
    /// added to displacements. Results are the same bytes, but no state is interpolated between
    /// [samples](Self::with_sampling).
    pub fn is_field_skipped(&self) -> bool {
        self.field.is_zero() && self.config.state != StateConfig::RootRelative
    }

    /// Mean square length of each component of the prior over the vertices, square metres.
    pub fn component_sizes(&self) -> &[f32] {
        &self.component_sizes
    }

    /// Number of garment vertices V.
    pub fn vertex_count(&self) -> usize {
        self.garment.rest.vertices.len()
    }

    /// Number of trained parameters of encoder, field and the prior's recurrence.
    pub fn parameter_count(&self) -> usize {
        let count = |l: &Linear| l.weight.len() + l.bias.len();
        let recurrence = &self.prior.recurrence;
        let layers = recurrence.iter().flat_map(|r| r.layers().map(|(_, l)| l));
        // Rows of replayed components are zero, and not trained.
        let still = |r: &Recurrence| self.prior.replayed_len() * (r.head.inputs + 1);
        let all: usize = (self.encoder.layers().iter())
            .chain(self.field.layers())
            .chain(layers)
            .map(count)
            .sum();
        all - recurrence.as_ref().map_or(0, still)
    }

    /// Returns the same model with a mask on its displacements from skinning.
    ///
    /// `mask` has one number a vertex, from 1 (the model) to 0 (the rest shape, skinned by the
    /// garment's [carriers](Garment::carriers)). It multiplies a mask that the model has already.
    ///
    /// # Errors
    /// Another number of values than vertices, values outside [0, 1], a root-relative state.
    pub fn with_mask(&self, mask: &[f32]) -> Result<Self, ModelError> {
        if mask.len() != self.vertex_count() {
            return Err(ModelError::Count {
                what: "numbers in the garment's mask",
                expected: self.vertex_count(),
                found: mask.len(),
            });
        }
        let mut parts = self.to_parts();
        if let Some(carriers) = &self.garment.carriers {
            // Weights that are fitted to motion leave a raised arm; what skins the garment does not.
            // The new model refuses numbers below 0, above 1 and NaN, which no weights have here.
            let share = |vertex: usize| match mask[vertex] > 0.0 {
                true => mask[vertex].min(1.0),
                false => 0.0,
            };
            let blended = carriers.blended(&self.garment.weights, share);
            parts.garment.weights = blended.map_err(SurfaceMapError::from)?;
        }
        let share = |(vertex, m): (usize, &f32)| m * self.garment.share(vertex);
        parts.garment.mask = Some(mask.iter().enumerate().map(share).collect());
        let vertices = parts.prior.mean.iter_mut().zip(mask);
        vertices.for_each(|(mean, m)| *mean *= *m);
        parts.prior.components = self.prior.components.masked(mask);
        self.rebuilt(parts)
    }

    /// Returns the same model on another mesh of the same garment, in the same rest space.
    ///
    /// The field needs no mesh: its inputs belong to a point. Skinning weights, carriers, the mask and
    /// the prior are interpolated at the closest points of the rest shape that the model was trained
    /// on.
    ///
    /// # Errors
    /// A rest shape without a usable face, positions that are not finite.
    pub fn with_mesh(&self, mesh: TriMesh) -> Result<Self, ModelError> {
        let map = SurfaceMap::new(&self.garment.rest, &mesh.vertices)?;
        let mut parts = self.to_parts();
        parts.prior = self.prior.on_mesh(&map)?;
        parts.garment.weights = map.interpolate_weights(&self.garment.weights)?;
        parts.garment.carriers = self
            .garment
            .carriers
            .as_ref()
            .map(|carriers| map.interpolate_weights(carriers))
            .transpose()?;
        parts.garment.mask = self
            .garment
            .mask
            .as_ref()
            .map(|m| map.interpolate_scalars(m))
            .transpose()?;
        parts.strain_limits = match &self.projection {
            Some(projection) => projection.limits_on_mesh(&self.garment.rest, &mesh, &map)?,
            None => Vec::new(),
        };
        parts.garment.rest = mesh;
        self.rebuilt(parts)
    }

    /// Makes a model of changed parts, with this model's precision and share of samples.
    fn rebuilt(&self, parts: ModelParts) -> Result<Self, ModelError> {
        let share = self.sampling.as_ref().map_or(1.0, Sampling::share);
        let rebuilt = Self::new(parts)?.with_precision(self.precision());
        rebuilt.with_sampling(share)
    }
}

/// Checks that nothing adds to displacements that stay.
fn check_excursion(config: &ModelConfig, field: &Field) -> Result<(), ConfigError> {
    match &config.state {
        StateConfig::Displacement(d) if d.excursion_m.is_some() && !field.is_zero() => Err(ConfigError {
            what: "state.excursion_m",
            expected: "none, because the field is not zero".to_owned(),
            found: d.excursion_m.unwrap_or_default().to_string(),
        }),
        _ => Ok(()),
    }
}

/// Checks that arrays of all parts have the lengths that the mesh and the skeleton ask for.
fn check_counts(parts: &ModelParts, joints: usize) -> Result<(), ModelError> {
    let vertices = parts.garment.rest.vertices.len();
    let body = parts.character.body.vertices.len();
    let motion = parts.config.motion.len(joints);
    let counts = [
        // Passes for any number of vertices but zero.
        ("garment vertices or more", 1, vertices.min(1)),
        (
            "rows of garment skinning weights",
            vertices,
            parts.garment.weights.len(),
        ),
        (
            "rows of the garment's carriers",
            vertices,
            parts.garment.carriers().len(),
        ),
        (
            "joints in the garment's carriers",
            joints,
            parts.garment.carriers().joint_count(),
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
            "components of the prior",
            parts.prior.len(),
            parts.prior.components.len(),
        ),
        (
            "numbers in the prior's components",
            3 * vertices * parts.prior.len(),
            parts.prior.components.coordinates().len(),
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
    all_equal(&counts)
}

/// Compares the names, expected and found values of counts.
fn all_equal(counts: &[(&'static str, usize, usize)]) -> Result<(), ModelError> {
    match counts.iter().find(|(_, expected, found)| expected != found) {
        None => Ok(()),
        Some(&(what, expected, found)) => Err(ModelError::Count {
            what,
            expected,
            found,
        }),
    }
}

fn check_strain_limits(parts: &ModelParts) -> Result<(), ModelError> {
    if parts.config.projection.is_none() && !parts.strain_limits.is_empty() {
        let found = parts.strain_limits.len();
        return Err(LimitCountError { expected: 0, found }.into());
    }
    // Written so that NaN fails.
    let usable = |l: &StrainLimit| {
        l.shortest >= 0.0 && l.longest > 0.0 && l.shortest <= l.longest && l.longest.is_finite()
    };
    match parts.strain_limits.iter().all(usable) {
        true => Ok(()),
        false => Err(ModelError::Unusable("the strain projection")),
    }
}

fn check_recurrence(prior: &Prior, inputs: usize) -> Result<(), ModelError> {
    match &prior.recurrence {
        Some(_) if prior.is_empty() => Err(ModelError::Unusable(
            "a recurrence, where the prior has no components,",
        )),
        Some(recurrence) => Ok(recurrence.check(inputs, prior.len())?),
        None => Ok(()),
    }
}

/// Checks that a replay is for motion vectors of `motion` numbers and for some of the prior's
/// coefficients.
fn check_replay(prior: &Prior, motion: usize) -> Result<(), ModelError> {
    let Some(replay) = &prior.replay else {
        return Ok(());
    };
    let replayed = replay.library().coefficients();
    let counts = [
        ("inputs of the replay", motion, replay.keys().inputs()),
        ("coefficients of the replay", replayed.min(prior.len()), replayed),
    ];
    all_equal(&counts)
}

/// Checks that all numbers are finite and within their range.
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
            // A root-relative state has no displacement from skinning to be masked.
            parts.garment.mask.is_none() || parts.config.state != StateConfig::RootRelative,
        ),
        ("the encoder", layers(&parts.encoder)),
        ("the field", layers(&parts.field)),
        (
            "the prior",
            points(&parts.prior.mean) && parts.prior.components.is_usable(),
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
