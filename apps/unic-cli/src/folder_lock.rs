//! One process at a time writes into a folder.

use anyhow::{Result, anyhow, bail};
use std::{
    fs::{self, File, OpenOptions, TryLockError},
    path::{Path, PathBuf},
};
use unic_io::atomic::Listed;

const NAME: &str = ".unic.lock";

/// A folder that nobody else writes into, from [`FolderLock::hold`] until this is dropped.
///
/// What is locked is an empty file `.unic.lock` in the folder, by the operating system: the lock goes when the
/// process does, however it ends. Readers do not ask for it.
#[derive(Debug)]
pub(crate) struct FolderLock {
    file: PathBuf,
    /// There before: else an empty folder goes with the lock.
    found: bool,
    _held: File,
    _listed: Listed,
}

impl FolderLock {
    /// Locks a folder, which is made where it is missing. A failure when another process has it: exit
    /// code 1, for the command is right and only too early.
    pub(crate) fn hold(folder: &Path) -> Result<Self> {
        let found = folder.is_dir();
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
                // Its holder has removed it in between: the name may be another file's by now.
                Ok(()) if !is_named(&held, &file) => {}
                // A file system without locks: nothing is gained by refusing to work.
                Ok(()) | Err(TryLockError::Error(_)) => {
                    return Ok(Self {
                        _listed: Listed::new(&file),
                        file,
                        found,
                        _held: held,
                    });
                }
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // What cannot be removed is only in the way; a folder that holds anything stays.
        let is_ours = fs::metadata(&self.file).is_ok_and(|m| m.is_file() && m.len() == 0);
        if is_ours {
            let _ = fs::remove_file(&self.file);
        }
        if let Some(folder) = self.file.parent().filter(|_| !self.found) {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Is this open file the one of that name?
#[cfg(unix)]
fn is_named(open: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: fs::Metadata| (m.dev(), m.ino());
    match (open.metadata(), fs::metadata(path)) {
        (Ok(open), Ok(named)) => identity(open) == identity(named),
        _ => false,
    }
}

/// Elsewhere the name of an open file is not given to another.
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
        let lock = FolderLock::hold(&folder).unwrap();
        let error = FolderLock::hold(&folder).unwrap_err().to_string();
        assert!(error.contains("a/b") && error.contains("another unic"), "{error}");
        drop(lock);
        assert!(!folder.exists(), "an empty folder that the lock has made");
        fs::create_dir(&folder).unwrap();
        drop(FolderLock::hold(&folder).unwrap());
        assert!(folder.exists() && !folder.join(NAME).exists());
    }

    #[test]
    fn holders_that_come_and_go_never_overlap() {
        use std::sync::atomic::{AtomicU32, Ordering::SeqCst};
        let folder = tempfile::tempdir().unwrap();
        let (inside, held) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        let Ok(_lock) = FolderLock::hold(folder.path()) else {
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
