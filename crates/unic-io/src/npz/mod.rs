//! Numpy's archive format `.npz`: a zip archive of `.npy` streams.

mod read;
mod write;

pub use read::Npz;
pub use write::NpzWriter;
