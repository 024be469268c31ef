use std::io;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Reason why a picture could not be made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// A side of an image is zero or larger than [`crate::MAX_IMAGE_SIDE`].
    #[error("an image of {width} x {height} pixels: each side must have 1 to {max} pixels")]
    ImageSize {
        /// Width asked for, pixels.
        width: u64,
        /// Height asked for, pixels.
        height: u64,
        /// Largest side allowed, pixels.
        max: u32,
    },
    /// The length of an array with one element per vertex is not the number of vertices.
    #[error("{what}: expected {expected} elements, one a vertex, found {found}")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Number of vertices.
        expected: usize,
        /// Number of elements found.
        found: usize,
    },
    /// A face has the index of a vertex that does not exist.
    #[error("face {face} names vertex {index}, but the mesh has {vertices} vertices")]
    FaceIndex {
        /// Index of the face.
        face: usize,
        /// Vertex index found in the face.
        index: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
    /// A camera that has no direction, no angle of view or nothing to look at.
    #[error("camera: expected {expected}, found {found}")]
    Camera {
        /// Condition that a valid camera meets.
        expected: &'static str,
        /// Value that violates the condition.
        found: String,
    },
    /// The picture could not be encoded as PNG.
    #[error("cannot encode a PNG")]
    Encode(#[from] png::EncodingError),
    /// The picture could not be encoded as JPEG.
    #[error("cannot encode a JPEG")]
    EncodeJpeg(#[from] jpeg_encoder::EncodingError),
    /// A moving picture has no images.
    #[error("a moving picture without images")]
    NoImages,
    /// The images of a moving picture differ in size.
    #[error("a moving picture of {} x {} pixels: found an image of {} x {}", expected[0], expected[1], found[0], found[1])]
    ImageSizes {
        /// Width and height of the first image, pixels.
        expected: [u32; 2],
        /// Width and height of the first image with another size, pixels.
        found: [u32; 2],
    },
    /// A frame rate that no moving picture has.
    #[error("a moving picture of {found} frames per second: expected {} to {}", expected.start(), expected.end())]
    FrameRate {
        /// Rates that can be written, frames per second.
        expected: RangeInclusive<f32>,
        /// Rate asked for, frames per second.
        found: f32,
    },
    /// The pictures could not be encoded as GIF.
    #[error("cannot encode a GIF: {0}")]
    EncodeGif(#[from] gif::EncodingError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}
