//! Reader and writer of Alembic files (`.abc`) in their Ogawa container.
//!
//! # Writing
//!
//! [`ArchiveWriter`] takes one frame at a time, so that memory does not grow with the animation:
//!
//! ```
//! use ogawa::{Archive, ArchiveWriter, FrameTiming, Faces, MeshDescription};
//!
//! # fn main() -> ogawa::Result<()> {
//! # let folder = tempfile::tempdir().expect("a temporary folder");
//! # let path = folder.path().join("flag.abc");
//! let faces = Faces::triangles(&[[0, 1, 2], [0, 2, 3]]);
//! let mut writer = ArchiveWriter::create(&path, FrameTiming { fps: 30.0, start: 0.0 })?;
//! let flag = writer.add_mesh(&MeshDescription { name: "flag", vertices: 4, faces: &faces, uvs: None })?;
//! for frame in 0..3 {
//!     let z = 0.1 * frame as f32;
//!     writer.push(flag, &[[0.0, 0.0, 0.0], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, 0.0]])?;
//! }
//! writer.save()?;
//! # Ok(()) }
//! ```
//!
//! # Reading
//!
//! [`Archive`] holds all headers and reads samples on demand:
//!
//! ```
//! # use ogawa::{Archive, ArchiveWriter, FrameTiming, Faces, MeshDescription};
//! # fn main() -> ogawa::Result<()> {
//! # let mut writer = ArchiveWriter::new(std::io::Cursor::new(Vec::new()), FrameTiming { fps: 30.0, start: 0.0 })?;
//! # let faces = Faces::triangles(&[[0, 1, 2]]);
//! # let id = writer.add_mesh(&MeshDescription { name: "flag", vertices: 3, faces: &faces, uvs: None })?;
//! # writer.push(id, &[[0.0; 3], [1.0; 3], [2.0, 0.0, 0.0]])?;
//! # writer.push(id, &[[0.0; 3], [1.0; 3], [2.0, 1.0, 0.0]])?;
//! # let bytes = writer.finish()?.into_inner();
//! let mut archive = Archive::from_bytes(&bytes)?; // or Archive::open("flag.abc")
//! for mesh in archive.meshes()? {
//!     println!("{}: {} frames", archive.full_name(mesh.object()), mesh.frames());
//!     let mut positions = Vec::new();
//!     for frame in 0..mesh.frames() {
//!         mesh.world_positions(&mut archive, frame, &mut positions)?;
//!     }
//!     let faces = mesh.faces(&mut archive, 0)?;
//!     assert_eq!((faces.len(), positions[2]), (1, [2.0, 1.0, 0.0]));
//! }
//! # Ok(()) }
//! ```
//!
//! # Layers
//!
//! | module | content |
//! |---|---|
//! | [`container`] | groups and data |
//! | [`archive`] | objects, properties, samples, times, of any schema |
//! | crate root | polygon meshes, subdivision cages, transforms |
//!
//! # Conventions
//!
//! The format has no unit and no up axis. Blender and most other programs take +Y up, and Blender
//! takes metres. Faces are counter-clockwise in this crate; files hold them clockwise.
//!
//! # Damaged files
//!
//! Every offset and count is compared with the size of the file before it is used, groups that
//! contain themselves are refused, and headers take memory in proportion to the file. A damaged
//! file gives an [`Error`] with the offset, or other values than were written: nothing in the
//! format detects a changed number.
//!
//! # Limits
//!
//! - The HDF5 container of early versions is not read, and instances are not followed.
//! - Positions, texture coordinates, normals and velocities must be f32.
//! - Between two samples nothing is interpolated: the nearest sample counts.
//! - Writing makes polygon meshes with constant faces. Each sample has the key that the Alembic
//!   library gives it, a MurmurHash3 digest, by which readers recognise equal samples. The digests of
//!   objects are of another kind than the library's, so they find equal objects of one file only.

pub mod archive;
pub mod container;
mod digest;
mod error;
mod file;
mod geometry;

pub use archive::{Archive, ObjectId};
pub use error::{Error, Result};
pub use file::NewFile;
pub use geometry::{
    ArchiveWriter, Attribute, Faces, FrameTiming, Mesh, MeshDescription, MeshId, MeshKind, Scope, Transform,
};
