//! Captures: folders that hold one garment moving on one character.
//!
//! ```text
//! capture.toml             manifest; written last
//! character.npz            body, skeleton and skinning weights
//! garment.obj              rest shape, in the character's bind pose
//! garment.npz              optional: weights (V, J), pinned (V), groups (V), mask (V)
//! clips/NAME.npz           poses (T, 3J), trans (T, 3), mocap_framerate;
//!                          optional body (T, B, 3), wind (T, 3), ground_height, garment (T, V, 3)
//! clips/NAME.garment.npy   (T, V, 3) f32, mapped; else `garment` inside NAME.npz
//! ```

mod add;
mod folder;
mod garment;
mod layout;
mod manifest;
mod own_files;
mod read;
mod write;

pub use add::{StagedClip, finish_moves};
pub(crate) use folder::FolderKind;
pub use garment::{VertexAttributes, WeightsSource, default_weights, read_garment};
pub use manifest::{CAPTURE_VERSION, JointReference, Manifest, Split, Splits, Units, Up};
pub use own_files::{MANIFEST, OWN_FILES, UNFINISHED, capture_written_by, is_capture, real_path};
pub use read::{Capture, CapturedClip, ClipSummary};
pub use write::{CaptureWriter, ClipWriter};
