//! Files and folders that appear complete or not at all.

use super::MovieError;
use std::{
    fs::{self, File},
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};
use tempfile::{Builder, TempPath};

/// File that gets its name when it is complete. Dropping it before that removes it.
pub(super) struct TargetFile {
    file: BufWriter<File>,
    temporary: TempPath,
    target: PathBuf,
}

impl TargetFile {
    /// Starts a file in the folder of `target`, which is created if it is missing.
    pub(super) fn create(target: &Path) -> Result<Self, MovieError> {
        if target.is_dir() {
            return Err(MovieError::Kind {
                path: target.into(),
                expected: "file",
                found: "folder",
            });
        }
        let folder = parent_folder(target);
        fs::create_dir_all(folder).map_err(MovieError::io(folder, "create the folder"))?;
        let mut builder = Builder::new();
        let prefix = prefix(target);
        builder.prefix(&prefix).suffix(SUFFIX);
        // Temporary files are private by default; this one is about to become an ordinary file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder);
        let (file, temporary) = file
            .map_err(MovieError::io(target, "create the file"))?
            .into_parts();
        Ok(Self {
            file: BufWriter::new(file),
            temporary,
            target: target.into(),
        })
    }

    pub(super) fn temporary_path(&self) -> &Path {
        &self.temporary
    }

    /// Writes everything to disk and gives the file its name.
    pub(super) fn finish(self) -> Result<(), MovieError> {
        let target = self.target;
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error);
        // Synced before it is renamed: after a power cut, the name must not stand for an empty file.
        let synced = file.and_then(|file| file.sync_all());
        synced.map_err(MovieError::io(&target, "write the file"))?;
        let renamed = self.temporary.persist(&target).map_err(|failed| failed.error);
        renamed.map_err(MovieError::io(&target, "rename the complete file"))?;
        sync_folder(parent_folder(&target))
    }
}

impl Write for TargetFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for TargetFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}

/// Reason without the name of the temporary file, which tells a user nothing.
pub(super) fn without_path(error: io::Error) -> io::Error {
    error.kind().into()
}

/// End of the name of a temporary file or folder, which is `.NAME.RANDOM.tmp`.
pub(super) const SUFFIX: &str = ".tmp";

/// Begin of the name of a temporary file or folder.
pub(super) fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    format!(".{}.", name.to_string_lossy())
}

/// Folder of a path; the current folder for a bare name.
pub(super) fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Syncs a folder, so that a rename in it survives a power cut. Windows has no such call.
pub(super) fn sync_folder(folder: &Path) -> Result<(), MovieError> {
    if cfg!(unix) {
        let synced = File::open(folder).and_then(|folder| folder.sync_all());
        synced.map_err(MovieError::io(folder, "sync the folder"))?;
    }
    Ok(())
}
