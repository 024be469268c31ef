//! `mesh.bin`: the garment's arrays, those that graphs read and those that engines draw.

use crate::port::{Axis, Length, MASK, PRIOR_MEAN, PRIOR_SHAPES, Port, REST, SKINNING_WEIGHTS, Sizes};
use serde::Serialize;
use unic_core::Model;

/// Array in `mesh.bin`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MeshArray {
    name: &'static str,
    #[serde(rename = "type")]
    element: Element,
    /// Lengths of the axes, row-major.
    shape: Vec<usize>,
    /// Bytes before the first number.
    offset: usize,
    unit: &'static str,
    meaning: &'static str,
}

/// Type of an array's numbers, as numpy names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Element {
    Float32,
    Uint32,
}

/// Arrays one behind the other, little-endian.
#[derive(Debug, Default)]
pub(crate) struct MeshFile {
    pub(crate) arrays: Vec<MeshArray>,
    pub(crate) bytes: Vec<u8>,
}

impl MeshFile {
    pub(crate) fn new(model: &Model, sizes: &Sizes) -> Self {
        let mut file = Self::default();
        let (garment, prior) = (model.garment(), model.prior());
        let rest = &garment.rest;
        let vertices = rest.vertices.len();
        let mut port = |port: Port, numbers: &[f32]| {
            let shape = lengths(port, sizes, vertices);
            let words = numbers.iter().map(|x| x.to_bits());
            file.push(
                port.name,
                Element::Float32,
                shape,
                words,
                [port.unit, port.meaning],
            );
        };
        port(REST, bytemuck::cast_slice(&rest.vertices));
        port(SKINNING_WEIGHTS, &garment.weights.to_dense());
        port(PRIOR_MEAN, bytemuck::cast_slice(&prior.mean));
        if !prior.is_empty() {
            let shapes: Vec<f32> = prior.components.in_metres().collect();
            port(PRIOR_SHAPES, &shapes);
        }
        if let Some(mask) = &garment.mask {
            port(MASK, mask);
        }
        let indices = |faces: &[[u32; 3]]| faces.as_flattened().to_vec();
        file.push(
            "faces",
            Element::Uint32,
            vec![rest.faces.len(), 3],
            indices(&rest.faces).into_iter(),
            [
                "",
                "vertices of each triangle, counter-clockwise seen from outside",
            ],
        );
        if let Some(uvs) = &rest.uvs {
            let coordinates = uvs.coordinates.iter().flat_map(|uv| uv.to_array());
            file.push(
                "uvs",
                Element::Float32,
                vec![uvs.coordinates.len(), 2],
                coordinates.map(f32::to_bits),
                ["", "texture coordinates, v upwards"],
            );
            file.push(
                "uv_faces",
                Element::Uint32,
                vec![uvs.faces.len(), 3],
                indices(&uvs.faces).into_iter(),
                ["", "texture coordinate of each corner of each triangle"],
            );
        }
        file
    }

    fn push(
        &mut self,
        name: &'static str,
        element: Element,
        shape: Vec<usize>,
        words: impl Iterator<Item = u32>,
        [unit, meaning]: [&'static str; 2],
    ) {
        self.arrays.push(MeshArray {
            name,
            element,
            shape,
            offset: self.bytes.len(),
            unit,
            meaning,
        });
        self.bytes.extend(words.flat_map(u32::to_le_bytes));
    }
}

/// Shape of the array of a port.
fn lengths(port: Port, sizes: &Sizes, vertices: usize) -> Vec<usize> {
    let length = |&axis: &Axis| match sizes.length(axis) {
        Length::Fixed(length) => length,
        Length::Named(_) => vertices,
    };
    port.shape.iter().map(length).collect()
}
