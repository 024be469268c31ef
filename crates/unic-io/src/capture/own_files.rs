//! Which files are a capture's own, so that nothing else is ever written over them.

use crate::atomic::parent_folder;
use std::{
    ffi::OsString,
    path::{Component, Path, PathBuf},
};

/// The manifest: there once a capture is complete.
pub const MANIFEST: &str = "capture.toml";

/// Name of the file that a simulation keeps instead of the manifest until all of its clips are made.
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

const CLIPS: &str = "clips";

/// Is this folder a capture, finished or not?
pub fn is_capture(folder: &Path) -> bool {
    [MANIFEST, UNFINISHED]
        .iter()
        .any(|name| folder.join(name).is_file())
}

/// The capture that `path` would write into: its own folder, one of its own files, or anything in its folder of
/// clips. Links are followed. Other files in a capture's folder are nobody's.
pub fn capture_written_by(path: &Path) -> Option<PathBuf> {
    let path = real_path(path);
    let root = path.ancestors().find(|folder| is_capture(folder))?;
    let below = path.strip_prefix(root).ok()?;
    let is_own = match below.components().next() {
        None => true,
        Some(first) if first.as_os_str() == CLIPS => true,
        Some(_) => OWN_FILES.iter().any(|name| below == Path::new(name)),
    };
    is_own.then(|| root.to_path_buf())
}

/// The absolute path without links, as far as the path exists; what does not exist yet is added as it is.
pub fn real_path(path: &Path) -> PathBuf {
    let mut missing: Vec<OsString> = Vec::new();
    let mut there = path.to_path_buf();
    loop {
        if let Ok(mut real) = there.canonicalize() {
            for part in missing.iter().rev() {
                // What follows a folder that is yet to be made.
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
            // The working folder itself is gone.
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
    fn a_captures_own_files_are_known_through_links() {
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
    fn an_unfinished_simulation_is_a_capture_too() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_capture(folder.path()));
        fs::write(folder.path().join(UNFINISHED), "").unwrap();
        assert!(capture_written_by(&folder.path().join("clips/a.npz")).is_some());
    }
}
