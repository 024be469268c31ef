//! Readers and writers of captures, motion, meshes, vertex animations and numpy arrays.
//!
//! | content | items |
//! |---|---|
//! | capture: a garment moving on a character, in the project's own folder layout | [`capture`] |
//! | skinned body, `character.npz`, glTF, FBX or USD | [`read_character`], [`write_character`] |
//! | motion of AMASS and the SMPL family (npz), or BVH of any skeleton | [`import_motion`] |
//! | motion in the project's npz layout | [`write_motion`] |
//! | the content of a BVH file, and its transfer onto a character | [`Bvh`], [`retarget`] |
//! | repetition of a cycle of a short motion | [`repeat_cycle`] |
//! | mesh, `.obj` | [`read_obj`], [`write_obj`] |
//! | vertex animation, `.pc2`, `.mdd`, `.npz`, `.npy`, folder of `.obj` | [`cache`], [`pc2`], [`mdd`], [`frames`] |
//! | a character and its garment in one file, `.glb` | [`glb`] |
//! | several animated meshes in one file, `.abc` | [`alembic`] |
//! | a rigged character and its motion, glTF, FBX, USD | [`rigged`], [`read_character`], [`import_motion`] |
//! | numpy arrays | [`npz`], [`npy`] |
//! | published data sets | [`datasets`] |
//! | probable mistakes in input that can be read | [`check`] |
//! | summary of a file of any kind, with its problems | [`inspect()`] |
//!
//! Captures, characters and imported motions are in metres, +Y up, right-handed; importers return a
//! note for each conversion. [`Bvh`], [`VertexCache`] and meshes keep the unit and axes of their
//! file. Writers are atomic: a file appears complete or not at all. Readers check declared sizes
//! against the file before they allocate memory. An [`Error`] is one sentence: the file, what was
//! expected, what was found.
//!
//! # Layers
//!
//! A module uses modules of its own row and of the rows above it, never those below.
//!
//! | layer | modules |
//! |---|---|
//! | words and limits | `error`, `counted`, `foreign_formats`, `frame_rate`, `mesh_names` |
//! | bytes and containers | [`atomic`], [`npy`], [`npz`], `pickle`, [`frames`] |
//! | single formats, each with its own plain type | [`bvh`], `obj`, [`pc2`], [`mdd`], [`glb`], `gltf`, [`alembic`], [`cache`] |
//! | shared types and names | `up_axis`, [`joint_names`], `finding` |
//! | motion from one skeleton to another | [`retarget`], [`rigged`] |
//! | readers that pick the format | `character`, `motion`, `vertex_animation` |
//! | folders of a garment with its clips | [`capture`] |
//! | users of all of these | [`datasets`], [`check`], [`inspect`](mod@inspect) |
//!
//! # Examples
//!
//! A vertex animation:
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
//!     let offset = Vec3::Y * frame as f32;
//!     let positions: Vec<Vec3> = mesh.vertices.iter().map(|v| v + offset).collect();
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
//!     let garment = capture.load_clip(name)?.garment;
//!     println!("{name}: {} frames of {} vertices", garment.len(), garment.vertex_count());
//! }
//! # Ok(())
//! # }
//! ```

// Arrays in files are little-endian and are mapped and written as they lie in memory.
#[cfg(target_endian = "big")]
compile_error!("unic-io supports little-endian machines only");

pub mod alembic;
pub mod atomic;
pub mod bvh;
pub mod cache;
pub mod capture;
mod character;
pub mod check;
mod counted;
pub mod datasets;
mod error;
mod finding;
mod foreign_formats;
mod frame_rate;
pub mod frames;
pub mod glb;
mod gltf;
pub mod inspect;
pub mod joint_names;
pub mod mdd;
mod mesh_names;
mod motion;
mod motion_database;

pub mod npy;
pub mod npz;
mod obj;
pub mod pc2;
mod pickle;
pub mod retarget;
pub mod rig_fit;
pub mod rigged;
mod smpl_model;
mod up_axis;
pub mod usd;
mod vertex_animation;

pub use bvh::{Bvh, write_bvh};
pub use cache::{VertexCache, VertexCacheWriter, read_vertex_cache};
pub use capture::{Capture, CaptureWriter, CapturedClip, Manifest, Split};
pub use character::{CharacterImport, import_character, read_character, write_character};
pub use counted::counted;
pub use error::{Error, Result};
pub use foreign_formats::refuse_foreign;
pub use frames::{GarmentFrames, VertexFrames};
pub use inspect::inspect;
pub use motion::{
    Cycle, FootLock, FootSlide, GroundPlacement, LowPass, MotionImport, MotionOptions, PoseLayout, Repeat,
    RepeatedMotion, import_motion, repeat_cycle, write_motion,
};
pub use motion_database::{read_motion_database, write_motion_database};
pub use npz::{Npz, NpzWriter};
pub use obj::{parse_obj, read_obj, write_obj, write_obj_to};
pub use retarget::{BoneMap, FootMeasure, measure_feet, smpl_joints};
pub use unic_scene::{Assumed, Up};
pub use up_axis::UpAxis;
pub use vertex_animation::{holds_several_meshes, read_vertex_animation};
