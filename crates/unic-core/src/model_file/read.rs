//! Tensors of an open file, checked one by one.

use super::ModelFileError;
use crate::{
    character::Character,
    features::RestBox,
    mesh::{TriMesh, Uvs},
    motion::Normalisation,
    network::Linear,
    prior::Prior,
    recurrence::Recurrence,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use glam::{Vec2, Vec3};
use safetensors::{Dtype, SafeTensors};
use std::{cell::RefCell, collections::HashSet};

/// Joints that skinning weights can name.
const MOST_JOINTS: usize = 1 << 16;

/// An open file, and which of its tensors have been read.
pub(super) struct Source<'a> {
    tensors: SafeTensors<'a>,
    read: RefCell<HashSet<String>>,
}

impl<'a> Source<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ModelFileError> {
        Ok(Self {
            tensors: SafeTensors::deserialize(bytes)?,
            read: RefCell::default(),
        })
    }

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
        let view = self
            .tensors
            .tensor(name)
            .map_err(|_| mismatch("nothing".into()))?;
        let fits = view.shape().len() == shape.len()
            && (view.shape().iter().zip(shape)).all(|(found, want)| *want == 0 || found == want);
        if view.dtype() != dtype || !fits {
            return Err(mismatch(format!("{:?} {:?}", view.dtype(), view.shape())));
        }
        self.read.borrow_mut().insert(name.to_owned());
        let size = size_of::<T>();
        let data = view.data().chunks_exact(size).map(bytemuck::pod_read_unaligned);
        Ok((data.collect(), view.shape().to_vec()))
    }

    fn has(&self, name: &str) -> bool {
        self.tensors.tensor(name).is_ok()
    }

    /// A misspelt name must not turn an optional tensor into none.
    pub(super) fn check_all_read(&self) -> Result<(), ModelFileError> {
        let read = self.read.borrow();
        let unknown = self
            .tensors
            .names()
            .into_iter()
            .filter(|name| !read.contains(*name))
            .min();
        match unknown {
            None => Ok(()),
            Some(name) => Err(unusable(name, "no tensor of this name", "one")),
        }
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

    pub(super) fn layers(&self, network: &str, count: usize) -> Result<Vec<Linear>, ModelFileError> {
        (0..count)
            .map(|i| self.layer(&format!("{network}.{i}")))
            .collect()
    }

    fn layer(&self, name: &str) -> Result<Linear, ModelFileError> {
        let (weight, shape) = self.read(&format!("{name}.weight"), Dtype::F32, &[0, 0])?;
        Ok(Linear {
            inputs: shape[1],
            outputs: shape[0],
            weight,
            bias: self.floats(&format!("{name}.bias"), &[shape[0]])?,
        })
    }

    pub(super) fn prior(&self) -> Result<Prior, ModelFileError> {
        let mean = self.points("prior.mean")?;
        if !self.has("prior.shapes") {
            return Ok(Prior::constant(mean, 2 * self.vector("motion.mean")?.len()));
        }
        let shapes = self.floats("prior.shapes", &[mean.len(), 0, 3])?;
        Ok(Prior {
            shapes: shapes.chunks_exact(3).map(Vec3::from_slice).collect(),
            map: self.layer("prior.0")?,
            recurrence: self.recurrence()?,
            mean,
        })
    }

    fn recurrence(&self) -> Result<Option<Recurrence>, ModelFileError> {
        if !self.has("recurrence.poles") {
            return Ok(None);
        }
        let poles = self.floats("recurrence.poles", &[0, 2])?;
        let layer = |name: &str| self.layer(&format!("recurrence.{name}"));
        Ok(Some(Recurrence {
            poles: poles.as_chunks::<2>().0.to_vec(),
            embedding: layer("embedding")?,
            drive: layer("drive")?,
            memory: layer("memory")?,
            hidden: layer("hidden")?,
            head: layer("head")?,
        }))
    }

    pub(super) fn weights(&self, owner: &str) -> Result<SkinningWeights, ModelFileError> {
        let (counts, _) = self.read::<u32>(&format!("{owner}.skinning.counts"), Dtype::U32, &[0])?;
        let (joints, shape) = self.read::<u16>(&format!("{owner}.skinning.joints"), Dtype::U16, &[0])?;
        let values = self.floats(&format!("{owner}.skinning.weights"), &shape)?;
        let joint_count = self.points("character.joints")?.len();
        let mut entries = joints.iter().map(|j| usize::from(*j)).zip(values);
        let total: u64 = counts.iter().map(|c| u64::from(*c)).sum();
        if total != joints.len() as u64 {
            let expected = format!("a sum of {} entries", joints.len());
            return Err(unusable(&format!("{owner}.skinning.counts"), &expected, total));
        }
        let rows: Vec<Vec<(usize, f32)>> = (counts.iter())
            .map(|&count| entries.by_ref().take(count as usize).collect())
            .collect();
        Ok(SkinningWeights::from_rows(
            joint_count,
            rows.into_iter().map(Vec::into_iter),
        )?)
    }

    pub(super) fn normalisation(&self) -> Result<Normalisation, ModelFileError> {
        let limit = self
            .has("motion.limit")
            .then(|| self.floats("motion.limit", &[1]))
            .transpose()?;
        Ok(Normalisation {
            mean: self.vector("motion.mean")?,
            std: self.vector("motion.std")?,
            limit: limit.map(|l| l[0]),
        })
    }

    pub(super) fn mask(&self) -> Result<Option<Vec<f32>>, ModelFileError> {
        let name = "garment.mask";
        self.has(name).then(|| self.vector(name)).transpose()
    }

    pub(super) fn samples(&self) -> Result<Option<Vec<u32>>, ModelFileError> {
        let name = "garment.samples";
        let samples = self.has(name).then(|| self.read(name, Dtype::U32, &[0]));
        Ok(samples.transpose()?.map(|(samples, _)| samples))
    }

    pub(super) fn rest_box(&self) -> Result<RestBox, ModelFileError> {
        let numbers = self.floats("garment.rest_box", &[4])?;
        Ok(RestBox {
            centre: Vec3::from_slice(&numbers),
            half_extent: numbers[3],
        })
    }

    pub(super) fn character(&self, names: Vec<String>) -> Result<Character, ModelFileError> {
        let joints = self.points("character.joints")?;
        if joints.len() > MOST_JOINTS {
            return Err(unusable("character.joints", "at most 65536 joints", joints.len()));
        }
        Ok(Character {
            body: TriMesh::new(self.points("character.vertices")?, self.faces("character.faces")?)?,
            skeleton: Skeleton::new(SkeletonParts {
                names,
                parents: self.read("character.parents", Dtype::I64, &[0])?.0,
                joints,
                rest_pose: self.points("character.rest_pose")?,
            })?,
            weights: self.weights("character")?,
        })
    }

    pub(super) fn garment_mesh(&self) -> Result<TriMesh, ModelFileError> {
        let mut mesh = TriMesh::new(self.points("garment.vertices")?, self.faces("garment.faces")?)?;
        if self.has("garment.uv.coordinates") {
            mesh.uvs = Some(self.uvs(mesh.faces.len())?);
        }
        Ok(mesh)
    }
    fn uvs(&self, faces: usize) -> Result<Uvs, ModelFileError> {
        let coordinates = self.floats("garment.uv.coordinates", &[0, 2])?;
        let uvs = Uvs {
            coordinates: coordinates.chunks_exact(2).map(Vec2::from_slice).collect(),
            faces: self.faces("garment.uv.faces")?,
        };
        if uvs.faces.len() != faces {
            return Err(unusable(
                "garment.uv.faces",
                &format!("{faces} faces"),
                uvs.faces.len(),
            ));
        }
        let count = uvs.coordinates.len();
        match uvs.faces.iter().flatten().find(|&&i| i as usize >= count) {
            None => Ok(uvs),
            Some(index) => Err(unusable(
                "garment.uv.faces",
                &format!("indices below {count}"),
                index,
            )),
        }
    }
}

fn unusable(name: &str, expected: &str, found: impl ToString) -> ModelFileError {
    ModelFileError::Tensor {
        name: name.to_owned(),
        expected: expected.to_owned(),
        found: found.to_string(),
    }
}
