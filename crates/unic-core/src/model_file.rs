//! The model file: one safetensors file, opened in Python by the `safetensors` package.
//!
//! Tensors are named `encoder.N.weight`, `field.N.bias`, `garment.vertices`, ...; the metadata key
//! `unic` holds a JSON object with the format version, a checksum of the file, the configuration and the
//! provenance.

mod checksum;
mod read;
mod write;

use crate::{
    character::Garment,
    config::ModelConfig,
    mesh::MeshError,
    model::{About, Model, ModelError, ModelParts},
    sampling::Sampling,
    shown::shortened,
    skeleton::SkeletonError,
    skinning::WeightsError,
};
pub use checksum::{Integrity, verify_checksum};
use read::Source;
use safetensors::{SafeTensorError, SafeTensors};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use thiserror::Error;

/// Version that this build writes, and the only one it reads.
pub const FORMAT_VERSION: u32 = 1;
const METADATA_KEY: &str = "unic";

/// Why bytes are no model.
#[derive(Debug, Error)]
pub enum ModelFileError {
    /// Not safetensors, or damaged.
    #[error("expected a unic model (safetensors), found bytes that are none: {}", shortened(&.0.to_string()))]
    Container(#[from] SafeTensorError),
    /// Safetensors of something else.
    #[error("expected a unic model, found a safetensors file without `unic` metadata")]
    NotUnic,
    /// Metadata that cannot be read.
    #[error("expected the metadata of a unic model, found JSON that is not: {}", shortened(&.0.to_string()))]
    Metadata(#[from] serde_json::Error),
    /// Written by another version.
    #[error(
        "expected model format version {expected}, found {found}; convert it with the unic that wrote it"
    )]
    Version {
        /// The version that this build reads.
        expected: u32,
        /// The version of the file.
        found: u32,
    },
    /// The bytes are not those that were written.
    #[error("the file is damaged: expected its bytes to have the checksum {expected}, found {found}")]
    Damaged {
        /// The checksum in the file.
        expected: String,
        /// The checksum of the file.
        found: String,
    },
    /// A checksum of another kind.
    #[error("expected a checksum `crc32:` with eight hexadecimal digits, found {}", shortened(.0))]
    UnknownChecksum(String),
    /// The state `position`: positions in the frame of the first root pose, which hold the distance travelled. Nothing
    /// reads it.
    #[error(
        "expected a state relative to the root joint (`root_relative`), found `position`, which holds the distance \
         travelled; train the model again"
    )]
    TravellingState,
    /// A tensor that is missing, of another type or shape, or of no use.
    #[error(
        "tensor `{}`: expected {}, found {}",
        shortened(name),
        shortened(expected),
        shortened(found)
    )]
    Tensor {
        /// Its name.
        name: String,
        /// Type and shape.
        expected: String,
        /// What the file has.
        found: String,
    },
    /// A skeleton that is none.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// A mesh that is none.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Skinning weights that are none.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Parts that do not fit together.
    #[error(transparent)]
    Model(#[from] ModelError),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata {
    version: u32,
    /// Checksum of the file, before everything whose text users choose: the first such digits in the file are these.
    #[serde(default)]
    checksum: Option<String>,
    config: ModelConfig,
    joint_names: Vec<String>,
    about: About,
}

impl Model {
    /// The bytes of the model file; the same model always gives the same bytes.
    ///
    /// # Errors
    /// None that a checked model can cause; serialisation failures are passed on.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelFileError> {
        let parts = self.to_parts();
        let metadata = Metadata {
            version: FORMAT_VERSION,
            checksum: Some(checksum::UNKNOWN.to_owned()),
            joint_names: parts.character.skeleton.names().to_vec(),
            config: parts.config.clone(),
            about: parts.about.clone(),
        };
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), serde_json::to_string(&metadata)?)]);
        checksum::seal(write::serialised(&parts, self.sampling(), metadata)?)
    }

    /// Reads a model from the bytes of its file, which are compared with its checksum.
    ///
    /// # Errors
    /// Says what was expected and what was found; the caller knows the file's name.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Self::from_bytes_with(bytes, Integrity::Check)
    }

    /// The same with or without the comparison, which reads all bytes once more (docs/model-file.md has its time).
    /// Everything else is judged in either case: no bytes make this panic.
    ///
    /// # Errors
    /// The errors of [`Model::from_bytes`].
    pub fn from_bytes_with(bytes: &[u8], integrity: Integrity) -> Result<Self, ModelFileError> {
        let metadata = read_metadata(bytes, integrity)?;
        let file = Source::open(bytes)?;
        let character = file.character(metadata.joint_names)?;
        // Sizes are judged before anything is read by them.
        metadata
            .config
            .check(character.skeleton.len())
            .map_err(ModelError::from)?;
        let parts = ModelParts {
            encoder: file.layers("encoder", metadata.config.encoder.hidden.len() + 1)?,
            field: file.layers("field", metadata.config.field.hidden_layers + 1)?,
            normalisation: file.normalisation()?,
            character,
            garment: Garment {
                rest: file.garment_mesh()?,
                weights: file.weights("garment")?,
                mask: file.mask()?,
            },
            prior: file.prior()?,
            rest_box: file.rest_box()?,
            config: metadata.config,
            about: metadata.about,
        };
        let samples = file.samples()?;
        file.check_all_read()?;
        let mut model = Self::new(parts)?;
        if let Some(samples) = samples {
            let sampling = Sampling::new(&model.garment.rest, samples);
            model.sampling = Some(sampling.map_err(ModelError::from)?);
        }
        Ok(model)
    }
}

fn read_metadata(bytes: &[u8], integrity: Integrity) -> Result<Metadata, ModelFileError> {
    let any = metadata(bytes)?;
    if integrity == Integrity::Check {
        checksum::check(bytes, &any)?;
    }
    if any.pointer("/config/state").and_then(Value::as_str) == Some("position") {
        return Err(ModelFileError::TravellingState);
    }
    Ok(serde_json::from_value(any)?)
}

/// Metadata of this build's version, its keys unread: other versions may have others.
fn metadata(bytes: &[u8]) -> Result<Value, ModelFileError> {
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let text = (header.metadata().as_ref())
        .and_then(|m| m.get(METADATA_KEY))
        .ok_or(ModelFileError::NotUnic)?;
    let any: Value = serde_json::from_str(text)?;
    let found = any["version"]
        .as_u64()
        .and_then(|v| u32::try_from(v).ok())
        .unwrap_or(0);
    match found {
        FORMAT_VERSION => Ok(any),
        _ => Err(ModelFileError::Version {
            expected: FORMAT_VERSION,
            found,
        }),
    }
}
