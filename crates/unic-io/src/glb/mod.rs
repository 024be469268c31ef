//! Binary glTF 2.0 (`.glb`) of a character and its garment: one file that Blender, game engines and
//! web pages open.
//!
//! | | how it is animated |
//! |---|---|
//! | body | a skin: rotations of the joints and the translation of the root, one key a frame |
//! | garment | a morph target a frame from the second on, relative to the first, and their weights |
//!
//! The body as a skin is exact, takes kilobytes where one morph target a frame takes 24 bytes a vertex
//! and frame, and leaves a rig that can be posed further. A vertex that more than four joints move has
//! further sets of influences (`JOINTS_1`, `WEIGHTS_1`, ...): Blender reads all of them, three.js the
//! first set alone, normalised again; the heaviest influences are in the first set.
//! Readers that know no skins, trimesh among them, show the body in its bind pose.
//!
//! A garment has no skeleton that says where its vertices are, so every frame is a shape. At the time
//! of frame t the weight of its own shape is one and all others are zero; between two frames `LINEAR`
//! interpolation of the weights is linear interpolation of the positions. The first frame is the mesh
//! itself: that is what shows a reader without animation, beside the body in the same pose.
//!
//! Vertices keep their order and number. Texture coordinates belong to corners here and to vertices in
//! glTF, so that a vertex on a seam has copies: they come after all others, at the same place and with
//! the same normal. Units and axes are glTF's own: metres, +Y up, the character faces +Z.
//!
//! Numbers are `f32`. `KHR_mesh_quantization` would halve the size, but a reader that does not know a
//! required extension must refuse the file.
//!
//! Source: the glTF 2.0 specification, ISO/IEC 12113:2022.
//!
//! ```
//! use glam::Vec3;
//! use unic_core::{character::Character, mesh::TriMesh, skeleton::{Skeleton, SkeletonParts}, skinning::SkinningWeights};
//! use unic_io::glb::{GlbScene, GlbWriter};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let triangle = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
//! let character = Character {
//!     body: triangle.clone(),
//!     skeleton: Skeleton::new(SkeletonParts { parents: vec![-1], joints: vec![Vec3::ZERO], ..Default::default() })?,
//!     weights: SkinningWeights::from_dense(&[1.0; 3], 3, 1)?,
//! };
//! let scene = GlbScene { name: "wave", character: &character, garment: &triangle, fps: 30.0, frames: 2 };
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("wave.glb");
//! let mut glb = GlbWriter::create(&path, &scene)?;
//! for height in [0.0, 0.1] {
//!     let garment: Vec<Vec3> = triangle.vertices.iter().map(|v| v + Vec3::Y * height).collect();
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
mod json;
mod seams;
mod shapes;
mod tracks;
mod writer;

pub use writer::{GlbScene, GlbWriter, MAX_FRAMES};
