//! The text form of a layer, `.usda`.

use super::{
    extent,
    layer::{CORNERS, DOCUMENTATION, Layer, LayerMesh, ROOT, Sampled, end_time_code},
};
use crate::{
    atomic::AtomicFile,
    cache::{FrameSpool, SpooledFrames},
    error::{Error, Result},
};
use glam::Vec3;
use std::{
    fmt::Display,
    io::{self, Write},
    path::{Path, PathBuf},
};

/// Writer of the text form. Frames wait in temporary files, one for each mesh.
#[derive(Debug)]
pub(super) struct TextWriter {
    path: PathBuf,
    layer: Layer,
    frames: Vec<FrameSpool>,
}

impl TextWriter {
    pub(super) fn create(path: &Path, layer: Layer) -> Result<Self> {
        let frames = layer
            .meshes
            .iter()
            .map(|mesh| FrameSpool::create(path, mesh.vertex_count));
        Ok(Self {
            path: path.to_path_buf(),
            frames: frames.collect::<Result<_>>()?,
            layer,
        })
    }

    pub(super) fn push(&mut self, frame: &[&[Vec3]]) -> Result<()> {
        let mut spools = self.frames.iter_mut().zip(frame);
        spools.try_for_each(|(spool, positions)| spool.push(positions))
    }

    pub(super) fn finish(self) -> Result<()> {
        let Self { path, layer, frames } = self;
        let failed = |e| Error::io(&path, "write")(e);
        let mut file = AtomicFile::create(&path)?;
        let frames: Vec<SpooledFrames> = frames
            .into_iter()
            .map(FrameSpool::finish)
            .collect::<Result<_>>()?;
        let len = frames.first().map_or(0, SpooledFrames::len);
        write_header(&mut file, &layer, len).map_err(failed)?;
        for (mesh, mut frames) in layer.meshes.iter().zip(frames) {
            write_topology(&mut file, mesh).map_err(failed)?;
            for property in Sampled::ALL {
                write_samples(&mut file, &path, mesh, property, &mut frames)?;
            }
            file.write_all(b"    }\n").map_err(failed)?;
        }
        file.write_all(b"}\n").map_err(failed)?;
        file.finish()
    }
}

fn write_header(file: &mut AtomicFile, layer: &Layer, len: usize) -> io::Result<()> {
    let (fps, end) = (layer.fps, end_time_code(len));
    write!(
        file,
        "#usda 1.0\n(\n    doc = \"{DOCUMENTATION}\"\n    defaultPrim = \"{ROOT}\"\n    endTimeCode = {end}\n    \
         framesPerSecond = {fps}\n    metersPerUnit = 1\n    startTimeCode = 0\n    timeCodesPerSecond = {fps}\n    \
         upAxis = \"Y\"\n)\n\ndef Xform \"{ROOT}\"\n{{\n"
    )
}

/// Opens a mesh and writes its faces and texture coordinates.
fn write_topology(file: &mut AtomicFile, mesh: &LayerMesh) -> io::Result<()> {
    write!(file, "    def Mesh \"{}\"\n    {{\n", mesh.name)?;
    write_list(file, "int[] faceVertexCounts", mesh.faces.iter().map(|_| CORNERS))?;
    write_list(file, "int[] faceVertexIndices", mesh.faces.as_flattened())?;
    writeln!(file, "        uniform token subdivisionScheme = \"none\"")?;
    let Some((coordinates, corners)) = &mesh.uvs else {
        return Ok(());
    };
    let pairs = coordinates.iter().map(|uv| format!("({}, {})", uv.x, uv.y));
    write!(file, "        texCoord2f[] primvars:st = ")?;
    write_values(file, pairs)?;
    file.write_all(b" (\n            interpolation = \"faceVarying\"\n        )\n")?;
    write_list(file, "int[] primvars:st:indices", corners.as_flattened())
}

/// Writes one property of all frames.
fn write_samples(
    file: &mut AtomicFile,
    path: &Path,
    mesh: &LayerMesh,
    property: Sampled,
    frames: &mut SpooledFrames,
) -> Result<()> {
    let failed = |e| Error::io(path, "write")(e);
    let head = format!("        {} {}", property.type_name(), property.name());
    if property == Sampled::Normals {
        // Metadata belongs to the attribute and cannot stand beside its samples.
        let text = format!("{head} (\n            interpolation = \"vertex\"\n        )\n");
        file.write_all(text.as_bytes()).map_err(failed)?;
    }
    writeln!(file, "{head}.timeSamples = {{").map_err(failed)?;
    let mut values = Vec::new();
    frames.for_each(|t, positions| {
        match property {
            Sampled::Extent => values = extent(positions).to_vec(),
            Sampled::Normals => mesh.normals.compute(positions, &mut values),
            Sampled::Points => values = positions.to_vec(),
        }
        let triples = values.iter().map(|v| format!("({}, {}, {})", v.x, v.y, v.z));
        write!(file, "            {t}: ").map_err(failed)?;
        write_values(file, triples).map_err(failed)?;
        file.write_all(b",\n").map_err(failed)
    })?;
    file.write_all(b"        }\n").map_err(failed)
}

/// Writes an attribute with one value for all frames.
fn write_list<T: Display>(
    file: &mut AtomicFile,
    declaration: &str,
    values: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    write!(file, "        {declaration} = ")?;
    write_values(file, values)?;
    file.write_all(b"\n")
}

fn write_values<T: Display>(file: &mut AtomicFile, values: impl IntoIterator<Item = T>) -> io::Result<()> {
    let mut separator = "[";
    for value in values {
        write!(file, "{separator}{value}")?;
        separator = ", ";
    }
    // Without values nothing has opened the list.
    file.write_all(if separator == "[" { b"[]" } else { b"]" })
}
