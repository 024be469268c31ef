//! Settings with which a play starts.

use crate::{Material, Outfit};
use std::sync::Arc;
use unic_core::motion_matching::{ControllerSettings, Database, TagFilter};

/// Outfit with the motion that moves its character.
#[derive(Clone, Debug)]
pub struct Costume {
    /// Model.
    pub outfit: Arc<Outfit>,
    /// Motion for the model's skeleton, at the model's rate.
    pub database: Arc<Database>,
    /// Frames of it that may be played.
    pub tags: TagFilter,
}

/// Settings of a play.
#[derive(Clone, Debug)]
pub struct PlaySettings {
    /// Costumes, at least one; a key switches between them.
    pub costumes: Vec<Costume>,
    /// Number of characters, at least one. The others follow the first one.
    pub characters: usize,
    /// Settings of the controllers.
    pub control: ControllerSettings,
    /// Looks of the bodies at the start.
    pub skin: Material,
    /// Settling of new garments.
    pub settling: Settling,
}

/// How long new garments fall into place before they are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Settling {
    /// Until they hang.
    Whole,
    /// Shorter in a large crowd, which appears without a pause.
    AtOnce,
}
