//! Files that appear complete or not at all.

use crate::error::{Error, Result};
use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    process,
    sync::atomic::{AtomicU64, Ordering},
};

/// Number of files that this process has started, which makes their temporary names different.
static STARTED: AtomicU64 = AtomicU64::new(0);

/// File under a temporary name in its own folder.
///
/// [`NewFile::save`] renames it. Dropping it before that removes it.
#[derive(Debug)]
pub struct NewFile {
    file: BufWriter<File>,
    temporary: RemovedFile,
    target: PathBuf,
}

/// Path of a file that is removed when this is dropped.
#[derive(Debug)]
struct RemovedFile(PathBuf);

impl Drop for RemovedFile {
    fn drop(&mut self) {
        // A leftover wastes space and does no other harm. After `save` there is none.
        let _ = fs::remove_file(&self.0);
    }
}

impl NewFile {
    /// Starts a file whose final name is `target`.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn create(target: &Path) -> Result<Self> {
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let temporary = target.with_file_name(format!(".{name}.{}-{number}.tmp", process::id()));
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary);
        Ok(Self {
            file: BufWriter::new(file.map_err(Error::io("create"))?),
            temporary: RemovedFile(temporary),
            target: target.to_path_buf(),
        })
    }

    /// Syncs the file and gives it its name. A file of that name is replaced.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn save(self) -> Result<()> {
        let file = self.file.into_inner();
        let file = file.map_err(|e| Error::io("write")(e.into_error()))?;
        file.sync_all().map_err(Error::io("sync"))?;
        drop(file);
        fs::rename(&self.temporary.0, &self.target).map_err(Error::io("rename"))
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
