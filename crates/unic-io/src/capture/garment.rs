//! Reading and writing the garment of a capture: `garment.obj` and `garment.npz`.

use super::layout;
use crate::{
    character::read_weights,
    error::{Error, Result},
    npy::{Dim, Element},
    npz::{Npz, NpzWriter},
    obj,
};
use std::path::Path;
use unic_core::{
    character::{Character, Garment},
    mesh::TriMesh,
    skinning::{SkinningWeights, WeightsError},
    weights::{DIFFUSION_LENGTH_M, diffused_weights, nearest_body_weights, sewn_numbers, sewn_weights},
};

/// Optional attributes of a garment's vertices. Each list has one entry for each vertex.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VertexAttributes {
    /// `true` for vertices that the simulator held fixed.
    pub pinned: Option<Vec<bool>>,
    /// Number of the vertex's panel, material or layer.
    pub groups: Option<Vec<u32>>,
}

/// Origin of a garment's skinning weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightsSource {
    /// The file `garment.npz`.
    File,
    /// The weights of the nearest body vertices, diffused over the garment.
    Diffused,
}

/// Names of the arrays in `garment.npz`. Any other name is an error, because a misspelt attribute
/// would otherwise be ignored.
const ARRAY_NAMES: [&str; 4] = ["weights", "pinned", "groups", "mask"];

pub(super) struct GarmentFiles {
    pub(super) garment: Garment,
    pub(super) weights_source: WeightsSource,
    pub(super) attributes: VertexAttributes,
}

/// Reads `garment.obj` and, if it exists, `garment.npz` of a folder with a capture's layout.
///
/// # Errors
/// Missing or damaged files, arrays of another number of vertices or joints.
pub fn read_garment(folder: &Path, character: &Character) -> Result<(Garment, VertexAttributes)> {
    let files = read(folder, character)?;
    Ok((files.garment, files.attributes))
}

pub(super) fn read(root: &Path, character: &Character) -> Result<GarmentFiles> {
    let rest = obj::read_obj(&layout::garment_mesh(root))?;
    // The file is optional: a mesh alone is a garment.
    let path = layout::garment_arrays(root);
    let arrays = match path.exists() {
        true => read_arrays(&path, &rest, character)?,
        false => GarmentArrays::default(),
    };
    let (weights, weights_source) = match arrays.weights {
        Some(weights) => (weights, WeightsSource::File),
        None => {
            let weights = default_weights(&rest, character).map_err(|source| Error::Weights {
                path: layout::garment_mesh(root),
                source,
            })?;
            (weights, WeightsSource::Diffused)
        }
    };
    Ok(GarmentFiles {
        garment: Garment {
            rest,
            weights,
            carriers: None,
            mask: arrays.mask,
        },
        weights_source,
        attributes: arrays.attributes,
    })
}

/// Computes skinning weights for a garment without any: those of the nearest body vertices,
/// diffused over the garment.
///
/// The diffusion makes weights smooth in space, so that a skirt does not tear between the legs.
///
/// # Errors
/// A body without vertices.
pub fn default_weights(
    rest: &TriMesh,
    character: &Character,
) -> std::result::Result<SkinningWeights, WeightsError> {
    let body = &character.body.vertices;
    let nearest = nearest_body_weights(body, &character.weights, &rest.vertices)?;
    diffused_weights(&nearest, rest, DIFFUSION_LENGTH_M)
}

/// Arrays of a `garment.npz`.
#[derive(Default)]
struct GarmentArrays {
    weights: Option<SkinningWeights>,
    mask: Option<Vec<f32>>,
    attributes: VertexAttributes,
}

fn read_arrays(path: &Path, rest: &TriMesh, character: &Character) -> Result<GarmentArrays> {
    let mut npz = Npz::open(path)?;
    let is_unknown = |name: &&String| !ARRAY_NAMES.contains(&name.as_str());
    if let Some(other) = npz.names().iter().find(is_unknown) {
        let expected = format!("only the arrays {}", ARRAY_NAMES.join(", "));
        return Err(Error::content(path, expected, format!("`{other}`")));
    }
    let vertices = Dim::Is(rest.vertices.len());
    let weights = match npz.contains("weights") {
        true => {
            let given = read_weights(&mut npz, [vertices, Dim::Is(character.skeleton.len())])?;
            // Vertices at one place are one point of the cloth: different weights would open the
            // seam.
            let sewn = sewn_weights(&given, &rest.vertices).map_err(|source| Error::Weights {
                path: path.to_owned(),
                source,
            })?;
            Some(sewn)
        }
        false => None,
    };
    let attributes = VertexAttributes {
        pinned: optional::<bool>(&mut npz, "pinned", vertices)?,
        groups: optional::<u32>(&mut npz, "groups", vertices)?,
    };
    Ok(GarmentArrays {
        weights,
        mask: read_mask(path, &mut npz, rest)?,
        attributes,
    })
}

/// Reads the mask; a mask of ones counts as none, so that it changes no model.
fn read_mask(path: &Path, npz: &mut Npz, rest: &TriMesh) -> Result<Option<Vec<f32>>> {
    let mask = optional::<f32>(npz, "mask", Dim::Is(rest.vertices.len()))?;
    // NaN is in no range and is refused too.
    let outside = |m: &&f32| !(0.0..=1.0).contains(*m);
    if let Some(found) = mask.iter().flatten().find(outside) {
        let found = found.to_string();
        return Err(Error::content(path, "numbers from 0 to 1 in `mask`", found));
    }
    // Vertices at one place share one value, as they share their weights.
    let sewn = mask.map(|mask| sewn_numbers(&mask, &rest.vertices));
    Ok(sewn.filter(|mask| mask.iter().any(|m| *m != 1.0)))
}

/// Reads a one-dimensional array, if the file has it.
fn optional<T: Element>(npz: &mut Npz, name: &str, count: Dim) -> Result<Option<Vec<T>>> {
    if !npz.contains(name) {
        return Ok(None);
    }
    Ok(Some(npz.array::<T>(name, &[count])?.data))
}

pub(super) fn write(root: &Path, garment: &Garment, attributes: &VertexAttributes) -> Result<()> {
    obj::write_obj(&layout::garment_mesh(root), &garment.rest)?;
    let mut npz = NpzWriter::create(&layout::garment_arrays(root))?;
    let weights = &garment.weights;
    npz.f32s(
        "weights",
        &[weights.len(), weights.joint_count()],
        &weights.to_dense(),
    )?;
    if let Some(pinned) = &attributes.pinned {
        npz.bools("pinned", pinned)?;
    }
    if let Some(groups) = &attributes.groups {
        npz.u32s("groups", groups)?;
    }
    if let Some(mask) = &garment.mask {
        npz.f32s("mask", &[mask.len()], mask)?;
    }
    npz.finish()
}
