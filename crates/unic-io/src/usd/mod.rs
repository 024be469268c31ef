//! Writing USD files of animated meshes: `.usda`, the text, and `.usdc`, the binary form of the same
//! layer.
//!
//! ```text
//! /animation            Xform, the default prim
//! /animation/garment    Mesh
//! /animation/body       Mesh
//! ```
//!
//! Every mesh has its positions, normals and bounds as time samples, one a frame: time code t is
//! frame t, counted from 0. Faces are triangles without subdivision. Texture coordinates belong to
//! corners, as `primvars:st`. The layer is in metres, +Y up, and states its frame rate twice, as
//! `timeCodesPerSecond` and as `framesPerSecond`, because readers differ in which one they use.
//!
//! The binary form is written as it grows and holds no frame in memory. The text lists all frames of
//! one mesh before those of the next, so that frames wait in an unnamed temporary file. A text file
//! has about three times the size of the binary one.
//!
//! Source: Pixar's OpenUSD, schema `UsdGeomMesh` and the file format `usdc`, version 0.8.

mod crate_file;
mod layer;
mod text;

use crate::{
    error::{Error, Result},
    frame_rate::check_frame_rate,
};
use crate_file::CrateWriter;
use glam::Vec3;
use layer::{Layer, LayerMesh};
use std::path::{Path, PathBuf};
use text::TextWriter;
use unic_core::mesh::TriMesh;

/// Writer of a USD file, one frame at a time. The file appears when it is complete.
#[derive(Debug)]
pub struct UsdWriter {
    path: PathBuf,
    vertex_counts: Vec<usize>,
    form: Form,
}

/// Form of a layer, by the extension of its file.
#[derive(Debug)]
enum Form {
    Text(Box<TextWriter>),
    Crate(Box<CrateWriter>),
}

impl UsdWriter {
    /// Starts a file of named meshes, whose own positions are not written. A path that ends in
    /// `.usda` gets the text form, every other one the binary form.
    ///
    /// # Errors
    /// A frame rate outside 1 to 1000; a name that is no identifier or occurs twice; a mesh with
    /// indices out of range; a folder that cannot be written to.
    pub fn create(path: &Path, meshes: &[(&str, &TriMesh)], fps: f32) -> Result<Self> {
        check_frame_rate(f64::from(fps))
            .map_err(|found| Error::content(path, "a frame rate from 1 to 1000", found))?;
        for (i, &(name, mesh)) in meshes.iter().enumerate() {
            if !is_identifier(name) || meshes[..i].iter().any(|&(other, _)| other == name) {
                let expected = "names of meshes that are identifiers and occur once";
                return Err(Error::content(path, expected, format!("`{name}`")));
            }
            mesh.check().map_err(|source| Error::Mesh {
                path: path.to_path_buf(),
                source,
            })?;
        }
        let layer = Layer {
            fps: f64::from(fps),
            meshes: meshes
                .iter()
                .map(|&(name, mesh)| LayerMesh::new(name, mesh))
                .collect(),
        };
        let is_text = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("usda"));
        Ok(Self {
            path: path.to_path_buf(),
            vertex_counts: meshes.iter().map(|(_, mesh)| mesh.vertices.len()).collect(),
            form: match is_text {
                true => Form::Text(Box::new(TextWriter::create(path, layer)?)),
                false => Form::Crate(Box::new(CrateWriter::create(path, layer)?)),
            },
        })
    }

    /// Adds a frame: the positions of each mesh in metres, in the order of the meshes.
    ///
    /// # Errors
    /// Another number of meshes or vertices; positions that are not finite; a full disk.
    pub fn push(&mut self, frame: &[&[Vec3]]) -> Result<()> {
        let counts: Vec<usize> = frame.iter().map(|positions| positions.len()).collect();
        if counts != self.vertex_counts {
            let expected = format!("positions of {:?} vertices", self.vertex_counts);
            return Err(Error::content(&self.path, expected, format!("{counts:?}")));
        }
        if let Some(vertex) = frame.iter().flat_map(|f| f.iter()).position(|p| !p.is_finite()) {
            let found = format!("vertex {vertex} at none");
            return Err(Error::content(&self.path, "finite positions", found));
        }
        match &mut self.form {
            Form::Text(writer) => writer.push(frame),
            Form::Crate(writer) => writer.push(frame),
        }
    }

    /// Completes the file and gives it its final name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<()> {
        match self.form {
            Form::Text(writer) => writer.finish(),
            Form::Crate(writer) => writer.finish(),
        }
    }
}

/// Returns whether a text can name a prim.
fn is_identifier(name: &str) -> bool {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    name.chars().all(is_word) && name.starts_with(|c: char| !c.is_ascii_digit())
}

/// Returns the smallest and the largest coordinates of positions.
fn extent(positions: &[Vec3]) -> [Vec3; 2] {
    // No positions give the empty box of USD, whose corners are in the wrong order.
    let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    positions
        .iter()
        .fold(empty, |[low, high], &p| [low.min(p), high.max(p)])
}

#[cfg(test)]
mod tests;
