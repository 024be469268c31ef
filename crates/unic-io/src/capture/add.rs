//! Adding a clip to a capture that exists, or making a capture from its first clip.

use super::{
    layout,
    manifest::{Manifest, Splits},
    own_files::MANIFEST,
    read::Capture,
};
use crate::{
    atomic::{self, TemporaryFolder, leftover_folders, sync_folder},
    error::{Error, Result},
};
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_core::{character::Character, mesh::TriMesh};

/// Purpose of the temporary folder, which is part of its name.
const PURPOSE: &str = "import";
/// Name of the capture's next manifest in the temporary folder. Its presence says that the staged
/// files are complete.
const NEXT_MANIFEST: &str = "next.toml";

/// Largest distance of the same vertex or joint in two files, metres. Files round in many ways.
const SAME_PLACE_M: f32 = 1e-4;
/// Largest difference of the same skinning weight in two files.
const SAME_WEIGHT: f32 = 1e-3;

/// Folder in a capture's own folder, in which a clip is written as a capture by itself.
///
/// The clip can be checked there. [`StagedClip::commit`] moves it into the capture; dropping it
/// before that removes it.
#[derive(Debug)]
pub struct StagedClip {
    folder: TemporaryFolder,
    root: PathBuf,
}

impl StagedClip {
    /// Creates the folder for a clip of the capture in `root`, a folder that exists.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub fn create_in(root: &Path) -> Result<Self> {
        let folder = TemporaryFolder::create_for(root, PURPOSE);
        Ok(Self {
            folder: folder
                .map_err(atomic::without_path)
                .map_err(Error::io(root, "create a folder in"))?,
            root: root.to_path_buf(),
        })
    }

    /// Path of the folder, for a [`CaptureWriter`](super::CaptureWriter).
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Moves the clip `name` into the capture, whose manifest becomes `manifest`.
    ///
    /// A capture that does not exist yet gets the character and the garment too. A clip of that name
    /// is replaced. A capture is complete at every moment: one that is interrupted lacks the clip
    /// until [`finish_moves`] completes it.
    ///
    /// # Errors
    /// A manifest that [`Manifest::read`] would refuse; a file that cannot be moved or written.
    pub fn commit(self, name: &str, manifest: &Manifest) -> Result<()> {
        let mut staged = Manifest::read(&layout::manifest(self.path()))?;
        // The staged manifest tells which clip is moved, should this process be killed.
        staged.name = name.to_owned();
        staged.write(&layout::manifest(self.path()))?;
        manifest.write(&self.path().join(NEXT_MANIFEST))?;
        // From here on the files are those of the capture, and nothing may remove them.
        let folder = self.folder.keep();
        move_files(&folder, &self.root)
    }
}

/// Completes or removes what killed processes have left of their [`StagedClip`] in the folder
/// `root`. No other process may be writing there.
///
/// # Errors
/// A file that cannot be read or moved.
pub fn finish_moves(root: &Path) -> Result<()> {
    atomic::remove_leftovers(root, |name| name == MANIFEST);
    for folder in leftover_folders(root, PURPOSE) {
        match folder.join(NEXT_MANIFEST).exists() {
            true => move_files(&folder, root)?,
            // A leftover that cannot be removed wastes space and does no other harm.
            false => drop(fs::remove_dir_all(&folder)),
        }
    }
    Ok(())
}

/// Moves the files of a staged clip to the capture. Files that are moved already are left out.
fn move_files(staged: &Path, root: &Path) -> Result<()> {
    let name = Manifest::read(&layout::manifest(staged))?.name;
    let next = Manifest::read(&staged.join(NEXT_MANIFEST))?;
    let path = layout::manifest(root);
    if path.exists() {
        withdraw(&name, &path)?;
    } else {
        for file in [layout::character, layout::garment_mesh, layout::garment_arrays] {
            move_file(&file(staged), &file(root))?;
        }
    }
    let clips = layout::clips(root);
    fs::create_dir_all(&clips).map_err(Error::io(&clips, "create folder"))?;
    // The motion comes last: its file marks a complete clip.
    for file in [layout::clip_garment, layout::clip] {
        move_file(&file(staged, &name), &file(root, &name))?;
    }
    sync_folder(&clips).map_err(Error::io(&clips, "sync"))?;
    next.write(&path)?;
    // A leftover that cannot be removed is removed by the next import.
    let _ = fs::remove_dir_all(staged);
    Ok(())
}

/// Takes a clip out of a capture's manifest, so that no reader looks for its files while they are
/// replaced.
fn withdraw(name: &str, path: &Path) -> Result<()> {
    let mut manifest = Manifest::read(path)?;
    if manifest.splits.split_of(name).is_none() {
        return Ok(());
    }
    remove_name(&mut manifest.splits, name);
    manifest.write(path)
}

fn remove_name(splits: &mut Splits, name: &str) {
    for split in super::Split::ALL {
        splits.of_mut(split).retain(|clip| clip != name);
    }
}

/// Moves a file, replacing one of that name.
fn move_file(from: &Path, to: &Path) -> Result<()> {
    match from.exists() {
        true => fs::rename(from, to).map_err(Error::io(to, "write")),
        false => Ok(()),
    }
}

impl Capture {
    /// Paths of the files that a clip of this name has, of which one or both may not exist.
    pub fn clip_files(&self, name: &str) -> [PathBuf; 2] {
        [
            layout::clip(&self.root, name),
            layout::clip_garment(&self.root, name),
        ]
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
        .map(|(a, b)| a.distance(*b))
        .enumerate()
        // Distances are finite, because readers refuse other positions.
        .find(|(_, distance)| *distance > SAME_PLACE_M);
    far.map(|(vertex, distance)| format!("vertex {vertex} {distance:.4} m away"))
}
