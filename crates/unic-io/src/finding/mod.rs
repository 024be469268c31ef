//! Probable mistakes in input, as a type that readers and checks share.

pub(crate) mod units;

use std::fmt::{self, Display};

/// A probable mistake in input that can be read, with its probable cause and a remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The subject: "body", "garment", "clip `walk`", ...
    pub subject: String,
    /// The observation, a noun phrase: "a height of 170.000 m", ...
    pub found: String,
    /// The probable cause.
    pub probably: String,
    /// The remedy, an imperative: "scale the mesh by 0.01 to metres", ...
    pub remedy: String,
}

impl Finding {
    pub(crate) fn new(
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
