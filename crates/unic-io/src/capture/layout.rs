//! Paths of the files of a capture.

use super::own_files::MANIFEST;
use std::path::{Path, PathBuf};

/// Path of the manifest.
pub(super) fn manifest(root: &Path) -> PathBuf {
    root.join(MANIFEST)
}

/// Path of the character.
pub(super) fn character(root: &Path) -> PathBuf {
    root.join("character.npz")
}

/// Path of the garment's rest shape.
pub(super) fn garment_mesh(root: &Path) -> PathBuf {
    root.join("garment.obj")
}

/// Path of the garment's weights and vertex attributes.
pub(super) fn garment_arrays(root: &Path) -> PathBuf {
    root.join("garment.npz")
}

/// Folder of the clips.
pub(super) fn clips(root: &Path) -> PathBuf {
    root.join("clips")
}

/// Path of a clip's motion.
pub(super) fn clip(root: &Path, name: &str) -> PathBuf {
    clips(root).join(format!("{name}.npz"))
}

/// Path of a clip's garment positions.
pub(super) fn clip_garment(root: &Path, name: &str) -> PathBuf {
    // Beside the motion, so that moving a clip means moving two files of one name.
    clips(root).join(format!("{name}.garment.npy"))
}
