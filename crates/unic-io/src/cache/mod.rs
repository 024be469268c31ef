//! Vertex animations in the formats that programs exchange: `.pc2`, `.npz` and folders of OBJ files
//! are read and written, `.mdd` and `.npy` are read.

mod read;
mod write;

pub use read::{VertexCache, read_vertex_cache};
pub(crate) use read::{frames_of, obj_files};
pub use write::{NpzAnimationWriter, ObjFolderWriter, VertexCacheWriter};
