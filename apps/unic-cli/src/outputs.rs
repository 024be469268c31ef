//! Check of the outputs of a command, so that no file is lost that the user has not named.
//!
//! Every command builds its [`Outputs`] and checks them before it begins to work.

use crate::failure::Usage;
use anyhow::Result;
use std::path::{Path, PathBuf};
use unic_io::capture::{capture_written_by, real_path};

/// Treatment of output files that exist already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Existing files are an error.
    Refused,
    /// Existing files are replaced, as with `--overwrite`. Folders never are.
    Replaced,
    /// Existing files are no error here: the command checks them by a rule of its own.
    Resumed,
}

impl Existing {
    /// Returns the treatment for the value of `--overwrite`.
    pub fn of(overwrite: bool) -> Self {
        match overwrite {
            true => Self::Replaced,
            false => Self::Refused,
        }
    }
}

/// Inputs and outputs of a command.
///
/// An output must not be an input, another output or a file of a capture, not even by another path
/// or through a link. Existing files are refused unless `--overwrite` is given.
#[derive(Debug, Default)]
pub struct Outputs {
    inputs: Vec<PathBuf>,
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

impl Outputs {
    /// Creates the outputs of a command that reads `inputs`, files and folders.
    pub fn with_inputs<'a>(inputs: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        Self {
            inputs: inputs.into_iter().cloned().collect(),
            ..Self::default()
        }
    }

    /// Adds a file to write.
    pub fn file(mut self, path: impl Into<PathBuf>) -> Self {
        self.files.push(path.into());
        self
    }

    /// Adds a folder, which may exist, with the names of the files to write in it.
    pub fn folder(mut self, folder: &Path, names: impl IntoIterator<Item = String>) -> Self {
        self.folders.push(folder.to_path_buf());
        self.files.extend(names.into_iter().map(|name| folder.join(name)));
        self
    }

    /// Adds files to write.
    pub fn files(mut self, paths: impl IntoIterator<Item = PathBuf>) -> Self {
        self.files.extend(paths);
        self
    }

    /// Checks all outputs.
    ///
    /// # Errors
    /// A [`Usage`] that names the first output that is refused and the reason.
    pub fn check(&self, existing: Existing) -> Result<()> {
        self.refuse_duplicates()?;
        for path in self.files.iter().chain(&self.folders) {
            // Inputs and captures are refused even with `--overwrite`, which is meant for results.
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

    fn refuse_duplicates(&self) -> Result<()> {
        // Links are resolved, so that two names of one file are found.
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
    // A link whose target does not exist is an existing file too.
    let Ok(there) = path.metadata().or_else(|_| path.symlink_metadata()) else {
        return Ok(());
    };
    if path.is_dir() {
        return refused(path, "expected the name of a file to write, found a folder");
    }
    // Writers rename a temporary file to the path, which would replace a device by a plain file.
    if !there.is_file() && !there.is_symlink() {
        return refused(
            path,
            "expected the name of a file to write, found a device or a pipe",
        );
    }
    match existing {
        Existing::Refused => refused(path, "expected no file, found one; --overwrite replaces it"),
        Existing::Replaced | Existing::Resumed => Ok(()),
    }
}

/// Are two paths the same file or folder, also by symbolic or hard links?
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

/// Are two paths hard links of one file? Always false, because the standard library cannot tell
/// here.
#[cfg(not(unix))]
fn is_same_inode(_: &Path, _: &Path) -> bool {
    false
}

/// Refuses the output folder of a capture inside another capture. The folder itself may be one.
///
/// # Errors
/// A [`Usage`] that names the folder.
pub(crate) fn refuse_other_captures(out: &Path) -> Result<()> {
    let clips = out.join("clips");
    // A linked folder of clips may belong to another capture, whose files would be overwritten.
    if real_path(&clips) != real_path(out).join("clips") {
        let text = format!(
            "--out: expected a folder of clips of its own, found the link {}",
            clips.display()
        );
        return Err(Usage(text).into());
    }
    match capture_written_by(out).filter(|capture| *capture != real_path(out)) {
        None => Ok(()),
        Some(capture) => {
            let text = format!(
                "--out: expected a folder of its own, found {}, which is a part of the capture {}",
                out.display(),
                capture.display()
            );
            Err(Usage(text).into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Error message of a check, empty if there is none.
    fn message(outputs: &Outputs, existing: Existing) -> String {
        outputs
            .check(existing)
            .map_or_else(|e| e.to_string(), |()| String::new())
    }

    #[test]
    fn existing_files_are_refused_unless_they_may_be_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pc2");
        let outputs = Outputs::default().file(&path);
        assert_eq!(message(&outputs, Existing::Refused), "");
        fs::write(&path, "").unwrap();
        assert!(message(&outputs, Existing::Refused).contains("--overwrite"));
        assert_eq!(message(&outputs, Existing::Replaced), "");
        let folders = Outputs::default().file(folder.path());
        assert!(message(&folders, Existing::Replaced).contains("found a folder"));
    }

    #[test]
    fn an_input_is_refused_as_an_output_under_any_name() {
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
            let outputs = Outputs::with_inputs([&input]).file(&name);
            let message = message(&outputs, Existing::Replaced);
            assert!(
                message.contains("found the input"),
                "{}: {message}",
                name.display()
            );
        }
    }

    #[test]
    fn files_of_captures_and_devices_are_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("clips")).unwrap();
        fs::write(folder.path().join("capture.toml"), "").unwrap();
        for name in ["clips/new.npz", "garment.npz"] {
            let outputs = Outputs::default().file(folder.path().join(name));
            assert!(
                message(&outputs, Existing::Replaced).contains("a part of the capture"),
                "{name}"
            );
        }
        for name in ["", "clips", "clips/new"] {
            let outputs = Outputs::default().folder(&folder.path().join(name), ["a.png".to_owned()]);
            assert!(
                message(&outputs, Existing::Replaced).contains("a part of the capture"),
                "{name}"
            );
        }
        let beside = Outputs::default().folder(&folder.path().join("pictures"), ["a.png".to_owned()]);
        assert_eq!(message(&beside, Existing::Refused), "");
        if cfg!(unix) {
            let device = Outputs::default().file("/dev/null");
            assert!(message(&device, Existing::Replaced).contains("a device"));
        }
    }

    #[test]
    fn two_outputs_of_one_name_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let outputs = Outputs::default().files(["a.gif", "x/../a.gif"].map(|name| folder.path().join(name)));
        assert!(message(&outputs, Existing::Refused).contains("found two"));
    }
}
