//! Places of vertices and frames in a texture.

use crate::{Result, content};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Largest width and height of a texture, pixels: that of mobile graphics devices.
pub const LARGEST_SIDE: usize = 8192;

/// Numbers that stand for a position, by the ending of the texture's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PositionEncoding {
    /// Metres, in 32 bits: `.exr`.
    Metres,
    /// 0 to 1 between the bounds, in 16 bits: `.png`.
    WithinBounds,
}

impl PositionEncoding {
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("exr") => Ok(Self::Metres),
            Some("png") => Ok(Self::WithinBounds),
            found => {
                let found = found.map_or("none".to_owned(), |found| format!(".{found}"));
                Err(content(path, "the ending .exr or .png", found))
            }
        }
    }
}

/// Size of a texture and the places in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) vertices: usize,
    pub(crate) frames: usize,
    pub(crate) columns: usize,
    pub(crate) rows_a_frame: usize,
}

impl Layout {
    /// # Errors
    /// No frame, or more than the texture has rows for.
    pub(crate) fn new(path: &Path, vertices: usize, frames: usize) -> Result<Self> {
        let rows_a_frame = vertices.div_ceil(LARGEST_SIDE);
        // Rows of equal length, so that the last one is not nearly empty.
        let columns = vertices.div_ceil(rows_a_frame);
        if rows_a_frame > LARGEST_SIDE {
            let expected = format!("at most {} vertices", LARGEST_SIDE * LARGEST_SIDE);
            return Err(content(path, expected, vertices.to_string()));
        }
        let most = LARGEST_SIDE / rows_a_frame;
        if !(1..=most).contains(&frames) {
            let expected = format!("1 to {most} frames of {vertices} vertices in a texture");
            return Err(content(path, expected, frames.to_string()));
        }
        Ok(Self {
            vertices,
            frames,
            columns,
            rows_a_frame,
        })
    }

    pub(crate) fn height(self) -> usize {
        self.rows_a_frame * self.frames
    }

    /// Index of the vertex of a frame in a texel, counted over all frames; `None` where a frame has
    /// no vertex left.
    pub(crate) fn value(self, x: usize, y: usize) -> Option<usize> {
        let vertex = (y % self.rows_a_frame) * self.columns + x;
        (vertex < self.vertices).then(|| y / self.rows_a_frame * self.vertices + vertex)
    }

    /// Centre of a vertex's texel in frame 0, as a texture coordinate from the upper left corner.
    pub(crate) fn texel(self, vertex: usize) -> Vec2 {
        let place = [vertex % self.columns, vertex / self.columns];
        let size = [self.columns, self.height()];
        // In f64: neighbours of a texture of 8192 rows are 1e-4 apart.
        let [u, v] = [0, 1].map(|axis| ((place[axis] as f64 + 0.5) / size[axis] as f64) as f32);
        Vec2::new(u, v)
    }
}

/// Paths of the files of one texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VatPaths {
    /// Texture of positions.
    pub positions: PathBuf,
    /// Texture of normals.
    pub normals: PathBuf,
    /// Mesh with the texels of its vertices.
    pub mesh: PathBuf,
    /// Description, JSON.
    pub description: PathBuf,
}

impl VatPaths {
    /// Paths beside the texture of positions.
    pub fn of(positions: &Path) -> Self {
        Self {
            positions: positions.to_path_buf(),
            normals: positions.with_extension("normals.png"),
            mesh: positions.with_extension("vat.glb"),
            description: positions.with_extension("vat.json"),
        }
    }

    /// All paths.
    pub fn all(&self) -> [&PathBuf; 4] {
        [&self.positions, &self.normals, &self.mesh, &self.description]
    }
}

/// A file of a [`VatDescription`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VatFile {
    /// Name, in the folder of the description.
    pub file: String,
    /// Meaning of its numbers: `metres`, `within_bounds`, `minus_one_to_one`, or the attribute with
    /// the texels, `TEXCOORD_1`.
    pub encoding: String,
}

/// Description of a texture, as it is written to JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VatDescription {
    /// Version of this description.
    pub version: u32,
    /// Texture of positions.
    pub positions: VatFile,
    /// Texture of normals.
    pub normals: VatFile,
    /// Mesh with the texels.
    pub mesh: VatFile,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub fps: f32,
    /// Number of vertices of the garment. The mesh has copies of some along texture seams.
    pub vertices: usize,
    /// Width of the textures, pixels.
    pub width: usize,
    /// Height of the textures, pixels.
    pub height: usize,
    /// Rows of one frame.
    pub rows_a_frame: usize,
    /// Smallest coordinates of all frames, metres.
    pub minimum: [f32; 3],
    /// Largest coordinates of all frames, metres.
    pub maximum: [f32; 3],
    /// Axes and unit of positions and bounds.
    pub axes: String,
}

impl VatDescription {
    pub(crate) fn new(
        paths: &VatPaths,
        encoding: PositionEncoding,
        layout: Layout,
        fps: f32,
        bounds: [Vec3; 2],
    ) -> Self {
        let file = |path: &Path, encoding: &str| VatFile {
            file: path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            encoding: encoding.to_owned(),
        };
        let encoding = match encoding {
            PositionEncoding::Metres => "metres",
            PositionEncoding::WithinBounds => "within_bounds",
        };
        Self {
            version: 1,
            positions: file(&paths.positions, encoding),
            normals: file(&paths.normals, "minus_one_to_one"),
            mesh: file(&paths.mesh, "TEXCOORD_1"),
            frames: layout.frames,
            fps,
            vertices: layout.vertices,
            width: layout.columns,
            height: layout.height(),
            rows_a_frame: layout.rows_a_frame,
            minimum: bounds[0].to_array(),
            maximum: bounds[1].to_array(),
            axes: "metres, right-handed, +Y up".to_owned(),
        }
    }
}
