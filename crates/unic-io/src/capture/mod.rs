//! Captures: a folder that holds one garment moving on one character.
//!
//! ```text
//! capture.toml             what the capture is; written last
//! character.npz            the body
//! garment.obj              rest shape, in the character's bind pose
//! garment.npz              optional: weights (V, J), pinned (V), groups (V), mask (V)
//! clips/NAME.npz           poses (T, 3J), trans (T, 3), mocap_framerate;
//!                          optional body (T, B, 3), wind (T, 3), ground_height, garment (T, V, 3)
//! clips/NAME.garment.npy   (T, V, 3) f32, mapped; else `garment` inside NAME.npz
//! ```

mod garment;
mod manifest;
mod own_files;
mod read;
mod write;

pub use garment::{VertexAttributes, WeightsSource, default_weights, read_garment};
pub use manifest::{CAPTURE_VERSION, JointReference, Manifest, Split, Splits, Units, Up};
pub use own_files::{MANIFEST, OWN_FILES, UNFINISHED, capture_written_by, is_capture, real_path};
pub use read::{Capture, CapturedClip, ClipSummary};
pub use write::{CaptureWriter, ClipWriter};

/// File names of a capture.
pub(crate) mod layout {
    use std::path::{Path, PathBuf};

    pub(crate) fn manifest(root: &Path) -> PathBuf {
        root.join(super::MANIFEST)
    }

    pub(crate) fn character(root: &Path) -> PathBuf {
        root.join("character.npz")
    }

    pub(crate) fn garment_mesh(root: &Path) -> PathBuf {
        root.join("garment.obj")
    }

    pub(crate) fn garment_arrays(root: &Path) -> PathBuf {
        root.join("garment.npz")
    }

    pub(crate) fn clips(root: &Path) -> PathBuf {
        root.join("clips")
    }

    pub(crate) fn clip(root: &Path, name: &str) -> PathBuf {
        clips(root).join(format!("{name}.npz"))
    }

    pub(crate) fn clip_garment(root: &Path, name: &str) -> PathBuf {
        clips(root).join(format!("{name}.garment.npy"))
    }
}
