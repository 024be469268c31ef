//! Lock of a folder, so that one process at a time writes into it.

use anyhow::{Result, anyhow, bail};
use std::{
    fs::{self, File, OpenOptions, TryLockError},
    path::{Path, PathBuf},
};
use unic_io::atomic::CleanupGuard;

const NAME: &str = ".unic.lock";

/// Exclusive lock of a folder for writers, from [`FolderLock::acquire`] until it is dropped.
///
/// The operating system locks an empty file `.unic.lock` in the folder. It releases the lock when
/// the process ends in any way. Readers do not take the lock.
#[derive(Debug)]
pub struct FolderLock {
    file: PathBuf,
    /// Did the folder exist before? If not, it is removed with the lock while it is empty.
    existed: bool,
    _held: File,
    _cleanup: CleanupGuard,
}

impl FolderLock {
    /// Locks a folder, and creates it if it does not exist.
    ///
    /// # Errors
    /// A folder that another process has locked or that cannot be written.
    // Not a `Usage`: the command is correct and can be repeated later.
    pub fn acquire(folder: &Path) -> Result<Self> {
        let existed = folder.is_dir();
        fs::create_dir_all(folder)
            .map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
        let file = folder.join(NAME);
        loop {
            let held = OpenOptions::new().create(true).append(true).open(&file);
            let held = held.map_err(|e| anyhow!("{}: cannot create: {e}", file.display()))?;
            match held.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    bail!("{}: another unic is writing to this folder", folder.display())
                }
                // The holder has removed the file between opening and locking. A lock on a removed
                // file excludes nobody: try again with the file that has the name now.
                Ok(()) if !is_named(&held, &file) => {}
                // Some network file systems have no locks. The program works there without one.
                Ok(()) | Err(TryLockError::Error(_)) => {
                    return Ok(Self {
                        _cleanup: CleanupGuard::new(&file),
                        file,
                        existed,
                        _held: held,
                    });
                }
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // A lock file that cannot be removed does no harm. One that has content is the user's file.
        let is_ours = fs::metadata(&self.file).is_ok_and(|m| m.is_file() && m.len() == 0);
        if is_ours {
            let _ = fs::remove_file(&self.file);
        }
        if let Some(folder) = self.file.parent().filter(|_| !self.existed) {
            // Fails, as it should, if the folder is not empty.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Is `path` the name of the open file?
#[cfg(unix)]
fn is_named(open: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: fs::Metadata| (m.dev(), m.ino());
    match (open.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(named)) => identity(open) == identity(named),
        _ => false,
    }
}

/// Is `path` the name of the open file? Always true, because an open file keeps its name here.
#[cfg(not(unix))]
fn is_named(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_at_a_time() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("a/b");
        let lock = FolderLock::acquire(&folder).unwrap();
        let error = FolderLock::acquire(&folder).unwrap_err().to_string();
        assert!(error.contains("a/b") && error.contains("another unic"), "{error}");
        drop(lock);
        assert!(
            !folder.exists(),
            "the lock removes an empty folder that it has created"
        );
        fs::create_dir(&folder).unwrap();
        drop(FolderLock::acquire(&folder).unwrap());
        assert!(folder.exists() && !folder.join(NAME).exists());
    }

    #[test]
    fn locks_of_many_threads_never_overlap() {
        use std::sync::atomic::{AtomicU32, Ordering::SeqCst};
        let folder = tempfile::tempdir().unwrap();
        let (inside, held) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        let Ok(_lock) = FolderLock::acquire(folder.path()) else {
                            continue;
                        };
                        assert_eq!(inside.fetch_add(1, SeqCst), 0);
                        held.fetch_add(1, SeqCst);
                        inside.fetch_sub(1, SeqCst);
                    }
                });
            }
        });
        assert!(held.into_inner() > 4);
    }
}
