//! Plausible mistakes: input that can be read, and that is probably not what its maker means.
//!
//! [`inspect`](crate::inspect()) reports them, and every command that reads such input refuses them unless it is told
//! to go on. A [`Finding`] says what was found, what it probably is, and what to do.
//!
//! | input | checked by |
//! |---|---|
//! | a body with its skeleton and skinning weights | [`character`] |
//! | any mesh, by itself | [`mesh`] |
//! | a garment's rest shape on a body | [`garment`] |
//! | another mesh of a garment | [`other_mesh`] |
//! | a motion on a character | [`motion`] |
//! | a capture with its clips | [`capture`], [`clip`] |
//! | where an animation starts | [`start`] |

mod body;
mod clips;
mod fit;
mod lengths;
mod motions;
mod shapes;
mod shift;

pub use body::character;
pub(crate) use clips::distance_to_skinning;
pub use clips::{capture, clip, start};
pub use fit::{garment, other_mesh};
pub(crate) use motions::degrees;
pub use motions::motion;
pub(crate) use shapes::bounds;
pub use shapes::mesh;

use std::fmt::{self, Display};

/// Something that is probably a mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The subject: "body", "garment", "clip `walk`", ...
    pub subject: String,
    /// The thing that was found.
    pub found: String,
    /// The probable cause.
    pub probably: String,
    /// The way to mend it.
    pub remedy: String,
}

impl Finding {
    fn new(
        subject: impl Into<String>,
        found: impl Into<String>,
        probably: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            subject: subject.into(),
            found: found.into(),
            probably: probably.into(),
            remedy: remedy.into(),
        }
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            subject,
            found,
            probably,
            remedy,
        } = self;
        write!(f, "{subject}: found {found}: probably {probably}; {remedy}")
    }
}
