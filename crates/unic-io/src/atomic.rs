//! Atomic writes: files that appear complete or not at all.

use crate::error::{Error, Result};
use std::{
    collections::BTreeSet,
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};
use tempfile::{TempDir, TempPath};

/// Temporary files and folders of this process, for [`remove_temporary`].
static TEMPORARY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// End of the name of a temporary file, which is `.NAME.RANDOM.tmp`.
const SUFFIX: &str = ".tmp";
/// Number of random characters in the name of a temporary file.
const RANDOM_CHARACTERS: usize = 6;
/// Bytes collected before they are written. Writers of arrays push a frame or a line at a time.
const BUFFER_BYTES: usize = 1 << 16;

/// A file that is written under a temporary name in its own folder.
///
/// [`AtomicFile::finish`] syncs the file and renames it to its final name, replacing a file of that
/// name. Dropping it before that removes it. A reader never sees half a file, and an interrupted
/// program never destroys the previous one.
#[derive(Debug)]
pub struct AtomicFile {
    file: BufWriter<File>,
    temporary: TempPath,
    target: PathBuf,
    _cleanup: CleanupGuard,
}

/// A temporary folder. Dropping it removes it with its content.
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: TempDir,
    _cleanup: CleanupGuard,
}

impl TemporaryFolder {
    /// Creates a folder in `parent`, which must exist. The name begins with a dot and ends in
    /// `.tmp`.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub fn create_in(parent: &Path) -> io::Result<Self> {
        Self::create_for(parent, "frames")
    }

    /// Creates a folder in `parent` whose name `.PURPOSE.RANDOM.tmp` tells what it is for.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub(crate) fn create_for(parent: &Path, purpose: &str) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{purpose}.");
        (builder.prefix(&prefix).suffix(SUFFIX)).rand_bytes(RANDOM_CHARACTERS);
        // Temporary folders are private by default; this one may become an ordinary folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent).map_err(without_path)?;
        let _cleanup = CleanupGuard::new(folder.path());
        Ok(Self { folder, _cleanup })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Makes the folder an ordinary one, which nothing removes.
    pub(crate) fn keep(self) -> PathBuf {
        self.folder.keep()
    }

    /// Renames the folder to `target`, after which it is no longer temporary.
    ///
    /// # Errors
    /// The folder cannot be renamed; it is removed then.
    pub fn persist(self, target: &Path) -> io::Result<()> {
        std::fs::rename(self.folder.path(), target)?;
        // Kept only once renamed: a failed rename must still be cleaned up.
        let _ = self.folder.keep();
        sync_folder(parent_folder(target))
    }
}

/// Registration of a path with [`remove_temporary`]; dropping it ends the registration.
#[derive(Debug)]
pub struct CleanupGuard(PathBuf);

impl CleanupGuard {
    /// Registers a file, or a folder with its content.
    pub fn new(path: &Path) -> Self {
        registered().insert(path.to_path_buf());
        Self(path.to_path_buf())
    }
}

impl Drop for CleanupGuard {
    fn drop(&mut self) {
        registered().remove(&self.0);
    }
}

fn registered() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // A panic elsewhere must not keep temporary files from being removed.
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files and folders of this process, before an exit that runs no
/// destructors.
///
/// Files that are being written are lost; finished files stay.
pub fn remove_temporary() {
    for path in std::mem::take(&mut *registered()) {
        // Failures are ignored: a leftover wastes space and does no other harm.
        let _ = match path.is_dir() {
            true => std::fs::remove_dir_all(&path),
            false => std::fs::remove_file(&path),
        };
    }
}

impl AtomicFile {
    /// Starts a file whose final name is `target`. Missing folders are created.
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
            file: BufWriter::with_capacity(BUFFER_BYTES, file),
            _cleanup: CleanupGuard::new(&temporary),
            temporary,
            target: target.to_path_buf(),
        })
    }

    /// Final path of the file.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Writes everything to disk and gives the file its final name.
    ///
    /// # Errors
    /// The disk is full, or the file cannot be synced or renamed.
    pub fn finish(self) -> Result<()> {
        let target = self.target;
        let file = (self.file.into_inner()).map_err(|e| Error::io(&target, "write")(e.into_error()))?;
        // Synced before the rename: after a power cut the new name must not stand for an empty
        // file.
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

/// Writes `bytes` as a file, atomically.
///
/// # Errors
/// Those of [`AtomicFile::create`] and [`AtomicFile::finish`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    file.finish()
}

/// Removes the temporary path from an error message of the crate `tempfile`.
///
/// That crate appends ` at path "..."`, a name that means nothing to a user and no longer exists
/// when the message is read.
pub(crate) fn without_path(error: io::Error) -> io::Error {
    let message = error.to_string();
    match message.split_once(" at path ") {
        Some((reason, _)) => io::Error::new(error.kind(), reason),
        None => error,
    }
}

/// Removes temporary files that killed processes have left in `folder`.
///
/// `is_ours` receives the final name of each. No other process may be writing these files.
/// Leftovers that cannot be removed stay.
pub fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_str().and_then(target_name).is_some_and(&is_ours) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Returns the temporary folders in `parent` for a purpose; see [`TemporaryFolder::create_for`].
pub(crate) fn leftover_folders(parent: &Path, purpose: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(parent).into_iter().flatten().flatten();
    let is_ours = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        name.and_then(target_name) == Some(purpose) && path.is_dir()
    };
    entries.map(|entry| entry.path()).filter(is_ours).collect()
}

/// Returns the final name of a temporary file; `None` for other files.
fn target_name(temporary: &str) -> Option<&str> {
    let named = temporary.strip_prefix('.')?.strip_suffix(SUFFIX)?;
    let (name, random) = named.rsplit_once('.')?;
    let is_random = random.len() == RANDOM_CHARACTERS && random.chars().all(|c| c.is_ascii_alphanumeric());
    (is_random && !name.is_empty()).then_some(name)
}

/// Returns the folder of a path; the current folder for a bare name.
pub(crate) fn parent_folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Syncs a folder, so that a rename in it survives a power cut. Windows has no such call.
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
    fn dropped_file_leaves_the_previous_one_and_no_temporary() {
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
    fn leftovers_are_removed_by_their_final_name() {
        let folder = tempfile::tempdir().unwrap();
        let mut killed = AtomicFile::create(&folder.path().join("a.tar.gz")).unwrap();
        killed.write_all(b"half").unwrap();
        std::mem::forget(killed);
        let unrelated = [
            ".a.tmp",
            ".a.tar.gz.tmp",
            "a.tar.gz",
            ".a.tar.gz.123456",
            ".123456.tmp",
        ];
        for name in unrelated {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        remove_leftovers(folder.path(), |name| name == "a.tar");
        assert_eq!(names(folder.path()).len(), unrelated.len() + 1);
        remove_leftovers(folder.path(), |_| true);
        assert_eq!(names(folder.path()).len(), unrelated.len());
    }

    #[test]
    fn folders_are_created_and_files_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/a.txt");
        write(&path, b"first").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
    }

    #[test]
    fn errors_name_the_final_file() {
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
