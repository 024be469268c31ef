//! Checks for probable mistakes: input that can be read, and that its author probably did not
//! intend.
//!
//! [`inspect`](crate::inspect()) reports them. Every command that reads such input refuses it
//! unless `--force` is given. A [`Finding`] holds the observation, its probable cause and a remedy.
//!
//! | input | checked by |
//! |---|---|
//! | a body with its skeleton and skinning weights | [`character`] |
//! | any single mesh | [`mesh`] |
//! | a garment's rest shape on a body | [`garment`] |
//! | another mesh of a garment | [`other_mesh`] |
//! | a motion on a character | [`motion`] |
//! | a capture with its clips | [`capture`], [`clip`] |
//! | the garment that an animation starts from | [`start`] |

mod body;
mod clips;
mod fit;
mod meshes;
mod shift;

pub use body::character;
pub(crate) use clips::distance_to_skinning;
pub use clips::{capture, clip, start};
pub use fit::{garment, other_mesh};
pub(crate) use meshes::bounds;
pub use meshes::mesh;

pub use crate::{finding::Finding, motion::check_motion as motion};
