//! Limits of what is sampled.

use crate::{fault::Fault, scene::Local};

/// Memory for the samples of an animation in proportion to its file, and beside that, bytes. Two
/// keys may be hours apart.
const BYTES_PER_BYTE: usize = 16;
const BYTES: usize = 20 << 20;

/// Checks that an animation of `nodes` nodes is in proportion to its file.
///
/// # Errors
/// Too many frames.
pub fn check_length(frames: usize, nodes: usize, file_length: usize) -> Result<(), Fault> {
    let bytes = (frames.saturating_mul(nodes)).saturating_mul(size_of::<Local>());
    let most = file_length.saturating_mul(BYTES_PER_BYTE).saturating_add(BYTES);
    match bytes <= most {
        true => Ok(()),
        false => Err(Fault::new(
            "an animation in proportion to the file",
            format!("{frames} frames of {nodes} nodes"),
        )),
    }
}
