//! The binary form of a layer, `.usdc`, which Pixar calls a crate file.
//!
//! | part | content |
//! |---|---|
//! | start, 88 bytes | `PXR-USDC`, version, place of the table of contents |
//! | values | arrays, in the order in which they were written |
//! | sections | tokens, strings, fields, sets of fields, paths, specs |
//! | table of contents | name, place and size of each section |
//!
//! Values come first, so that frames are written as they arrive. The sections refer to them by their
//! places. Arrays are stored as they are in memory.

mod compression;
mod sections;
mod sink;
mod specs;
mod value;

use super::{
    extent,
    layer::{CORNERS, DOCUMENTATION, Layer, LayerMesh, ROOT, Sampled, end_time_code},
};
use crate::error::Result;
use glam::Vec3;
use sections::Sections;
use sink::Sink;
use specs::{Spec, SpecKind};
use std::path::Path;
use value::{ArrayType, Value};

/// Writer of the binary form.
#[derive(Debug)]
pub(super) struct CrateWriter {
    sink: Sink,
    layer: Layer,
    /// Values of each mesh that are in the file.
    values: Vec<MeshValues>,
    /// Number of complete frames.
    len: usize,
    scratch: Vec<Vec3>,
}

/// Values of one mesh.
#[derive(Debug)]
struct MeshValues {
    /// Attributes with one value, by name and type.
    constant: Vec<Attribute>,
    /// Time samples of each [`Sampled`].
    samples: [Vec<Value>; Sampled::ALL.len()],
}

/// An attribute with one value for all frames.
#[derive(Debug)]
struct Attribute {
    name: &'static str,
    type_name: &'static str,
    value: AttributeValue,
}

#[derive(Debug)]
enum AttributeValue {
    /// A value in the file.
    Written(Value),
    /// A value in the file, one for each corner of the faces.
    ByCorner(Value),
    /// A token that never varies.
    Uniform(&'static str),
}

impl CrateWriter {
    pub(super) fn create(path: &Path, layer: Layer) -> Result<Self> {
        let mut sink = Sink::create(path)?;
        let values = layer.meshes.iter().map(|mesh| MeshValues::write(&mut sink, mesh));
        Ok(Self {
            values: values.collect::<Result<_>>()?,
            sink,
            layer,
            len: 0,
            scratch: Vec::new(),
        })
    }

    pub(super) fn push(&mut self, frame: &[&[Vec3]]) -> Result<()> {
        let meshes = self.layer.meshes.iter().zip(&mut self.values);
        for ((mesh, values), positions) in meshes.zip(frame) {
            for (property, samples) in Sampled::ALL.into_iter().zip(&mut values.samples) {
                samples.push(match property {
                    Sampled::Extent => self.sink.array(ArrayType::Vec3f, &extent(positions))?,
                    Sampled::Normals => {
                        mesh.normals.compute(positions, &mut self.scratch);
                        self.sink.array(ArrayType::Vec3f, &self.scratch)?
                    }
                    Sampled::Points => self.sink.array(ArrayType::Vec3f, positions)?,
                });
            }
        }
        self.len += 1;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<()> {
        let Self {
            mut sink,
            layer,
            values,
            len,
            ..
        } = self;
        let mut sections = Sections::new();
        let times: Vec<f64> = (0..len).map(|t| t as f64).collect();
        // All properties of all meshes have the same times.
        let times = sink.doubles(&times)?;
        let mut meshes = Vec::new();
        for (mesh, values) in layer.meshes.iter().zip(&values) {
            meshes.push(mesh_spec(&mut sink, &mut sections, mesh, values, times)?);
        }
        let tree = layer_spec(&mut sink, &mut sections, &layer, len, meshes)?;
        sections.write(sink, &tree)
    }
}

impl MeshValues {
    /// Writes the faces and texture coordinates of a mesh.
    fn write(sink: &mut Sink, mesh: &LayerMesh) -> Result<Self> {
        let counts = vec![CORNERS; mesh.faces.len()];
        let written = |name, type_name, value| Attribute {
            name,
            type_name,
            value: AttributeValue::Written(value),
        };
        let mut constant = vec![
            written("faceVertexCounts", "int[]", sink.array(ArrayType::Int, &counts)?),
            written(
                "faceVertexIndices",
                "int[]",
                sink.array(ArrayType::Int, mesh.faces.as_flattened())?,
            ),
            Attribute {
                name: "subdivisionScheme",
                type_name: "token",
                value: AttributeValue::Uniform("none"),
            },
        ];
        if let Some((coordinates, corners)) = &mesh.uvs {
            let indices = sink.array(ArrayType::Int, corners.as_flattened())?;
            constant.push(Attribute {
                name: "primvars:st",
                type_name: "texCoord2f[]",
                value: AttributeValue::ByCorner(sink.array(ArrayType::Vec2f, coordinates)?),
            });
            constant.push(written("primvars:st:indices", "int[]", indices));
        }
        Ok(Self {
            constant,
            samples: Default::default(),
        })
    }
}

/// Makes the spec of a mesh with its attributes.
fn mesh_spec(
    sink: &mut Sink,
    sections: &mut Sections,
    mesh: &LayerMesh,
    values: &MeshValues,
    times: Value,
) -> Result<Spec> {
    let mut properties = Vec::new();
    for attribute in &values.constant {
        let mut fields = vec![("typeName", sections.token(attribute.type_name))];
        match attribute.value {
            AttributeValue::Written(value) => fields.push(("default", value)),
            AttributeValue::ByCorner(value) => {
                fields.push(("default", value));
                fields.push(("interpolation", sections.token("faceVarying")));
            }
            AttributeValue::Uniform(token) => {
                fields.push(("default", sections.token(token)));
                fields.push(("variability", Value::UNIFORM));
            }
        }
        properties.push(sections.spec(attribute.name, SpecKind::Attribute, &fields));
    }
    for (property, samples) in Sampled::ALL.into_iter().zip(&values.samples) {
        let samples = sink.time_samples(times, samples)?;
        let mut fields = vec![("typeName", sections.token(property.type_name()))];
        fields.push(("timeSamples", samples));
        if property == Sampled::Normals {
            fields.push(("interpolation", sections.token("vertex")));
        }
        properties.push(sections.spec(property.name(), SpecKind::Attribute, &fields));
    }
    let names: Vec<u32> = properties.iter().map(|property| property.name).collect();
    let fields = [
        ("specifier", Value::DEFINITION),
        ("typeName", sections.token("Mesh")),
        ("properties", sink.tokens(&names)?),
    ];
    let mut spec = sections.spec(&mesh.name, SpecKind::Prim, &fields);
    spec.children = properties;
    Ok(spec)
}

/// Makes the spec of the layer with the prim that carries the meshes.
fn layer_spec(
    sink: &mut Sink,
    sections: &mut Sections,
    layer: &Layer,
    len: usize,
    meshes: Vec<Spec>,
) -> Result<Spec> {
    let names: Vec<u32> = meshes.iter().map(|mesh| mesh.name).collect();
    let fields = [
        ("specifier", Value::DEFINITION),
        ("typeName", sections.token("Xform")),
        ("primChildren", sink.tokens(&names)?),
    ];
    let mut root = sections.spec(ROOT, SpecKind::Prim, &fields);
    root.children = meshes;
    let fps = sink.double(layer.fps)?;
    let fields = [
        ("defaultPrim", sections.token(ROOT)),
        ("documentation", sections.string(DOCUMENTATION)),
        ("endTimeCode", sink.double(end_time_code(len) as f64)?),
        ("framesPerSecond", fps),
        ("metersPerUnit", sink.double(1.0)?),
        ("startTimeCode", sink.double(0.0)?),
        ("timeCodesPerSecond", fps),
        ("upAxis", sections.token("Y")),
        ("primChildren", sink.tokens(&[root.name])?),
    ];
    let mut layer = sections.spec("", SpecKind::Layer, &fields);
    layer.children.push(root);
    Ok(layer)
}
