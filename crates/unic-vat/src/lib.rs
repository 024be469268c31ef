//! Vertex animation textures: an animation that any engine plays with a vertex shader alone.
//!
//! | file, for `walk.exr` | content |
//! |---|---|
//! | `walk.exr`, or `walk.png` | positions: one texel for each vertex and frame |
//! | `walk.normals.png` | unit normals in the same texels, 8 bits |
//! | `walk.vat.glb` | mesh of the first frame; `TEXCOORD_1` is the texel of each vertex in frame 0 |
//! | `walk.vat.json` | sizes, bounds, frame rate: [`VatDescription`] |
//!
//! Vertex v of frame t is in column `v % columns` and row `t * rows_a_frame + v / columns`, counted
//! from the upper left corner. A shader adds `t * rows_a_frame / height` to the second coordinate of
//! the lookup, without filtering:
//!
//! ```glsl
//! vec2 texel = texcoord_1 + vec2(0.0, float(frame * rows_a_frame) / float(height));
//! vec3 position = textureLod(positions, texel, 0.0).rgb;            // .exr: metres
//! position = mix(minimum, maximum, position);                       // .png: within the bounds
//! vec3 normal = 2.0 * textureLod(normals, texel, 0.0).rgb - 1.0;
//! ```
//!
//! An EXR holds metres in 32 bits. A PNG holds 16 bits of the range between the bounds: 0.03 mm for
//! a garment that moves through two metres. Both are linear data, not colours. Axes are those of
//! captures: right-handed, +Y up.
//!
//! ```
//! use glam::Vec3;
//! use unic_core::mesh::TriMesh;
//! use unic_vat::VatWriter;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! let path = folder.path().join("walk.exr");
//! let mesh = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let mut vat = VatWriter::create(&path, &mesh, 30.0, 2)?;
//! for height in [0.0, 0.1] {
//!     vat.push(&mesh.vertices.iter().map(|v| v + Vec3::Y * height).collect::<Vec<_>>())?;
//! }
//! vat.finish()?;
//! assert!(folder.path().join("walk.vat.json").exists());
//! # Ok(())
//! # }
//! ```

mod encode;
mod layout;

pub use layout::{LARGEST_SIDE, VatDescription, VatFile, VatPaths};

use encode::{exr_bytes, normals_png, positions_png};
use glam::{Vec2, Vec3};
use layout::{Layout, PositionEncoding};
use std::{
    io::Write,
    path::{Path, PathBuf},
};
use thiserror::Error;
use unic_core::mesh::{SeamlessNormals, TriMesh};
use unic_io::{atomic::AtomicFile, glb::write_mesh_with_texels};

/// Result of writing a vertex animation texture.
pub type Result<T> = std::result::Result<T, Error>;

/// Failure to write a vertex animation texture.
#[derive(Debug, Error)]
pub enum Error {
    /// A file cannot be written, or the mesh has faults.
    #[error(transparent)]
    File(#[from] unic_io::Error),
    /// The animation does not fit the format.
    #[error("{path}: expected {expected}, found {found}")]
    Content {
        /// The texture of positions.
        path: PathBuf,
        /// Content that the format holds.
        expected: String,
        /// Content that was given.
        found: String,
    },
    /// A picture cannot be encoded.
    #[error("{path}: cannot encode: {reason}")]
    Encode {
        /// The picture.
        path: PathBuf,
        /// The encoder's reason.
        reason: String,
    },
}

/// Writer of a vertex animation texture, one frame at a time. No file appears before
/// [`VatWriter::finish`].
///
/// Memory holds the positions of all frames, at most 0.8 GB, and while the files are written their
/// normals and pixels, as much again twice.
#[derive(Debug)]
pub struct VatWriter {
    paths: VatPaths,
    files: VatFiles,
    encoding: PositionEncoding,
    mesh: TriMesh,
    fps: f32,
    layout: Layout,
    /// Frame after frame.
    positions: Vec<Vec3>,
}

impl VatWriter {
    /// Starts a texture of `frames` frames at `path`, which ends in `.exr` or `.png`. The positions
    /// of `mesh` itself are not written.
    ///
    /// # Errors
    /// Another ending; a mesh without vertices; no frame, or more than a texture holds.
    pub fn create(path: &Path, mesh: &TriMesh, fps: f32, frames: usize) -> Result<Self> {
        let encoding = PositionEncoding::of(path)?;
        if mesh.vertices.is_empty() {
            return Err(content(path, "a mesh with vertices", "none"));
        }
        let paths = VatPaths::of(path);
        Ok(Self {
            layout: Layout::new(path, mesh.vertices.len(), frames)?,
            encoding,
            files: VatFiles::create(&paths)?,
            paths,
            mesh: mesh.clone(),
            fps,
            positions: Vec::new(),
        })
    }

    /// Adds a frame: one position for each vertex, metres.
    ///
    /// # Errors
    /// Another number of vertices; positions that are not finite; more frames than announced.
    pub fn push(&mut self, frame: &[Vec3]) -> Result<()> {
        let path = &self.paths.positions;
        let vertices = self.mesh.vertices.len();
        if frame.len() != vertices {
            let expected = format!("positions of {vertices} vertices");
            return Err(content(path, expected, frame.len().to_string()));
        }
        if let Some(vertex) = frame.iter().position(|p| !p.is_finite()) {
            return Err(content(
                path,
                "finite positions",
                format!("vertex {vertex} at none"),
            ));
        }
        if self.positions.len() == self.layout.frames * vertices {
            return Err(self.wrong_count("a further one"));
        }
        self.positions.extend(frame);
        Ok(())
    }

    /// Writes all files and returns their paths.
    ///
    /// # Errors
    /// Fewer frames than announced; a picture or file that cannot be written.
    pub fn finish(self) -> Result<VatPaths> {
        let vertices = self.mesh.vertices.len();
        if self.positions.len() != self.layout.frames * vertices {
            return Err(self.wrong_count((self.positions.len() / vertices).to_string()));
        }
        let Self {
            paths,
            mut files,
            encoding,
            mesh,
            fps,
            layout,
            positions,
        } = self;
        let bounds = bounds(&positions);
        let description = VatDescription::new(&paths, encoding, layout, fps, bounds);
        let json = serde_json::to_vec_pretty(&description).map_err(|e| Error::Encode {
            path: paths.description.clone(),
            reason: e.to_string(),
        })?;
        let normals = normals(&mesh, &positions);
        let texture = match encoding {
            PositionEncoding::Metres => exr_bytes(&paths.positions, layout, &positions)?,
            PositionEncoding::WithinBounds => positions_png(&paths.positions, layout, &positions, bounds)?,
        };
        let normals = normals_png(&paths.normals, layout, &normals)?;
        let texels: Vec<Vec2> = (0..vertices).map(|vertex| layout.texel(vertex)).collect();
        // Everything is written before the first file gets its name.
        for (file, bytes) in [
            (&mut files.normals, &normals),
            (&mut files.positions, &texture),
            (&mut files.description, &json),
        ] {
            let written = file.write_all(bytes).and_then(|()| file.flush());
            written.map_err(|source| unic_io::Error::Io {
                path: file.target().to_path_buf(),
                action: "write",
                source,
            })?;
        }
        write_mesh_with_texels(&paths.mesh, &mesh, &positions[..vertices], &texels)?;
        files.normals.finish()?;
        files.positions.finish()?;
        files.description.finish()?;
        Ok(paths)
    }

    fn wrong_count(&self, found: impl Into<String>) -> Error {
        let expected = format!("{} frames", self.layout.frames);
        content(&self.paths.positions, expected, found)
    }
}

/// Files that are opened before the first frame, so that a missing folder is found early.
#[derive(Debug)]
struct VatFiles {
    normals: AtomicFile,
    positions: AtomicFile,
    description: AtomicFile,
}

impl VatFiles {
    fn create(paths: &VatPaths) -> Result<Self> {
        Ok(Self {
            normals: AtomicFile::create(&paths.normals)?,
            positions: AtomicFile::create(&paths.positions)?,
            description: AtomicFile::create(&paths.description)?,
        })
    }
}

/// Returns the smallest and the largest coordinates.
fn bounds(positions: &[Vec3]) -> [Vec3; 2] {
    let first = positions.first().copied().unwrap_or_default();
    let fold = |f: fn(Vec3, Vec3) -> Vec3| positions.iter().copied().fold(first, f);
    [fold(Vec3::min), fold(Vec3::max)]
}

/// Computes the normals of all frames.
fn normals(mesh: &TriMesh, positions: &[Vec3]) -> Vec<Vec3> {
    let mut all = Vec::with_capacity(positions.len());
    let mut normals = Vec::new();
    let seamless = SeamlessNormals::new(mesh);
    for frame in positions.chunks_exact(mesh.vertices.len()) {
        seamless.compute(frame, &mut normals);
        all.extend_from_slice(&normals);
    }
    all
}

pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Error {
    Error::Content {
        path: path.to_path_buf(),
        expected: expected.into(),
        found: found.into(),
    }
}

#[cfg(test)]
mod tests;
