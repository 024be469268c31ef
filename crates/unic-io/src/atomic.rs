//! Files that appear whole or not at all.

use crate::error::{Error, Result};
use std::{
    collections::BTreeSet,
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};
use tempfile::{TempDir, TempPath};

/// Temporary files and folders of this process.
static TEMPORARY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

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
    _listed: Listed,
}

/// A folder for temporary files, inside another; it goes with all that it holds when this is dropped.
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: TempDir,
    _listed: Listed,
}

impl TemporaryFolder {
    /// Makes one in `parent`, which must be there. Its name begins with a dot and ends in `.tmp`.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn create_in(parent: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".frames.").suffix(SUFFIX);
        // Temporary folders are private by default; this one may become an ordinary folder.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent).map_err(without_path)?;
        let _listed = Listed::new(folder.path());
        Ok(Self { folder, _listed })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder its final name.
    ///
    /// # Errors
    /// It cannot be renamed; it is removed then.
    pub fn persist(self, target: &Path) -> io::Result<()> {
        std::fs::rename(self.folder.path(), target)?;
        // Kept only once renamed: a failed rename must still be cleaned up.
        let _ = self.folder.keep();
        sync_folder(parent_folder(target))
    }
}

/// A path that [`remove_temporary`] removes, as long as this lives.
#[derive(Debug)]
pub struct Listed(PathBuf);

impl Listed {
    /// Lists a file, or a folder with all that it holds.
    pub fn new(path: &Path) -> Self {
        temporary().insert(path.to_path_buf());
        Self(path.to_path_buf())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        temporary().remove(&self.0);
    }
}

fn temporary() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files and folders of this process, for a program that is about to end without dropping
/// what it holds. Whatever is being written is lost; files that have their names already stay.
pub fn remove_temporary() {
    for path in std::mem::take(&mut *temporary()) {
        // What cannot be removed is only in the way.
        let _ = match path.is_dir() {
            true => std::fs::remove_dir_all(&path),
            false => std::fs::remove_file(&path),
        };
    }
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
            _listed: Listed::new(&temporary),
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
