//! The garment of a capture: `garment.obj` and `garment.npz`.

use super::layout;
use crate::{
    character::read_weights,
    error::{Error, Result},
    npy::Dim,
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

/// What may be known of a garment's vertices besides their positions; each list has one entry a
/// vertex.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VertexAttributes {
    /// Vertices that the simulator held fast.
    pub pinned: Option<Vec<bool>>,
    /// Panel, material or layer.
    pub groups: Option<Vec<u32>>,
}

/// Where a garment's skinning weights come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightsSource {
    /// `garment.npz`.
    File,
    /// The nearest body vertex's, diffused over the garment.
    Diffused,
}

pub(super) struct GarmentFiles {
    pub(super) garment: Garment,
    pub(super) weights_source: WeightsSource,
    pub(super) attributes: VertexAttributes,
}

/// Reads `garment.obj` and, where there is one, `garment.npz` of a folder, as a capture has them.
///
/// # Errors
/// Missing or damaged files, arrays of another number of vertices or joints.
pub fn read_garment(folder: &Path, character: &Character) -> Result<(Garment, VertexAttributes)> {
    let files = read(folder, character)?;
    Ok((files.garment, files.attributes))
}

pub(super) fn read(root: &Path, character: &Character) -> Result<GarmentFiles> {
    let rest = obj::read_obj(&layout::garment_mesh(root))?;
    let path = layout::garment_arrays(root);
    let arrays = match path.exists() {
        true => read_arrays(&path, &rest, character)?,
        false => Arrays::default(),
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
            mask: arrays.mask,
        },
        weights_source,
        attributes: arrays.attributes,
    })
}

/// Weights for a garment that brings none: smooth in space, so that a skirt does not tear between
/// the legs.
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

/// What a `garment.npz` holds.
#[derive(Default)]
struct Arrays {
    weights: Option<SkinningWeights>,
    mask: Option<Vec<f32>>,
    attributes: VertexAttributes,
}

fn read_arrays(path: &Path, rest: &TriMesh, character: &Character) -> Result<Arrays> {
    let mut npz = Npz::open(path)?;
    let known = ["weights", "pinned", "groups", "mask"];
    if let Some(other) = npz.names().iter().find(|n| !known.contains(&n.as_str())) {
        let expected = format!("only the arrays {}", known.join(", "));
        return Err(Error::content(path, expected, format!("`{other}`")));
    }
    let vertices = Dim::Is(rest.vertices.len());
    let weights = match npz.contains("weights") {
        true => {
            let given = read_weights(&mut npz, [vertices, Dim::Is(character.skeleton.len())])?;
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
    Ok(Arrays {
        weights,
        mask: read_mask(path, &mut npz, rest)?,
        attributes,
    })
}

/// A mask of ones is none, so that it changes no model.
fn read_mask(path: &Path, npz: &mut Npz, rest: &TriMesh) -> Result<Option<Vec<f32>>> {
    let mask = optional::<f32>(npz, "mask", Dim::Is(rest.vertices.len()))?;
    let outside = |m: &&f32| !(0.0..=1.0).contains(*m);
    if let Some(found) = mask.iter().flatten().find(outside) {
        let found = found.to_string();
        return Err(Error::content(path, "numbers from 0 to 1 in `mask`", found));
    }
    let sewn = mask.map(|mask| sewn_numbers(&mask, &rest.vertices));
    Ok(sewn.filter(|mask| mask.iter().any(|m| *m != 1.0)))
}

fn optional<T: crate::npy::Element>(npz: &mut Npz, name: &str, count: Dim) -> Result<Option<Vec<T>>> {
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
