//! Vertex animations in the formats that programs exchange: `.pc2`, `.mdd`, `.npz` and folders of
//! OBJ files are read and written, `.npy` is read.

mod read;
mod spool;
mod write;

pub use read::has_obj_files;
pub(crate) use read::{POSITION_ARRAYS, frames_of, obj_files};
pub use read::{VertexCache, read_vertex_cache};
pub(crate) use spool::{FrameSpool, SpooledFrames};
pub use write::{NpzAnimationWriter, ObjFolderWriter, VertexCacheWriter};
