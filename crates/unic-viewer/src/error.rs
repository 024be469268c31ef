use std::io;
use std::path::PathBuf;

/// Why a picture could not be made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
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
    /// An array that holds one element a vertex has another length.
    #[error("{what}: expected {expected} elements, one a vertex, found {found}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Number of vertices.
        expected: usize,
        /// Number of elements found.
        found: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {index}, but the mesh has {vertices} vertices")]
    FaceIndex {
        /// Position of the face in its list.
        face: usize,
        /// Vertex index found there.
        index: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
    /// A camera that has no direction, no angle of view or nothing to look at.
    #[error("camera: expected {expected}, found {found}")]
    Camera {
        /// What a valid camera has.
        expected: &'static str,
        /// The offending value.
        found: String,
    },
    /// The picture could not be encoded as PNG.
    #[error("cannot encode a PNG")]
    Encode(#[from] png::EncodingError),
    /// The picture could not be encoded as JPEG.
    #[error("cannot encode a JPEG")]
    EncodeJpeg(#[from] jpeg_encoder::EncodingError),
    /// A moving picture of nothing.
    #[error("a moving picture without images")]
    NoImages,
    /// A moving picture has one size.
    #[error("a moving picture of {} x {} pixels: found an image of {} x {}", expected[0], expected[1], found[0], found[1])]
    ImageSizes {
        /// Width and height of the first image, pixels.
        expected: [u32; 2],
        /// Of one that differs.
        found: [u32; 2],
    },
    /// The pictures could not be encoded as GIF.
    #[error("cannot encode a GIF")]
    EncodeGif(#[from] gif::EncodingError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}
