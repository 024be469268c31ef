//! Writing of tensors.

use crate::{
    character::Character,
    model::ModelParts,
    motion::Normalisation,
    network::Linear,
    prior::Prior,
    projection::StrainLimit,
    replay::{KEY, Replay},
    sampling::Sampling,
    skinning::SkinningWeights,
};
use glam::Vec3;
use safetensors::{Dtype, SafeTensorError, tensor::TensorView};
use std::collections::HashMap;

/// Returns the bytes of a model's file with the given metadata.
pub(super) fn serialised(
    parts: &ModelParts,
    sampling: Option<&Sampling>,
    metadata: HashMap<String, String>,
) -> Result<Vec<u8>, SafeTensorError> {
    let mut tensors = Tensors::default();
    tensors.layers("encoder", &parts.encoder);
    tensors.layers("field", &parts.field);
    tensors.normalisation(&parts.normalisation);
    tensors.character(&parts.character);
    tensors.garment(parts);
    tensors.strain_limits(&parts.strain_limits);
    if let Some(sampling) = sampling {
        let samples = sampling.samples();
        tensors.push("garment.samples", Dtype::U32, &[samples.len()], samples);
    }
    let views: Result<Vec<_>, SafeTensorError> = (tensors.0.iter())
        .map(|t| {
            Ok((
                t.name.as_str(),
                TensorView::new(t.dtype, t.shape.clone(), &t.bytes)?,
            ))
        })
        .collect();
    safetensors::serialize(views?, Some(metadata))
}

/// A tensor in the file's format.
struct StoredTensor {
    name: String,
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

/// Tensors of a file in the order of writing.
#[derive(Default)]
struct Tensors(Vec<StoredTensor>);

impl Tensors {
    fn push<T: bytemuck::NoUninit>(&mut self, name: &str, dtype: Dtype, shape: &[usize], data: &[T]) {
        self.0.push(StoredTensor {
            name: name.to_owned(),
            dtype,
            shape: shape.to_vec(),
            // Safetensors is little-endian, as are all targets of this crate.
            bytes: bytemuck::cast_slice(data).to_vec(),
        });
    }

    fn floats(&mut self, name: &str, data: &[f32]) {
        self.push(name, Dtype::F32, &[data.len()], data);
    }

    fn strain_limits(&mut self, limits: &[StrainLimit]) {
        // Models without a projection keep the bytes of files that were written before it.
        if !limits.is_empty() {
            let numbers: Vec<f32> = limits.iter().flat_map(|l| [l.shortest, l.longest]).collect();
            let shape = [limits.len(), 2];
            self.push("garment.strain_limits", Dtype::F32, &shape, &numbers);
        }
    }

    fn points(&mut self, name: &str, points: &[Vec3]) {
        self.push(name, Dtype::F32, &[points.len(), 3], points);
    }

    fn faces(&mut self, name: &str, faces: &[[u32; 3]]) {
        self.push(name, Dtype::U32, &[faces.len(), 3], faces);
    }

    fn layers(&mut self, network: &str, layers: &[Linear]) {
        for (i, layer) in layers.iter().enumerate() {
            self.layer(&format!("{network}.{i}"), layer);
        }
    }

    fn layer(&mut self, name: &str, layer: &Linear) {
        let shape = [layer.outputs, layer.inputs];
        self.push(&format!("{name}.weight"), Dtype::F32, &shape, &layer.weight);
        self.floats(&format!("{name}.bias"), &layer.bias);
    }

    fn weights(&mut self, owner: &str, weights: &SkinningWeights) {
        let rows = || (0..weights.len()).flat_map(|v| weights.row(v));
        let counts: Vec<u32> = (0..weights.len()).map(|v| weights.row(v).len() as u32).collect();
        let joints: Vec<u16> = rows().map(|(j, _)| j as u16).collect();
        let values: Vec<f32> = rows().map(|(_, w)| w).collect();
        self.push(&format!("{owner}.counts"), Dtype::U32, &[counts.len()], &counts);
        self.push(&format!("{owner}.joints"), Dtype::U16, &[joints.len()], &joints);
        self.floats(&format!("{owner}.weights"), &values);
    }

    fn normalisation(&mut self, normalisation: &Normalisation) {
        self.floats("motion.mean", &normalisation.mean);
        self.floats("motion.std", &normalisation.std);
        if let Some(limit) = normalisation.limit {
            self.floats("motion.limit", &[limit]);
        }
    }

    fn character(&mut self, character: &Character) {
        let parts = character.skeleton.to_parts();
        self.points("character.vertices", &character.body.vertices);
        self.faces("character.faces", &character.body.faces);
        self.points("character.joints", &parts.joints);
        self.points("character.rest_pose", &parts.rest_pose);
        self.push(
            "character.parents",
            Dtype::I64,
            &[parts.parents.len()],
            &parts.parents,
        );
        self.weights("character.skinning", &character.weights);
        if let Some(mesh) = &character.file_mesh {
            let vertices = &mesh.body_vertices;
            self.push("character.file.vertices", Dtype::U32, &[vertices.len()], vertices);
            self.faces("character.file.faces", &mesh.faces);
        }
    }

    fn prior(&mut self, prior: &Prior) {
        self.points("prior.mean", &prior.mean);
        if !prior.is_empty() {
            let (shape, components) = ([prior.mean.len(), 3, prior.len()], &prior.components);
            self.push("prior.shapes", Dtype::I16, &shape, components.coordinates());
            self.floats("prior.steps", components.step_m());
            self.layers("prior", std::slice::from_ref(&prior.map));
        }
        if let Some(recurrence) = &prior.recurrence {
            self.push(
                "recurrence.poles",
                Dtype::F32,
                &[recurrence.poles.len(), 2],
                &recurrence.poles,
            );
            for (name, layer) in recurrence.layers() {
                self.layer(&format!("recurrence.{name}"), layer);
            }
        }
        if let Some(replay) = &prior.replay {
            self.replay(replay);
        }
    }

    fn replay(&mut self, replay: &Replay) {
        let library = replay.library();
        let (frames, coefficients) = (library.len(), library.coefficients());
        self.layer("replay.features", replay.keys().features());
        self.push(
            "replay.clips",
            Dtype::U32,
            &[library.clips().len()],
            library.clips(),
        );
        self.push("replay.keys", Dtype::I8, &[frames, KEY], library.keys());
        self.push(
            "replay.residuals",
            Dtype::I8,
            &[frames, coefficients],
            library.residuals(),
        );
        self.floats("replay.scales", library.scales());
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
        self.floats(
            "garment.rest_box",
            &[b.centre.x, b.centre.y, b.centre.z, b.half_extent],
        );
        self.weights("garment.skinning", &parts.garment.weights);
        if let Some(carriers) = &parts.garment.carriers {
            self.weights("garment.carriers", carriers);
        }
        if let Some(mask) = &parts.garment.mask {
            self.floats("garment.mask", mask);
        }
    }
}
