//! Files that belong to a capture, so that no other output overwrites them.

use crate::atomic::parent_folder;
use std::{
    ffi::OsString,
    path::{Component, Path, PathBuf},
};

/// Name of the manifest, which exists once a capture is complete.
pub const MANIFEST: &str = "capture.toml";

/// Name of the file that a simulation keeps instead of the manifest until all clips are finished.
pub const UNFINISHED: &str = "simulation.toml";

/// Names of a capture's own files beside its folder of clips.
pub const OWN_FILES: [&str; 6] = [
    MANIFEST,
    UNFINISHED,
    "character.npz",
    "garment.obj",
    "garment.npz",
    "simulation.json",
];

/// Name of a capture's folder of clips.
const CLIPS: &str = "clips";

/// Returns whether a folder is a capture, finished or not.
pub fn is_capture(folder: &Path) -> bool {
    [MANIFEST, UNFINISHED]
        .iter()
        .any(|name| folder.join(name).is_file())
}

/// Returns the capture that an output at `path` would write into.
///
/// A capture's own paths are its folder, [`OWN_FILES`] and everything in its folder of clips. Other
/// files in its folder may be written. Links are followed.
pub fn capture_written_by(path: &Path) -> Option<PathBuf> {
    let path = real_path(path);
    // The nearest capture above the path.
    let root = path.ancestors().find(|folder| is_capture(folder))?;
    let below = path.strip_prefix(root).ok()?;
    let is_own = match below.components().next() {
        None => true,
        Some(first) if first.as_os_str() == CLIPS => true,
        Some(_) => OWN_FILES.iter().any(|name| below == Path::new(name)),
    };
    is_own.then(|| root.to_path_buf())
}

/// Resolves a path to an absolute one without links. Parts that do not exist yet are appended
/// unchanged.
pub fn real_path(path: &Path) -> PathBuf {
    let mut missing: Vec<OsString> = Vec::new();
    let mut there = path.to_path_buf();
    loop {
        if let Ok(mut real) = there.canonicalize() {
            for part in missing.iter().rev() {
                // `..` behind a folder that does not exist yet cannot be resolved by the system.
                // The parts that do not exist are appended from the outermost to the innermost.
                match Path::new(part).components().next() {
                    Some(Component::ParentDir) => drop(real.pop()),
                    _ => real.push(part),
                }
            }
            return real;
        }
        let Some(last) = there.components().next_back() else {
            return path.to_path_buf();
        };
        missing.push(last.as_os_str().to_owned());
        let parent = parent_folder(&there).to_path_buf();
        if parent == there {
            // The working folder was deleted: there is nothing to resolve against.
            return path.to_path_buf();
        }
        there = parent;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn own_files_are_recognised_through_links() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("coat");
        fs::create_dir_all(root.join("clips")).unwrap();
        fs::write(root.join(MANIFEST), "").unwrap();
        let own = [
            "",
            "capture.toml",
            "garment.obj",
            "clips",
            "clips/a.npz",
            "clips/new/b",
            "new/../clips/x",
        ];
        for name in own {
            assert!(capture_written_by(&root.join(name)).is_some(), "{name}");
        }
        for name in ["coat.unic", "pictures/a.png", "pictures/garment.obj", "../other"] {
            assert_eq!(capture_written_by(&root.join(name)), None, "{name}");
        }
        #[cfg(unix)]
        {
            let link = folder.path().join("link");
            std::os::unix::fs::symlink(root.join("clips"), &link).unwrap();
            let found = capture_written_by(&link.join("a.npz"));
            assert_eq!(found, Some(root.canonicalize().unwrap()));
        }
    }

    #[test]
    fn unfinished_simulation_is_a_capture() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_capture(folder.path()));
        fs::write(folder.path().join(UNFINISHED), "").unwrap();
        assert!(capture_written_by(&folder.path().join("clips/a.npz")).is_some());
    }
}
