//! Rigged characters, their motion and animated meshes of FBX and USD files.
//!
//! [`read`] returns a [`Scene`]: plain nodes, skins, meshes and one sampled animation, in metres,
//! +Y up. The libraries that know the formats stay inside this crate.
//!
//! Those libraries are not made for damaged files. A program asks for them to run in a process of
//! their own, [`guard::use_child`]: a crash, an endless loop or memory without bound is one sentence
//! then. Without that, panics alone are caught.
//!
//! | format | library | content |
//! |---|---|---|
//! | FBX | ufbx | skinned meshes, the motion of the first animation |
//! | USD | openusd | UsdSkel characters and their motion, points over time |

mod check;
mod fault;
mod fbx;
pub mod guard;
mod request;
mod sampling;
mod scene;
mod unit_words;
mod usd;

pub use fault::Fault;
pub use request::{Assumed, Content, Request, Up};
pub use sampling::check_length;
pub use scene::{Local, Mesh, Motion, Node, PointSamples, Scene, Shape, Skin, Track};

use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Autodesk's FBX, binary or text.
    Fbx,
    /// Universal Scene Description: `.usda`, `.usdc`, `.usdz`.
    Usd,
}

/// Reads a file, in a child process if the program has asked for it.
///
/// # Errors
/// A damaged file, or one that lacks what is asked for.
pub fn read(path: &Path, format: Format, request: &Request) -> Result<Scene, Fault> {
    let scene = guard::read(path, format, request)?;
    scene.check()?;
    Ok(scene)
}

/// Reads a file in this process.
fn read_here(path: &Path, format: Format, request: &Request) -> Result<Scene, Fault> {
    match format {
        Format::Fbx => fbx::read(path, request),
        Format::Usd => usd::read(path, request),
    }
}
