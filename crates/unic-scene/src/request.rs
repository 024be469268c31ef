//! Request to a reader of scenes.

use serde::{Deserialize, Serialize};

/// Parts of a file to read, and what to assume where the file is silent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Parts to read.
    pub content: Content,
    /// Assumptions for files that do not state them.
    pub assumed: Assumed,
}

/// Parts of a scene that are filled beside nodes, skins and counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Content {
    /// Nothing else.
    #[default]
    Outline,
    /// Shapes of the meshes that have a skin.
    Skinned,
    /// Motion of the nodes.
    Motion,
    /// Shape and point samples of the mesh of this index.
    Points(usize),
}

/// Unit, axis and rate of files that state none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Assumed {
    /// Metres in a unit of the file.
    pub metres_per_unit: Option<f32>,
    /// Axis that points up.
    pub up: Option<Up>,
    /// Frames per second.
    pub fps: Option<f32>,
}

/// Axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Up {
    /// +Y.
    Y,
    /// +Z.
    Z,
}
