//! The model file: one safetensors file, opened in Python by the `safetensors` package.
//!
//! Tensors are named `encoder.N.weight`, `field.N.bias`, `garment.vertices`, ...; the metadata key
//! `unic` holds a JSON object with the format version, the configuration and the provenance.

use crate::{
    character::{Character, Garment},
    config::ModelConfig,
    features::RestBox,
    mesh::{MeshError, TriMesh, Uvs},
    model::{About, Model, ModelError, ModelParts},
    motion::Normalisation,
    network::Linear,
    prior::LinearPrior,
    skeleton::{Skeleton, SkeletonError, SkeletonParts},
    skinning::{SkinningWeights, WeightsError},
};
use glam::{Vec2, Vec3};
use safetensors::{Dtype, SafeTensorError, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use thiserror::Error;

/// Version that this build writes, and the only one it reads.
pub const FORMAT_VERSION: u32 = 1;
const METADATA_KEY: &str = "unic";

/// Why bytes are no model.
#[derive(Debug, Error)]
pub enum ModelFileError {
    /// Not safetensors, or damaged.
    #[error("expected a unic model (safetensors), found bytes that are none: {0}")]
    Container(#[from] SafeTensorError),
    /// Safetensors of something else.
    #[error("expected a unic model, found a safetensors file without `unic` metadata")]
    NotUnic,
    /// Metadata that cannot be read.
    #[error("expected the metadata of a unic model, found JSON that is not: {0}")]
    Metadata(#[from] serde_json::Error),
    /// Written by another version.
    #[error("expected model format version {expected}, found {found}; convert it with the unic that wrote it")]
    Version {
        /// The version that this build reads.
        expected: u32,
        /// The version of the file.
        found: u32,
    },
    /// A tensor of another type or shape.
    #[error("tensor `{name}`: expected {expected}, found {found}")]
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
struct Metadata {
    version: u32,
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
            joint_names: parts.character.skeleton.names().to_vec(),
            config: parts.config.clone(),
            about: parts.about.clone(),
        };
        let mut tensors = Tensors::default();
        tensors.layers("encoder", &parts.encoder);
        tensors.layers("field", &parts.field);
        tensors.floats("motion.mean", &parts.normalisation.mean);
        tensors.floats("motion.std", &parts.normalisation.std);
        if let Some(limit) = parts.normalisation.limit {
            tensors.floats("motion.limit", &[limit]);
        }
        tensors.character(&parts.character);
        tensors.garment(&parts);
        let views: Result<Vec<_>, _> = (tensors.0.iter())
            .map(|t| Ok((t.name.as_str(), TensorView::new(t.dtype, t.shape.clone(), &t.bytes)?)))
            .collect();
        let metadata = HashMap::from([(METADATA_KEY.to_owned(), serde_json::to_string(&metadata)?)]);
        Ok(safetensors::serialize(views.map_err(ModelFileError::Container)?, Some(metadata))?)
    }

    /// Reads a model from the bytes of its file.
    ///
    /// # Errors
    /// Says what was expected and what was found; the caller knows the file's name.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        let metadata = read_metadata(bytes)?;
        let file = Source(SafeTensors::deserialize(bytes)?);
        let rest_box = file.floats("garment.rest_box", &[4])?;
        let parts = ModelParts {
            encoder: file.layers("encoder", metadata.config.encoder.hidden.len() + 1)?,
            field: file.layers("field", metadata.config.field.hidden_layers + 1)?,
            normalisation: Normalisation {
                mean: file.vector("motion.mean")?,
                std: file.vector("motion.std")?,
                limit: match file.0.tensor("motion.limit") {
                    Ok(_) => Some(file.floats("motion.limit", &[1])?[0]),
                    Err(_) => None,
                },
            },
            character: file.character(metadata.joint_names)?,
            garment: Garment {
                rest: file.garment_mesh()?,
                weights: file.weights("garment")?,
            },
            prior: file.prior()?,
            rest_box: RestBox {
                centre: Vec3::from_slice(&rest_box),
                half_extent: rest_box[3],
            },
            config: metadata.config,
            about: metadata.about,
        };
        Ok(Self::new(parts)?)
    }
}

fn read_metadata(bytes: &[u8]) -> Result<Metadata, ModelFileError> {
    let (_, header) = SafeTensors::read_metadata(bytes)?;
    let text = (header.metadata().as_ref())
        .and_then(|m| m.get(METADATA_KEY))
        .ok_or(ModelFileError::NotUnic)?;
    // The version is read on its own first: other versions may have other keys.
    let any: serde_json::Value = serde_json::from_str(text)?;
    let found = any["version"].as_u64().and_then(|v| u32::try_from(v).ok()).unwrap_or(0);
    if found != FORMAT_VERSION {
        return Err(ModelFileError::Version { expected: FORMAT_VERSION, found });
    }
    Ok(serde_json::from_value(any)?)
}

struct Stored {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Tensors on their way into a file.
#[derive(Default)]
struct Tensors(Vec<Stored>);

impl Tensors {
    fn push<T: bytemuck::NoUninit>(&mut self, name: &str, dtype: Dtype, shape: &[usize], data: &[T]) {
        self.0.push(Stored {
            name: name.to_owned(),
            dtype,
            shape: shape.to_vec(),
            bytes: bytemuck::cast_slice(data).to_vec(),
        });
    }

    fn floats(&mut self, name: &str, data: &[f32]) {
        self.push(name, Dtype::F32, &[data.len()], data);
    }

    fn points(&mut self, name: &str, points: &[Vec3]) {
        self.push(name, Dtype::F32, &[points.len(), 3], points);
    }

    fn faces(&mut self, name: &str, faces: &[[u32; 3]]) {
        self.push(name, Dtype::U32, &[faces.len(), 3], faces);
    }

    fn layers(&mut self, network: &str, layers: &[Linear]) {
        for (i, layer) in layers.iter().enumerate() {
            let shape = [layer.outputs, layer.inputs];
            self.push(&format!("{network}.{i}.weight"), Dtype::F32, &shape, &layer.weight);
            self.floats(&format!("{network}.{i}.bias"), &layer.bias);
        }
    }

    fn weights(&mut self, owner: &str, weights: &SkinningWeights) {
        let rows = || (0..weights.len()).flat_map(|v| weights.row(v));
        let counts: Vec<u32> = (0..weights.len()).map(|v| weights.row(v).len() as u32).collect();
        let joints: Vec<u16> = rows().map(|(j, _)| j as u16).collect();
        let values: Vec<f32> = rows().map(|(_, w)| w).collect();
        self.push(&format!("{owner}.skinning.counts"), Dtype::U32, &[counts.len()], &counts);
        self.push(&format!("{owner}.skinning.joints"), Dtype::U16, &[joints.len()], &joints);
        self.floats(&format!("{owner}.skinning.weights"), &values);
    }

    fn character(&mut self, character: &Character) {
        let parts = character.skeleton.to_parts();
        self.points("character.vertices", &character.body.vertices);
        self.faces("character.faces", &character.body.faces);
        self.points("character.joints", &parts.joints);
        self.points("character.rest_pose", &parts.rest_pose);
        self.push("character.parents", Dtype::I64, &[parts.parents.len()], &parts.parents);
        self.weights("character", &character.weights);
    }

    fn prior(&mut self, prior: &LinearPrior) {
        self.points("prior.mean", &prior.mean);
        if !prior.is_empty() {
            let shape = [prior.mean.len(), prior.len(), 3];
            self.push("prior.shapes", Dtype::F32, &shape, &prior.shapes);
            self.layers("prior", std::slice::from_ref(&prior.map));
        }
    }

    fn garment(&mut self, parts: &ModelParts) {
        let mesh = &parts.garment.rest;
        self.points("garment.vertices", &mesh.vertices);
        self.faces("garment.faces", &mesh.faces);
        if let Some(uvs) = &mesh.uvs {
            let shape = [uvs.coordinates.len(), 2];
            self.push("garment.uv.coordinates", Dtype::F32, &shape, &uvs.coordinates);
            self.faces("garment.uv.faces", &uvs.faces);
        }
        self.prior(&parts.prior);
        let b = parts.rest_box;
        self.floats("garment.rest_box", &[b.centre.x, b.centre.y, b.centre.z, b.half_extent]);
        self.weights("garment", &parts.garment.weights);
    }
}

/// Tensors of an open file.
struct Source<'a>(SafeTensors<'a>);

impl Source<'_> {
    /// `shape` has 0 where any length will do.
    fn read<T: bytemuck::AnyBitPattern>(
        &self,
        name: &str,
        dtype: Dtype,
        shape: &[usize],
    ) -> Result<(Vec<T>, Vec<usize>), ModelFileError> {
        let mismatch = |found: String| ModelFileError::Tensor {
            name: name.to_owned(),
            expected: format!("{dtype:?} {shape:?} (0: any)"),
            found,
        };
        let view = self.0.tensor(name).map_err(|_| mismatch("nothing".into()))?;
        let fits = view.shape().len() == shape.len()
            && (view.shape().iter().zip(shape)).all(|(found, want)| *want == 0 || found == want);
        if view.dtype() != dtype || !fits {
            return Err(mismatch(format!("{:?} {:?}", view.dtype(), view.shape())));
        }
        let size = size_of::<T>();
        let data = view.data().chunks_exact(size).map(bytemuck::pod_read_unaligned);
        Ok((data.collect(), view.shape().to_vec()))
    }

    fn floats(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, ModelFileError> {
        Ok(self.read(name, Dtype::F32, shape)?.0)
    }

    fn vector(&self, name: &str) -> Result<Vec<f32>, ModelFileError> {
        self.floats(name, &[0])
    }

    fn points(&self, name: &str) -> Result<Vec<Vec3>, ModelFileError> {
        let floats = self.floats(name, &[0, 3])?;
        Ok(floats.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    fn faces(&self, name: &str) -> Result<Vec<[u32; 3]>, ModelFileError> {
        let (indices, _) = self.read::<u32>(name, Dtype::U32, &[0, 3])?;
        Ok(indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect())
    }

    fn layers(&self, network: &str, count: usize) -> Result<Vec<Linear>, ModelFileError> {
        let layer = |i: usize| {
            let (weight, shape) = self.read(&format!("{network}.{i}.weight"), Dtype::F32, &[0, 0])?;
            Ok(Linear {
                inputs: shape[1],
                outputs: shape[0],
                weight,
                bias: self.floats(&format!("{network}.{i}.bias"), &[shape[0]])?,
            })
        };
        (0..count).map(layer).collect()
    }

    fn prior(&self) -> Result<LinearPrior, ModelFileError> {
        let mean = self.points("prior.mean")?;
        if self.0.tensor("prior.shapes").is_err() {
            return Ok(LinearPrior::constant(mean, 2 * self.vector("motion.mean")?.len()));
        }
        let shapes = self.floats("prior.shapes", &[mean.len(), 0, 3])?;
        Ok(LinearPrior {
            shapes: shapes.chunks_exact(3).map(Vec3::from_slice).collect(),
            map: self.layers("prior", 1)?.swap_remove(0),
            mean,
        })
    }

    fn weights(&self, owner: &str) -> Result<SkinningWeights, ModelFileError> {
        let (counts, _) = self.read::<u32>(&format!("{owner}.skinning.counts"), Dtype::U32, &[0])?;
        let (joints, shape) = self.read::<u16>(&format!("{owner}.skinning.joints"), Dtype::U16, &[0])?;
        let values = self.floats(&format!("{owner}.skinning.weights"), &shape)?;
        let joint_count = self.points("character.joints")?.len();
        let mut entries = joints.iter().map(|j| usize::from(*j)).zip(values);
        let total: u64 = counts.iter().map(|c| u64::from(*c)).sum();
        if total != joints.len() as u64 {
            return Err(ModelFileError::Tensor {
                name: format!("{owner}.skinning.counts"),
                expected: format!("a sum of {} entries", joints.len()),
                found: total.to_string(),
            });
        }
        let rows: Vec<Vec<(usize, f32)>> = (counts.iter())
            .map(|&count| entries.by_ref().take(count as usize).collect())
            .collect();
        Ok(SkinningWeights::from_rows(joint_count, rows.into_iter().map(Vec::into_iter))?)
    }

    fn character(&self, names: Vec<String>) -> Result<Character, ModelFileError> {
        Ok(Character {
            body: TriMesh::new(self.points("character.vertices")?, self.faces("character.faces")?)?,
            skeleton: Skeleton::new(SkeletonParts {
                names,
                parents: self.read("character.parents", Dtype::I64, &[0])?.0,
                joints: self.points("character.joints")?,
                rest_pose: self.points("character.rest_pose")?,
            })?,
            weights: self.weights("character")?,
        })
    }

    fn garment_mesh(&self) -> Result<TriMesh, ModelFileError> {
        let mut mesh = TriMesh::new(self.points("garment.vertices")?, self.faces("garment.faces")?)?;
        if self.0.tensor("garment.uv.coordinates").is_ok() {
            let coordinates = self.floats("garment.uv.coordinates", &[0, 2])?;
            mesh.uvs = Some(Uvs {
                coordinates: coordinates.chunks_exact(2).map(Vec2::from_slice).collect(),
                faces: self.faces("garment.uv.faces")?,
            });
        }
        mesh.check()?;
        Ok(mesh)
    }
}
