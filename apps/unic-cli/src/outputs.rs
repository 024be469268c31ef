//! The one rule about what commands write: nothing is lost that the user has not named for it.

use crate::failure::Usage;
use anyhow::Result;
use std::path::{Path, PathBuf};
use unic_io::capture::{capture_written_by, real_path};

/// Treatment of files that are there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Existing {
    /// They stay: the command is refused.
    Refused,
    /// `--overwrite`: files are replaced, folders are not.
    Replaced,
    /// The command has a rule of its own about what it goes on with.
    Resumed,
}

impl Existing {
    /// The treatment that `--overwrite` asks for.
    pub(crate) fn of(overwrite: bool) -> Self {
        match overwrite {
            true => Self::Replaced,
            false => Self::Refused,
        }
    }
}

/// Everything that a command is about to write, beside what it reads; checked before any work is done.
///
/// An output is never an input, nor a second output, nor a capture's own file, be it by another path or through a
/// link. What exists is refused unless `--overwrite` is there.
#[derive(Debug, Default)]
pub(crate) struct Outputs {
    inputs: Vec<PathBuf>,
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

impl Outputs {
    /// Outputs of a command that reads these files and folders.
    pub(crate) fn beside<'a>(inputs: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        Self {
            inputs: inputs.into_iter().cloned().collect(),
            ..Self::default()
        }
    }

    /// Adds a file.
    pub(crate) fn file(mut self, path: impl Into<PathBuf>) -> Self {
        self.files.push(path.into());
        self
    }

    /// Adds a folder that may be there already, and its files by name.
    pub(crate) fn folder(mut self, folder: &Path, names: impl IntoIterator<Item = String>) -> Self {
        self.folders.push(folder.to_path_buf());
        self.files.extend(names.into_iter().map(|name| folder.join(name)));
        self
    }

    /// Adds files that are named already.
    pub(crate) fn files(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Self {
        self.files.extend(paths);
        self
    }

    /// Refuses what would be lost.
    ///
    /// # Errors
    /// [`Usage`], which names the output and what it is.
    pub(crate) fn check(&self, existing: Existing) -> Result<()> {
        self.refuse_the_same_twice()?;
        for path in self.files.iter().chain(&self.folders) {
            self.refuse_input(path)?;
            refuse_captures(path)?;
        }
        for folder in &self.folders {
            if folder.exists() && !folder.is_dir() {
                return refused(folder, "expected a folder to write into, found a file");
            }
        }
        self.files
            .iter()
            .try_for_each(|path| refuse_existing(path, existing))
    }

    fn refuse_the_same_twice(&self) -> Result<()> {
        let real: Vec<PathBuf> = self.files.iter().map(|path| real_path(path)).collect();
        match (real.iter().enumerate()).find(|(i, path)| real[..*i].contains(path)) {
            None => Ok(()),
            Some((i, _)) => refused(&self.files[i], "expected one output of this name, found two"),
        }
    }

    fn refuse_input(&self, path: &Path) -> Result<()> {
        match self.inputs.iter().find(|input| is_same_file(input, path)) {
            None => Ok(()),
            Some(input) => {
                let found = format!(
                    "expected an output that is no input, found the input {}",
                    input.display()
                );
                refused(path, &found)
            }
        }
    }
}

fn refused(path: &Path, found: &str) -> Result<()> {
    Err(Usage(format!("{}: {found}", path.display())).into())
}

fn refuse_captures(path: &Path) -> Result<()> {
    match capture_written_by(path) {
        None => Ok(()),
        Some(capture) => {
            let found = format!(
                "expected an output outside of captures, found a part of the capture {}; choose another name",
                capture.display()
            );
            refused(path, &found)
        }
    }
}

fn refuse_existing(path: &Path, existing: Existing) -> Result<()> {
    // A link that leads nowhere is there too.
    let Ok(there) = path.metadata().or_else(|_| path.symlink_metadata()) else {
        return Ok(());
    };
    if path.is_dir() {
        return refused(path, "expected the name of a file to write, found a folder");
    }
    if !there.is_file() && !there.is_symlink() {
        return refused(
            path,
            "expected the name of a file to write, found a device or a pipe",
        );
    }
    match existing {
        Existing::Refused => refused(
            path,
            "expected no such file yet, found one; --overwrite replaces it",
        ),
        Existing::Replaced | Existing::Resumed => Ok(()),
    }
}

/// One file or folder by two names, by links of both kinds too.
fn is_same_file(a: &Path, b: &Path) -> bool {
    real_path(a) == real_path(b) || is_same_inode(a, b)
}

#[cfg(unix)]
fn is_same_inode(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (a.metadata(), b.metadata()) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

/// Elsewhere the standard library does not tell hard links.
#[cfg(not(unix))]
fn is_same_inode(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn told(outputs: &Outputs, existing: Existing) -> String {
        outputs
            .check(existing)
            .map_or_else(|e| e.to_string(), |()| String::new())
    }

    #[test]
    fn what_is_there_stays_unless_it_may_be_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        let outputs = Outputs::default().file(&path);
        assert_eq!(told(&outputs, Existing::Refused), "");
        fs::write(&path, "").unwrap();
        assert!(told(&outputs, Existing::Refused).contains("--overwrite"));
        assert_eq!(told(&outputs, Existing::Replaced), "");
        let folders = Outputs::default().file(folder.path());
        assert!(told(&folders, Existing::Replaced).contains("found a folder"));
    }

    #[test]
    fn an_input_is_no_output_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("walk.npz");
        fs::write(&input, "").unwrap();
        let mut names = vec![input.clone(), folder.path().join("x/../walk.npz")];
        #[cfg(unix)]
        {
            let [soft, hard] = ["soft.npz", "hard.npz"].map(|name| folder.path().join(name));
            std::os::unix::fs::symlink(&input, &soft).unwrap();
            fs::hard_link(&input, &hard).unwrap();
            names.extend([soft, hard]);
        }
        for name in names {
            let outputs = Outputs::beside([&input]).file(&name);
            let told = told(&outputs, Existing::Replaced);
            assert!(told.contains("found the input"), "{}: {told}", name.display());
        }
    }

    #[test]
    fn captures_and_devices_are_never_written_over() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("clips")).unwrap();
        fs::write(folder.path().join("capture.toml"), "").unwrap();
        for name in ["clips/new.npz", "garment.npz"] {
            let outputs = Outputs::default().file(folder.path().join(name));
            assert!(
                told(&outputs, Existing::Replaced).contains("a part of the capture"),
                "{name}"
            );
        }
        for name in ["", "clips", "clips/new"] {
            let outputs = Outputs::default().folder(&folder.path().join(name), ["a.png".to_owned()]);
            assert!(
                told(&outputs, Existing::Replaced).contains("a part of the capture"),
                "{name}"
            );
        }
        let beside = Outputs::default().folder(&folder.path().join("pictures"), ["a.png".to_owned()]);
        assert_eq!(told(&beside, Existing::Refused), "");
        if cfg!(unix) {
            let device = Outputs::default().file("/dev/null");
            assert!(told(&device, Existing::Replaced).contains("a device"));
        }
    }

    #[test]
    fn two_outputs_have_two_names() {
        let folder = tempfile::tempdir().unwrap();
        let outputs = Outputs::default().files(["a.gif", "x/../a.gif"].map(|name| folder.path().join(name)));
        assert!(told(&outputs, Existing::Refused).contains("found two"));
    }
}
