//! Wavefront OBJ files: one triangle mesh with its vertices in the order of the file.

mod read;
mod write;

pub use read::{parse_obj, read_obj};
pub(crate) use write::write_mesh;
pub use write::{write_obj, write_obj_to};
