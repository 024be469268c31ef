//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::{
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};
use tempfile::TempPath;

/// Temporary files are called `.NAME.RANDOM.tmp`.
const SUFFIX: &str = ".tmp";
const RANDOM_CHARACTERS: usize = 6;

/// A file being written under a temporary name in its own folder.
///
/// [`AtomicFile::finish`] syncs it and renames it to its final name, replacing what was there;
/// dropping it before that removes it. A reader therefore never sees half a file, and an
/// interrupted program never destroys the previous one.
#[derive(Debug)]
pub struct AtomicFile {
    file: BufWriter<File>,
    temporary: TempPath,
    target: PathBuf,
}

impl AtomicFile {
    /// Starts a file that will be called `target`. Missing folders are created.
    ///
    /// # Errors
    /// The folder cannot be created or written to.
    pub fn create(target: &Path) -> Result<Self> {
        let folder = parent_folder(target);
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create folder"))?;
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{name}.");
        builder
            .prefix(&prefix)
            .suffix(SUFFIX)
            .rand_bytes(RANDOM_CHARACTERS);
        // Temporary files are private by default; this one is about to become an ordinary file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(without_path);
        let (file, temporary) = file.map_err(Error::io(target, "create"))?.into_parts();
        Ok(Self {
            file: BufWriter::with_capacity(1 << 16, file),
            temporary,
            target: target.to_path_buf(),
        })
    }

    /// The final name.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Writes everything to disk and gives the file its name.
    ///
    /// # Errors
    /// The disk is full, the file cannot be synced or renamed.
    pub fn finish(self) -> Result<()> {
        let target = self.target;
        let file = (self.file.into_inner()).map_err(|e| Error::io(&target, "write")(e.into_error()))?;
        file.sync_all().map_err(Error::io(&target, "sync"))?;
        (self.temporary.persist(&target)).map_err(|e| Error::io(&target, "rename to")(e.error))?;
        sync_folder(parent_folder(&target)).map_err(Error::io(&target, "sync the folder of"))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file.seek(position)
    }
}

/// Writes a whole file, atomically.
///
/// # Errors
/// As [`AtomicFile`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    file.finish()
}

/// The operating system's own words: the crate for temporary files adds ` at path "..."`, a name that
/// means nothing to the user and is gone by the time that it is read.
pub(crate) fn without_path(error: io::Error) -> io::Error {
    let told = error.to_string();
    match told.split_once(" at path ") {
        Some((words, _)) => io::Error::new(error.kind(), words),
        None => error,
    }
}

/// Removes temporary files that killed processes have left in `folder`, of those targets whose name
/// `is_ours`. Nobody else may be writing these files. Leftovers that cannot be removed stay: they are only
/// in the way.
pub fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_str().and_then(target_name).is_some_and(&is_ours) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The final name of a temporary file.
fn target_name(temporary: &str) -> Option<&str> {
    let named = temporary.strip_prefix('.')?.strip_suffix(SUFFIX)?;
    let (name, random) = named.rsplit_once('.')?;
    let is_random = random.len() == RANDOM_CHARACTERS && random.chars().all(|c| c.is_ascii_alphanumeric());
    (is_random && !name.is_empty()).then_some(name)
}

/// The folder of a path; the current one for a bare name.
pub(crate) fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A rename survives a power cut only once its folder is synced; Windows has no such call.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) {
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_dropped_file_leaves_the_previous_one_and_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"first").unwrap();
        let mut second = AtomicFile::create(&path).unwrap();
        second.write_all(b"half of the sec").unwrap();
        drop(second);
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn leftovers_of_killed_processes_go_by_the_name_of_their_target() {
        let folder = tempfile::tempdir().unwrap();
        let mut killed = AtomicFile::create(&folder.path().join("a.tar.gz")).unwrap();
        killed.write_all(b"half").unwrap();
        std::mem::forget(killed);
        let mine = [
            ".a.tmp",
            ".a.tar.gz.tmp",
            "a.tar.gz",
            ".a.tar.gz.123456",
            ".123456.tmp",
        ];
        for name in mine {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        remove_leftovers(folder.path(), |name| name == "a.tar");
        assert_eq!(names(folder.path()).len(), mine.len() + 1);
        remove_leftovers(folder.path(), |_| true);
        assert_eq!(names(folder.path()).len(), mine.len());
    }

    #[test]
    fn folders_are_made_and_files_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/a.txt");
        write(&path, b"first").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::Builder::new().prefix("errors").tempdir().unwrap();
        let blocked = folder.path().join("file");
        write(&blocked, b"").unwrap();
        let message = write(&blocked.join("below.txt"), b"").unwrap_err().to_string();
        assert!(message.contains("file"), "{message}");
        let long = folder.path().join("n".repeat(250));
        let message = write(&long, b"").unwrap_err().to_string();
        assert!(!message.contains(".tmp"), "{message}");
    }
}
