//! Model file: reading, writing and its checksum.
//!
//! For tools. Engines call [`Model::from_bytes`] and need the error type [`ModelFileError`] alone.
//!
//! The file is a safetensors file, which the Python package `safetensors` opens. Tensors are named
//! `encoder.N.weight`, `field.N.bias`, `garment.vertices` and so on. The metadata key `unic` holds
//! a JSON object with the format version, a checksum of the file, the configuration and the
//! provenance.

mod checksum;
mod read;
mod write;

use crate::{
    character::Garment,
    config::ModelConfig,
    mesh::MeshError,
    model::{About, Model, ModelError, ModelParts},
    printable::printable_excerpt,
    sampling::Sampling,
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

/// Format version that this build writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 1;
const METADATA_KEY: &str = "unic";

/// Error: bytes that are not a readable model file.
#[derive(Debug, Error)]
pub enum ModelFileError {
    /// Bytes that are not safetensors, or damaged.
    #[error("expected a unic model (safetensors), found bytes that are none: {}", printable_excerpt(&.0.to_string()))]
    Container(#[from] SafeTensorError),
    /// A safetensors file of another program.
    #[error("expected a unic model, found a safetensors file without `unic` metadata")]
    NotUnic,
    /// Metadata that are not JSON of the expected form.
    #[error("expected the metadata of a unic model, found JSON that is not: {}", printable_excerpt(&.0.to_string()))]
    Metadata(#[from] serde_json::Error),
    /// A file of another format version.
    #[error(
        "expected model format version {expected}, found {found}; convert it with the unic that wrote it"
    )]
    Version {
        /// Version that this build reads.
        expected: u32,
        /// Version of the file.
        found: u32,
    },
    /// Bytes that have changed since they were written.
    #[error("the file is damaged: expected its bytes to have the checksum {expected}, found {found}")]
    Damaged {
        /// Checksum that the file states.
        expected: String,
        /// Checksum of the file's bytes.
        found: String,
    },
    /// A checksum of another algorithm.
    #[error("expected a checksum `crc32:` with eight hexadecimal digits, found {}", printable_excerpt(.0))]
    UnknownChecksum(String),
    /// A state named `position`, in the frame of the first root pose, which contains the distance
    /// travelled. This build does not read it.
    #[error(
        "expected a state relative to the root joint (`root_relative`), found `position`, which holds the distance \
         travelled; train the model again"
    )]
    UnsupportedState,
    /// A tensor that is missing, unknown, or of another type or shape, or whose numbers are not
    /// usable.
    #[error(
        "tensor `{}`: expected {}, found {}",
        printable_excerpt(name),
        printable_excerpt(expected),
        printable_excerpt(found)
    )]
    Tensor {
        /// Name of the tensor.
        name: String,
        /// Type, shape or numbers that are expected.
        expected: String,
        /// Type, shape or numbers in the file.
        found: String,
    },
    /// Joints that do not make a skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Vertices and faces that do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Skinning weights that are not usable.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Parts that do not make a model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// JSON object under the metadata key.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Metadata {
    version: u32,
    // The checksum stands before every text that users choose. The first occurrence of its digits
    // in the file is therefore this one.
    /// Checksum of the file.
    #[serde(default)]
    checksum: Option<String>,
    config: ModelConfig,
    joint_names: Vec<String>,
    about: About,
}

impl Model {
    /// Returns the bytes of the model file. The same model always gives the same bytes.
    ///
    /// # Errors
    /// A failure to serialise, which a checked model does not cause.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ModelFileError> {
        let parts = self.to_parts();
        let metadata = Metadata {
            version: FORMAT_VERSION,
            checksum: Some(checksum::UNKNOWN.to_owned()),
            joint_names: parts.character.skeleton.names().to_vec(),
            config: parts.config.clone(),
            about: parts.about.clone(),
        };
        // A single key: with more, the order in a hash map would change the bytes of the file.
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), serde_json::to_string(&metadata)?)]);
        checksum::write_checksum(write::serialised(&parts, self.sampling(), metadata)?)
    }

    /// Reads a model from the bytes of its file and compares them with the file's checksum.
    ///
    /// Its networks have the fastest precision that costs at most
    /// [`Model::ALLOWED_PRECISION_ERROR`] on this machine ([`Model::fastest_precision`]).
    ///
    /// No bytes make this panic.
    ///
    /// # Errors
    /// Bytes that are not a model of this format version, or were damaged. The error names what was
    /// expected and found, and leaves the file's name to the caller.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Self::from_bytes_with(bytes, Integrity::Check)
    }

    /// Reads a model like [`Model::from_bytes`], with or without the comparison with its checksum.
    ///
    /// The comparison reads all bytes once more (docs/lab/files.md has its time).
    /// Everything else is checked in either case, and no bytes make this panic.
    ///
    /// # Errors
    /// The errors of [`Model::from_bytes`].
    pub fn from_bytes_with(bytes: &[u8], integrity: Integrity) -> Result<Self, ModelFileError> {
        let metadata = read_metadata(bytes, integrity)?;
        let file = Source::open(bytes)?;
        let character = file.character(metadata.joint_names)?;
        // Sizes are checked before anything of these sizes is read.
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
                weights: file.weights("garment.skinning")?,
                carriers: file.carriers()?,
                mask: file.mask()?,
            },
            prior: file.prior()?,
            rest_box: file.rest_box()?,
            strain_limits: file.strain_limits()?,
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
        let precision = model.fastest_precision(Self::ALLOWED_PRECISION_ERROR);
        Ok(model.with_precision(precision))
    }
}

/// Reads the metadata, after the checksum.
fn read_metadata(bytes: &[u8], integrity: Integrity) -> Result<Metadata, ModelFileError> {
    let any = metadata(bytes)?;
    if integrity == Integrity::Check {
        checksum::check(bytes, &any)?;
    }
    // Checked before the configuration is read, whose error would not tell what to do.
    if any.pointer("/config/state").and_then(Value::as_str) == Some("position") {
        return Err(ModelFileError::UnsupportedState);
    }
    Ok(serde_json::from_value(any)?)
}

/// Returns the metadata of a file of this build's version as JSON.
///
/// The version is checked before other keys, because other versions may have other keys.
fn metadata(bytes: &[u8]) -> Result<Value, ModelFileError> {
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let text = (header.metadata().as_ref())
        .and_then(|m| m.get(METADATA_KEY))
        .ok_or(ModelFileError::NotUnic)?;
    let any: Value = serde_json::from_str(text)?;
    // A version that is not a number counts as 0, which no build writes.
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
