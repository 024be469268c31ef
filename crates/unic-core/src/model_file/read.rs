//! Reading of tensors, each checked for type, shape and use.

use super::ModelFileError;
use crate::{
    character::{Character, FileMesh},
    features::RestBox,
    mesh::{TriMesh, Uvs},
    model::ModelError,
    motion::Normalisation,
    network::Linear,
    prior::{Components, Prior},
    projection::StrainLimit,
    recurrence::Recurrence,
    replay::{KEY, KeyMap, Library, Replay},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use glam::{Vec2, Vec3};
use safetensors::{Dtype, SafeTensors};
use std::{cell::RefCell, collections::HashSet};

/// Largest number of joints, which skinning weights store as 16 bits.
const MAX_JOINTS: usize = 1 << 16;

/// An open file, and the names of its tensors that have been read.
pub(super) struct Source<'a> {
    tensors: SafeTensors<'a>,
    read: RefCell<HashSet<String>>,
}

/// Numbers of a tensor, row-major, with its shape.
struct Array<T> {
    numbers: Vec<T>,
    shape: Vec<usize>,
}

impl<'a> Source<'a> {
    /// Reads the header.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ModelFileError> {
        Ok(Self {
            tensors: SafeTensors::deserialize(bytes)?,
            read: RefCell::default(),
        })
    }

    /// Reads a tensor of this type and shape; a 0 in `shape` stands for any length.
    fn read<T: bytemuck::AnyBitPattern>(
        &self,
        name: &str,
        dtype: Dtype,
        shape: &[usize],
    ) -> Result<Array<T>, ModelFileError> {
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
        // Tensors are not aligned in a file.
        let size = size_of::<T>();
        let numbers = view.data().chunks_exact(size).map(bytemuck::pod_read_unaligned);
        Ok(Array {
            numbers: numbers.collect(),
            shape: view.shape().to_vec(),
        })
    }

    /// Returns true if the file has a tensor of this name.
    fn has(&self, name: &str) -> bool {
        self.tensors.tensor(name).is_ok()
    }

    /// Checks that the file has no tensor which was not read.
    ///
    /// Without this check, a misspelt optional tensor would be silently ignored.
    pub(super) fn check_all_read(&self) -> Result<(), ModelFileError> {
        let read = self.read.borrow();
        let unknown = self
            .tensors
            .names()
            .into_iter()
            // The first by name, so that the error does not depend on hashing.
            .filter(|name| !read.contains(*name))
            .min();
        match unknown {
            None => Ok(()),
            Some(name) => Err(unusable(name, "no tensor of this name", "one")),
        }
    }

    fn floats(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, ModelFileError> {
        Ok(self.read(name, Dtype::F32, shape)?.numbers)
    }

    /// Reads f32 numbers of any length.
    fn vector(&self, name: &str) -> Result<Vec<f32>, ModelFileError> {
        self.floats(name, &[0])
    }

    /// Reads an N × 3 tensor as vectors.
    fn points(&self, name: &str) -> Result<Vec<Vec3>, ModelFileError> {
        let floats = self.floats(name, &[0, 3])?;
        Ok(floats.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// Reads an N × 3 tensor as faces.
    fn faces(&self, name: &str) -> Result<Vec<[u32; 3]>, ModelFileError> {
        let indices = self.read::<u32>(name, Dtype::U32, &[0, 3])?.numbers;
        Ok(indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect())
    }

    /// Reads the layers `network.0`, `network.1`, ...
    pub(super) fn layers(&self, network: &str, count: usize) -> Result<Vec<Linear>, ModelFileError> {
        (0..count)
            .map(|i| self.layer(&format!("{network}.{i}")))
            .collect()
    }

    fn layer(&self, name: &str) -> Result<Linear, ModelFileError> {
        let weight = self.read(&format!("{name}.weight"), Dtype::F32, &[0, 0])?;
        let (outputs, inputs) = (weight.shape[0], weight.shape[1]);
        Ok(Linear {
            inputs,
            outputs,
            weight: weight.numbers,
            bias: self.floats(&format!("{name}.bias"), &[outputs])?,
        })
    }

    /// Reads the prior; a file without components has the mean displacement alone.
    pub(super) fn prior(&self) -> Result<Prior, ModelFileError> {
        let mean = self.points("prior.mean")?;
        // A size of 0 stands for any, and tensors without numbers may have any other size.
        if mean.is_empty() {
            return Err(unusable("prior.mean", "a vertex or more", "none"));
        }
        if !self.has("prior.shapes") {
            // The map has no outputs, but its inputs must fit a pair of motion vectors.
            return Ok(Prior::constant(mean, 2 * self.vector("motion.mean")?.len()));
        }
        Ok(Prior {
            components: self.components(mean.len())?,
            map: self.layer("prior.0")?,
            recurrence: self.recurrence()?,
            replay: self.replay()?,
            mean,
        })
    }

    /// Reads the prior's components. Files of earlier versions have them in 32 bits.
    fn components(&self, vertices: usize) -> Result<Components, ModelFileError> {
        let shapes = self.tensors.tensor("prior.shapes");
        if shapes.is_ok_and(|shapes| shapes.dtype() == Dtype::F32) {
            let shapes = self.read::<f32>("prior.shapes", Dtype::F32, &[vertices, 0, 3])?;
            let vectors: Vec<Vec3> = shapes.numbers.chunks_exact(3).map(Vec3::from_slice).collect();
            return Ok(Components::of_vectors(&vectors, shapes.shape[1]));
        }
        let step_m = self.vector("prior.steps")?;
        let coordinates = self.read("prior.shapes", Dtype::I16, &[vertices, 3, step_m.len()])?;
        Ok(Components::of_coordinates(coordinates.numbers, step_m))
    }

    /// Reads the prior's recurrence, if the file has one.
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

    /// Reads the prior's replay, if the file has one.
    fn replay(&self) -> Result<Option<Replay>, ModelFileError> {
        if !self.has("replay.residuals") {
            return Ok(None);
        }
        let scales = self.vector("replay.scales")?;
        let keys = self.read::<i8>("replay.keys", Dtype::I8, &[0, KEY])?.numbers;
        let residuals = self.read("replay.residuals", Dtype::I8, &[0, scales.len()])?;
        let clips = self.read("replay.clips", Dtype::U32, &[0])?.numbers;
        let keys = keys.as_chunks::<KEY>().0.to_vec();
        let library = Library::new(clips, keys, residuals.numbers, scales).map_err(ModelError::from)?;
        let features = self.layer("replay.features")?;
        let keys = KeyMap::new(features).map_err(ModelError::from)?;
        Ok(Some(Replay::new(keys, library)))
    }

    /// Reads the weights of `garment.skinning`, `garment.carriers` or `character.skinning`.
    ///
    /// `counts` holds the number of entries of each vertex; `joints` and `weights` hold the entries
    /// of all vertices.
    pub(super) fn weights(&self, owner: &str) -> Result<SkinningWeights, ModelFileError> {
        let counts = self.read::<u32>(&format!("{owner}.counts"), Dtype::U32, &[0])?;
        let joints = self.read::<u16>(&format!("{owner}.joints"), Dtype::U16, &[0])?;
        let values = self.floats(&format!("{owner}.weights"), &joints.shape)?;
        let (counts, joints) = (counts.numbers, joints.numbers);
        let joint_count = self.points("character.joints")?.len();
        let mut entries = joints.iter().map(|j| usize::from(*j)).zip(values);
        // In u64: counts of a damaged file may overflow 32 bits.
        let total: u64 = counts.iter().map(|c| u64::from(*c)).sum();
        if total != joints.len() as u64 {
            let expected = format!("a sum of {} entries", joints.len());
            return Err(unusable(&format!("{owner}.counts"), &expected, total));
        }
        // Collected, because all rows take from the same iterator.
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

    pub(super) fn carriers(&self) -> Result<Option<SkinningWeights>, ModelFileError> {
        let owner = "garment.carriers";
        let has_carriers = self.has(&format!("{owner}.counts"));
        has_carriers.then(|| self.weights(owner)).transpose()
    }

    pub(super) fn mask(&self) -> Result<Option<Vec<f32>>, ModelFileError> {
        let name = "garment.mask";
        self.has(name).then(|| self.vector(name)).transpose()
    }

    pub(super) fn samples(&self) -> Result<Option<Vec<u32>>, ModelFileError> {
        let name = "garment.samples";
        let samples = self.has(name).then(|| self.read(name, Dtype::U32, &[0]));
        Ok(samples.transpose()?.map(|samples| samples.numbers))
    }

    /// Reads the limits of edge lengths; a file without them has no strain projection.
    pub(super) fn strain_limits(&self) -> Result<Vec<StrainLimit>, ModelFileError> {
        let name = "garment.strain_limits";
        if !self.has(name) {
            return Ok(Vec::new());
        }
        let limits = self.floats(name, &[0, 2])?;
        let limit = |l: &[f32]| StrainLimit {
            shortest: l[0],
            longest: l[1],
        };
        Ok(limits.chunks_exact(2).map(limit).collect())
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
        if joints.len() > MAX_JOINTS {
            return Err(unusable("character.joints", "at most 65536 joints", joints.len()));
        }
        Ok(Character {
            body: TriMesh::new(self.points("character.vertices")?, self.faces("character.faces")?)?,
            skeleton: Skeleton::new(SkeletonParts {
                names,
                parents: self.read("character.parents", Dtype::I64, &[0])?.numbers,
                joints,
                rest_pose: self.points("character.rest_pose")?,
            })?,
            weights: self.weights("character.skinning")?,
            file_mesh: self.file_mesh()?,
        })
    }

    /// Reads the mesh of the body's file, which a body without welded vertices has not.
    fn file_mesh(&self) -> Result<Option<FileMesh>, ModelFileError> {
        let name = "character.file.vertices";
        if !self.has(name) {
            return Ok(None);
        }
        Ok(Some(FileMesh {
            body_vertices: self.read(name, Dtype::U32, &[0])?.numbers,
            faces: self.faces("character.file.faces")?,
        }))
    }

    pub(super) fn garment_mesh(&self) -> Result<TriMesh, ModelFileError> {
        let mut mesh = TriMesh::new(self.points("garment.vertices")?, self.faces("garment.faces")?)?;
        if self.has("garment.uv.coordinates") {
            mesh.uvs = Some(self.uvs(mesh.faces.len())?);
        }
        Ok(mesh)
    }

    /// Reads texture coordinates for a mesh of `faces` faces.
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

/// Returns the error for a tensor whose contents are not usable.
fn unusable(name: &str, expected: &str, found: impl ToString) -> ModelFileError {
    ModelFileError::Tensor {
        name: name.to_owned(),
        expected: expected.to_owned(),
        found: found.to_string(),
    }
}
