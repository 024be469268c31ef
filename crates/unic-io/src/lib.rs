//! Readers and writers of everybody's files.
//!
//! | what | where |
//! |---|---|
//! | a garment moving on a character, the project's own folder | [`capture`] |
//! | a skinned body, `character.npz` | [`read_character`], [`write_character`] |
//! | motion as AMASS and the SMPL family store it, or BVH of any skeleton | [`import_motion`], [`write_motion`] |
//! | a BVH file as it is; how it comes onto a character | [`Bvh`], [`retarget`] |
//! | short motions made long | [`looped`] |
//! | meshes, `.obj` | [`read_obj`], [`write_obj`] |
//! | vertex animations, `.pc2`, `.npz`, `.npy`, folders of `.obj` | [`cache`], [`pc2`], [`frames`] |
//! | a character and its garment in one file, `.glb` | [`glb`] |
//! | numpy arrays | [`npz`], [`npy`] |
//! | plausible mistakes in all of it | [`check`] |
//! | whatever it is, and what is wrong with it | [`inspect()`] |
//!
//! Everything is metres, +Y up, right-handed once it is read; importers say what they converted.
//! Writers are atomic: a file appears whole or not at all. Readers trust nothing: sizes are
//! checked against the file before memory is asked for, and an [`Error`] is one sentence with the
//! file, what was expected and what was found.
//!
//! ```
//! use unic_io::{VertexCacheWriter, read_vertex_cache};
//! use glam::Vec3;
//! use unic_core::mesh::TriMesh;
//!
//! # fn main() -> unic_io::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! let path = folder.path().join("animation.pc2");
//! let mesh = TriMesh {
//!     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     faces: vec![[0, 1, 2]],
//!     uvs: None,
//! };
//! let mut cache = VertexCacheWriter::create(&path, &mesh, 30.0)?;
//! for frame in 0..10 {
//!     let positions: Vec<Vec3> = mesh.vertices.iter().map(|v| v + Vec3::Y * frame as f32).collect();
//!     cache.push(&positions)?;
//! }
//! cache.finish()?;
//!
//! let frames = read_vertex_cache(&path)?.frames;
//! assert_eq!((frames.len(), frames.vertex_count()), (10, 3));
//! assert_eq!(frames.frame(9)[1], Vec3::new(1.0, 9.0, 0.0));
//! # Ok(())
//! # }
//! ```
//!
//! A capture:
//!
//! ```no_run
//! use unic_io::{Capture, Split};
//!
//! # fn main() -> unic_io::Result<()> {
//! let capture = Capture::open("captures/tshirt".as_ref())?;
//! for name in capture.clip_names(Split::Train) {
//!     let clip = capture.load_clip(name)?;
//!     println!("{name}: {} frames of {} vertices", clip.garment.len(), clip.garment.vertex_count());
//! }
//! # Ok(())
//! # }
//! ```

// Arrays in files are little-endian and are mapped and written as they lie in memory.
#[cfg(target_endian = "big")]
compile_error!("unic-io supports little-endian machines only");

pub mod atomic;
pub mod bvh;
pub mod cache;
pub mod capture;
mod character;
pub mod check;
mod counted;
pub mod datasets;
mod error;
mod formats;
pub mod frames;
pub mod glb;
pub mod inspect;
mod motion;
pub mod npy;
pub mod npz;
mod obj;
pub mod pc2;
mod pickle;
pub mod retarget;

pub use cache::{VertexCache, VertexCacheWriter, read_vertex_cache};
pub use capture::{Capture, CaptureWriter, CapturedClip, Manifest, Split};
pub use character::{read_character, write_character};
pub use counted::counted;
pub use error::{Error, Result};
pub use formats::refuse_foreign;
pub use frames::{GarmentFrames, VertexFrames};
pub use inspect::inspect;

pub use bvh::Bvh;
pub use motion::{
    Cycle, Feet, LowPass, MotionImport, MotionOptions, PoseLayout, Repeat, Seating, UpAxis, import_motion,
    looped, write_motion,
};
pub use npz::{Npz, NpzWriter};
pub use obj::{parse_obj, read_obj, write_obj, write_obj_to};
pub use retarget::{BoneMap, FootMeasure, measure_feet};
