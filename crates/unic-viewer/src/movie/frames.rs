//! Folders of PNG frames.

use super::{
    EarlierFrames, MovieError,
    target::{SUFFIX, parent_folder, prefix, sync_folder, without_path},
};
use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};
use tempfile::{Builder, TempDir};
use unic_raster::Image;

/// Folder of frames that get their place when all are complete.
pub(super) struct FrameFolder {
    /// In the target if that exists, since only then both are surely on one disk; else beside it.
    temporary: TempDir,
    target: PathBuf,
}

impl FrameFolder {
    pub(super) fn create(target: &Path, earlier: EarlierFrames) -> Result<Self, MovieError> {
        if target.is_file() {
            return Err(MovieError::Kind {
                path: target.into(),
                expected: "folder",
                found: "file",
            });
        }
        if let (EarlierFrames::Refuse, Some(frame)) = (earlier, frames_in(target)?.first()) {
            return Err(MovieError::FramesExist {
                path: target.into(),
                found: frame.clone(),
            });
        }
        let folder = match target.is_dir() {
            true => target,
            false => parent_folder(target),
        };
        fs::create_dir_all(folder).map_err(MovieError::io(folder, "create the folder"))?;
        let mut builder = Builder::new();
        let prefix = prefix(target);
        builder.prefix(&prefix).suffix(SUFFIX);
        // Temporary folders are private by default; this one may become an ordinary folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let temporary = builder.tempdir_in(folder).map_err(without_path);
        Ok(Self {
            temporary: temporary.map_err(MovieError::io(target, "create the folder"))?,
            target: target.into(),
        })
    }

    pub(super) fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// Writes a picture as frame `index`.
    pub(super) fn push(&mut self, index: usize, image: &Image) -> Result<(), MovieError> {
        let target = self.target.join(format!("frame_{index:05}.png"));
        let bytes = image.encode_png().map_err(MovieError::raster(&target))?;
        let path = self.temporary.path().join(format!("frame_{index:05}.png"));
        write_synced(&path, &bytes).map_err(MovieError::io(&target, "write the frame"))
    }

    /// Gives the frames their place, where frames of an earlier movie are removed.
    pub(super) fn finish(self) -> Result<(), MovieError> {
        sync_folder(self.temporary.path())?;
        let target = self.target;
        if !target.is_dir() {
            let renamed = fs::rename(self.temporary.path(), &target);
            renamed.map_err(MovieError::io(&target, "rename the complete folder"))?;
            // Kept only once renamed: a failed rename must still be cleaned up.
            let _ = self.temporary.keep();
            return sync_folder(parent_folder(&target));
        }
        for name in frames_in(&target)? {
            let path = target.join(name);
            fs::remove_file(&path).map_err(MovieError::io(&path, "remove the earlier frame"))?;
        }
        for name in frames_in(self.temporary.path())? {
            let path = target.join(&name);
            let renamed = fs::rename(self.temporary.path().join(&name), &path);
            renamed.map_err(MovieError::io(&path, "rename the complete frame"))?;
        }
        sync_folder(&target)
    }
}

fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Names of the frames in a folder, sorted; none if there is no folder.
fn frames_in(folder: &Path) -> Result<Vec<String>, MovieError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut names = Vec::new();
    let read = MovieError::io(folder, "read the folder");
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    for entry in entries.map_err(read)? {
        let name = entry.file_name().to_string_lossy().into_owned();
        if is_frame(&name) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Is a file named like a frame of a movie?
fn is_frame(name: &str) -> bool {
    let number = name
        .strip_prefix("frame_")
        .and_then(|name| name.strip_suffix(".png"));
    number.is_some_and(|number| number.len() >= 5 && number.bytes().all(|byte| byte.is_ascii_digit()))
}
