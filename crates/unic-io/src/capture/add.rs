//! Adding a clip to a capture that exists, or making a capture from its first clip.
//!
//! A clip is written as a capture of its own in a temporary folder, checked there, and moved.

use super::{
    layout,
    manifest::{Manifest, Splits},
    read::Capture,
};
use crate::error::{Error, Result};
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_core::{character::Character, mesh::TriMesh};

/// Largest distance of the same vertex or joint in two files, metres. Files round in many ways.
const SAME_PLACE_M: f32 = 1e-4;
/// Largest difference of the same skinning weight in two files.
const SAME_WEIGHT: f32 = 1e-3;

/// Moves the clip `name` of the capture in `staged` into the folder `root`, and writes `manifest`
/// there as `capture.toml`.
///
/// A folder without a capture gets the character and the garment of `staged` too. A clip of that
/// name is replaced. Both folders lie on one file system. A capture is complete at every moment:
/// one that is interrupted lacks the clip.
///
/// # Errors
/// A file that cannot be moved or written; a manifest that cannot be read again.
pub fn move_clip(staged: &Path, root: &Path, name: &str, manifest: &Manifest) -> Result<()> {
    let path = layout::manifest(root);
    if path.exists() {
        withdraw(root, name, &path)?;
    } else {
        for file in [layout::character, layout::garment_mesh, layout::garment_arrays] {
            rename(&file(staged), &file(root))?;
        }
    }
    let clips = layout::clips(root);
    fs::create_dir_all(&clips).map_err(Error::io(&clips, "create folder"))?;
    // The motion comes last: its file marks a complete clip.
    rename(
        &layout::clip_garment(staged, name),
        &layout::clip_garment(root, name),
    )?;
    rename(&layout::clip(staged, name), &layout::clip(root, name))?;
    manifest.write(&path)
}

/// Takes a clip out of a capture: first out of its manifest, so that no reader looks for its files.
fn withdraw(root: &Path, name: &str, path: &Path) -> Result<()> {
    let mut manifest = Manifest::read(path)?;
    if manifest.splits.split_of(name).is_some() {
        remove_name(&mut manifest.splits, name);
        manifest.write(path)?;
    }
    // A clip on disk that no split names is replaced as well.
    for file in [layout::clip(root, name), layout::clip_garment(root, name)] {
        if file.exists() {
            fs::remove_file(&file).map_err(Error::io(&file, "remove"))?;
        }
    }
    Ok(())
}

fn remove_name(splits: &mut Splits, name: &str) {
    for split in super::Split::ALL {
        splits.of_mut(split).retain(|clip| clip != name);
    }
}

fn rename(from: &Path, to: &Path) -> Result<()> {
    fs::rename(from, to).map_err(Error::io(to, "write"))
}

impl Capture {
    /// Returns whether a file of the folder belongs to a clip of this name, listed or not.
    pub fn has_clip_files(&self, name: &str) -> Option<PathBuf> {
        [
            layout::clip(&self.root, name),
            layout::clip_garment(&self.root, name),
        ]
        .into_iter()
        .find(|path| path.exists())
    }

    /// Checks that `character`, read from `path`, is the capture's own. Names of joints may differ.
    ///
    /// # Errors
    /// The first thing in which the two characters differ.
    pub fn check_same_character(&self, path: &Path, character: &Character) -> Result<()> {
        let expected = || format!("the character of {}", self.root.display());
        let (own, other) = (&self.character, character);
        if let Some(found) = mesh_difference(&own.body, &other.body) {
            return Err(Error::content(path, expected(), format!("a body with {found}")));
        }
        let (own, other) = (own.skeleton.to_parts(), other.skeleton.to_parts());
        if own.parents != other.parents {
            return Err(Error::content(path, expected(), "another tree of joints"));
        }
        let far = own
            .joints
            .iter()
            .zip(&other.joints)
            .position(|(a, b)| a.distance(*b) > SAME_PLACE_M);
        if let Some(joint) = far {
            let found = format!("joint {joint} at another place");
            return Err(Error::content(path, expected(), found));
        }
        let pairs = (self.character.weights.to_dense().into_iter()).zip(character.weights.to_dense());
        match pairs.into_iter().any(|(a, b)| (a - b).abs() > SAME_WEIGHT) {
            false => Ok(()),
            true => Err(Error::content(path, expected(), "other skinning weights")),
        }
    }

    /// Checks that `rest`, read from `path`, is the capture's rest shape.
    ///
    /// # Errors
    /// The first thing in which the two meshes differ.
    pub fn check_same_rest(&self, path: &Path, rest: &TriMesh) -> Result<()> {
        match mesh_difference(&self.garment.rest, rest) {
            None => Ok(()),
            Some(found) => {
                let expected = format!("the rest shape of {}", self.root.display());
                Err(Error::content(path, expected, format!("a mesh with {found}")))
            }
        }
    }
}

/// Returns the first thing in which `other` differs from `own`.
fn mesh_difference(own: &TriMesh, other: &TriMesh) -> Option<String> {
    let [expected, found] = [own, other].map(|mesh| mesh.vertices.len());
    if expected != found {
        return Some(format!("{found} vertices instead of {expected}"));
    }
    if own.faces != other.faces {
        return Some("other faces".to_owned());
    }
    let pairs = own.vertices.iter().zip(&other.vertices);
    let far = pairs
        .enumerate()
        .find(|(_, (a, b))| !(a.distance(**b) <= SAME_PLACE_M));
    far.map(|(v, (a, b))| format!("vertex {v} {:.4} m away", a.distance(*b)))
}
