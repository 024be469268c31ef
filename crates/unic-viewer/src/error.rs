//! Errors of the viewer.

use thiserror::Error;
use unic_gpu::GpuError;
use unic_raster::RasterError;

/// Error of a viewer.
#[derive(Debug, Error)]
pub enum ViewerError {
    /// Error of the graphics adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Error of the graphics device while it drew.
    #[error("the graphics device: {0}")]
    Device(String),
    /// Window that cannot be opened.
    #[error("a window cannot be opened: {0}")]
    Window(String),
    /// Error of a picture.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// Array of another length.
    #[error("{what} of a shape: expected {expected}, found {found}")]
    Length {
        /// Array.
        what: &'static str,
        /// Number of vertices of the mesh.
        expected: usize,
        /// Length of the array.
        found: usize,
    },
    /// Picture whose size no adapter draws.
    #[error("a picture: expected sides of 1 to {most} pixels, found {width} x {height}")]
    Size {
        /// Longest side.
        most: u32,
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
}
