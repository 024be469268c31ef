//! Binary glTF 2.0 (`.glb`) of a character and its garment: one file that Blender, game engines and
//! web pages open.
//!
//! | part | animation |
//! |---|---|
//! | body | skin: one key a frame for the rotation of each joint and the translation of the root |
//! | garment | one morph target a frame from the second on, relative to the first, with weights |
//!
//! The body is a skin, because a skin is exact, can be posed further and takes kilobytes. Morph
//! targets would take 24 bytes for each vertex and frame. A vertex with more than four influences
//! has further sets (`JOINTS_1`, `WEIGHTS_1`, ...), the heaviest influences in the first. Blender
//! reads all sets; three.js reads the first one and normalises it. Readers without skins, such as
//! trimesh, show the body in its bind pose.
//!
//! The garment moves independently of the skeleton, and so every frame is a morph target. At the
//! time of frame t the weight of its own target is one and all others are zero. Between two frames
//! `LINEAR` interpolation of the weights interpolates the positions linearly. The first frame is
//! the mesh itself: readers without animation show it, beside the body in the same pose.
//!
//! Vertices keep their order and number. Texture coordinates belong to corners in this crate and to
//! vertices in glTF. A vertex on a seam therefore has copies, which come after all other vertices
//! and share its position and normal. Units and axes are those of glTF: metres, +Y up, the
//! character faces +Z.
//!
//! Numbers are `f32`. `KHR_mesh_quantization` would halve the size, but a reader must refuse a file
//! with a required extension that it does not know.
//!
//! Source: the glTF 2.0 specification, ISO/IEC 12113:2022.
//!
//! ```
//! use glam::Vec3;
//! use unic_core::{
//!     character::Character,
//!     mesh::TriMesh,
//!     skeleton::{Skeleton, SkeletonParts},
//!     skinning::SkinningWeights,
//! };
//! use unic_io::glb::{GlbScene, GlbWriter};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let triangle = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let root = SkeletonParts {
//!     parents: vec![-1],
//!     joints: vec![Vec3::ZERO],
//!     ..Default::default()
//! };
//! let character = Character {
//!     body: triangle.clone(),
//!     skeleton: Skeleton::new(root)?,
//!     weights: SkinningWeights::from_dense(&[1.0; 3], 3, 1)?,
//!     file_mesh: None,
//! };
//! let scene = GlbScene {
//!     name: "wave",
//!     character: &character,
//!     garment: &triangle,
//!     fps: 30.0,
//!     frames: 2,
//! };
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("wave.glb");
//! let mut glb = GlbWriter::create(&path, &scene)?;
//! for height in [0.0, 0.1] {
//!     let garment = triangle.vertices.iter().map(|v| v + Vec3::Y * height);
//!     let garment: Vec<Vec3> = garment.collect();
//!     glb.push(&character.skeleton.bind_pose(), &garment)?;
//! }
//! glb.finish()?;
//! assert!(std::fs::read(&path)?.starts_with(b"glTF"));
//! # Ok(())
//! # }
//! ```

mod binary;
mod body;
mod document;
mod file_mesh;
mod json;
mod morphs;
mod still;
mod surface;
mod tracks;
mod writer;

pub use still::write_mesh_with_texels;
pub use writer::{GlbScene, GlbWriter, MAX_FRAMES};
