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
    /// Error of a garment.
    #[error(transparent)]
    Animator(#[from] unic_core::AnimatorError),
    /// Error of a character under control.
    #[error(transparent)]
    Controller(#[from] unic_core::motion_matching::ControllerError),
    /// Shape on a device that the rasteriser was to draw.
    #[error("the software rasteriser: expected shapes in memory, found one on a graphics device")]
    OnDevice,
    /// Model, capture or animation that cannot be shown.
    #[error("{name}: expected {expected}, found {found}")]
    Source {
        /// Name of the model, capture or animation.
        name: String,
        /// Property that is needed.
        expected: String,
        /// Property that is there.
        found: String,
    },
    /// Play without anything to wear.
    #[error("a play: expected a costume, found none")]
    NoCostume,
    /// Motion at another rate than the garment's.
    #[error("the motion of a garment: expected {expected} frames a second, found {found}")]
    Rate {
        /// Frames a second of the garment.
        expected: f32,
        /// Frames a second of the motion.
        found: f32,
    },
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
