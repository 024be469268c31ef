//! Folder of a training run, beside its model: `tshirt.run` for `tshirt.unic`.
//!
//! | file | content |
//! |---|---|
//! | `run.toml` | capture, clips and preset, which a resumed run compares with its own |
//! | `config.toml` | all settings; marks a run that can be resumed |
//! | `metrics.jsonl` | training curves, one JSON object per line |
//! | `checkpoints/` | the two newest checkpoints of each fit, of the prior and of the sizing, in a folder each |
//! | `log.txt` | times, machines and command lines |
//! | `.unic.lock` | exists while a process trains into the folder |

mod metrics;
mod record;

pub(crate) use metrics::{MetricsLog, RunPosition};
pub(crate) use record::RunRecord;

use crate::{failure::Usage, folder_lock::FolderLock};
use anyhow::{Result, anyhow, bail};
use std::{
    fs::{self, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
    time::SystemTime,
};
use unic_io::atomic::{self, AtomicFile};
use unic_train::{Fit, TrainConfig};

/// Treatment of a run that exists already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EarlierRun {
    /// An existing run is an error.
    Refuse,
    /// An existing run is discarded when the new one begins.
    Overwrite,
    /// An existing run is continued; none is an error.
    Resume,
}

/// Folder of a run, locked against other processes.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    _lock: FolderLock,
}

impl RunFolder {
    /// Locks the folder beside the model `out`, and removes temporary files of killed processes.
    ///
    /// # Errors
    /// An existing run or model that `earlier` refuses, a folder that is locked, a folder or model
    /// that cannot be written.
    pub(crate) fn open(out: &Path, earlier: EarlierRun) -> Result<Self> {
        let path = path_beside(out)?;
        if !path.exists() {
            // Checked before the lock, which creates the folder: a refused run leaves nothing
            // behind.
            check_earlier(out, &path, earlier)?;
        }
        // Both places are tried now, so that no training is lost at its end.
        drop(AtomicFile::create(out)?);
        let lock = FolderLock::acquire(&path)?;
        // Checked again under the lock: another process may have finished in between.
        check_earlier(out, &path, earlier)?;
        drop(AtomicFile::create(&path.join("checkpoints").join("writable"))?);
        let folder = Self { path, _lock: lock };
        folder.remove_leftovers(out);
        Ok(folder)
    }

    /// Path of the folder.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Path of the settings.
    pub(crate) fn config(&self) -> PathBuf {
        self.path.join("config.toml")
    }

    /// Folder of the checkpoints of a fit.
    pub(crate) fn checkpoints(&self, fit: Fit) -> PathBuf {
        self.path.join("checkpoints").join(fit.name())
    }

    /// Folder with the checkpoints of the prior's recurrences, one folder each.
    pub(crate) fn checkpoints_of_prior(&self) -> PathBuf {
        self.path.join("checkpoints").join("prior")
    }

    /// Folder with the results of a sizing and the checkpoints of its trials, one folder each.
    pub(crate) fn checkpoints_of_sizing(&self) -> PathBuf {
        self.path.join("checkpoints").join("sizing")
    }

    /// Path of the training curves.
    pub(crate) fn metrics(&self) -> PathBuf {
        self.path.join("metrics.jsonl")
    }

    /// Reads the settings of the run in the folder.
    ///
    /// # Errors
    /// A file that cannot be read or has unknown settings.
    pub(crate) fn stored_config(&self) -> Result<TrainConfig> {
        let path = self.config();
        let text = fs::read_to_string(&path).map_err(|e| anyhow!("{}: cannot read: {e}", path.display()))?;
        TrainConfig::from_toml(&text).map_err(|e| anyhow!("{}: {e}", path.display()))
    }

    /// Reads the record of the run in the folder.
    ///
    /// # Errors
    /// A file that cannot be read or is no record.
    pub(crate) fn stored_record(&self) -> Result<RunRecord> {
        RunRecord::read(&self.path.join("run.toml"))
    }

    /// Begins a new run, which can then be resumed. Removes all files of another run.
    ///
    /// # Errors
    /// Files that cannot be removed or written.
    pub(crate) fn begin(&self, config: &TrainConfig, record: &RunRecord) -> Result<()> {
        self.clear()?;
        record.write(&self.path.join("run.toml"))?;
        // Last, for it marks a run that can be resumed, which needs its record.
        self.write_config(config)
    }

    /// Writes the settings of the run, those that it began with or longer ones.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn write_config(&self, config: &TrainConfig) -> Result<()> {
        Ok(atomic::write(&self.config(), config.to_toml().as_bytes())?)
    }

    /// Replaces the record.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn write_record(&self, record: &RunRecord) -> Result<()> {
        record.write(&self.path.join("run.toml"))
    }

    /// Adds a line with the present time to the log.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn log(&self, line: &str) -> Result<()> {
        let path = self.path.join("log.txt");
        let now = humantime::format_rfc3339_seconds(SystemTime::now());
        let file = OpenOptions::new().create(true).append(true).open(&path);
        // One call writes the whole line, so that a crash leaves no half line.
        file.and_then(|mut file| file.write_all(format!("{now} {line}\n").as_bytes()))
            .map_err(|e| anyhow!("{}: cannot write: {e}", path.display()))
    }

    /// Removes temporary files of killed processes, in the folder and beside the model.
    fn remove_leftovers(&self, out: &Path) {
        let own = [self.path.clone(), self.path.join("checkpoints")];
        for folder in own.into_iter().chain(self.folders_of_checkpoints()) {
            atomic::remove_leftovers(&folder, |_| true);
        }
        // A bare file name has an empty parent, which stands for the working folder.
        let beside = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(model) = out.file_name() {
            atomic::remove_leftovers(beside.unwrap_or(Path::new(".")), |name| {
                name == model.to_string_lossy()
            });
        }
    }

    /// Folders with checkpoints: of each fit, and of each recurrence of the prior.
    fn folders_of_checkpoints(&self) -> Vec<PathBuf> {
        let fits = [Fit::HeldOut, Fit::AllClips].map(|fit| self.checkpoints(fit));
        let sizing = self.checkpoints_of_sizing();
        let trials = folders_in(&sizing);
        let others = [vec![sizing], trials, self.folders_of_prior()].concat();
        fits.into_iter().chain(others).filter(|f| f.is_dir()).collect()
    }

    fn folders_of_prior(&self) -> Vec<PathBuf> {
        folders_in(&self.checkpoints_of_prior())
    }

    /// Removes the checkpoints of the prior's recurrences.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub(crate) fn clear_prior(&self) -> Result<()> {
        files_in(self.folders_of_prior()).try_for_each(|file| remove(&file))
    }

    /// Removes the files of a run. Other files in the folder stay.
    fn clear(&self) -> Result<()> {
        let checkpoints = files_in(self.folders_of_checkpoints());
        let files = ["config.toml", "run.toml", "metrics.jsonl", "log.txt"].map(|name| self.path.join(name));
        let mut files = files.into_iter().chain(checkpoints).filter(|file| file.exists());
        files.try_for_each(|file| remove(&file))
    }
}

fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let entries = entries.flatten().map(|entry| entry.path());
    entries.filter(|path| path.is_dir()).collect()
}

fn files_in(folders: Vec<PathBuf>) -> impl Iterator<Item = PathBuf> {
    let entries = folders.into_iter().flat_map(fs::read_dir).flatten();
    entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
}

fn remove(file: &Path) -> Result<()> {
    fs::remove_file(file).map_err(|e| anyhow!("{}: cannot remove: {e}", file.display()))
}

impl Drop for RunFolder {
    /// Removes the folder of checkpoints of a run that has not begun. The lock removes the run
    /// folder.
    fn drop(&mut self) {
        // `remove_dir` fails, as it should, if the folder is not empty.
        if !self.config().exists() {
            let _ = fs::remove_dir(self.path.join("checkpoints"));
        }
    }
}

/// Path of the run folder beside a model.
///
/// # Errors
/// A path that is no name of a model file.
fn path_beside(out: &Path) -> Result<PathBuf> {
    let path = out.with_extension("run");
    if out.is_dir() || out.file_name().is_none() || path == out {
        bail!(
            "{}: expected the name of a model file such as NAME.unic, found a folder's",
            out.display()
        );
    }
    Ok(path)
}

/// Checks an existing run and model against the treatment that the options ask for.
///
/// # Errors
/// An existing run or model with [`EarlierRun::Refuse`], no run with [`EarlierRun::Resume`].
fn check_earlier(out: &Path, path: &Path, earlier: EarlierRun) -> Result<()> {
    let has_run = path.join("config.toml").exists();
    let shown = path.display();
    match earlier {
        EarlierRun::Refuse if has_run => Err(Usage(format!(
            "{shown}: expected no earlier run, found one; --resume continues it, --overwrite discards it"
        ))
        .into()),
        EarlierRun::Refuse if out.exists() => {
            let out = out.display();
            Err(Usage(format!(
                "{out}: expected no model, found one; --overwrite replaces it"
            ))
            .into())
        }
        EarlierRun::Resume if !has_run => bail!("{shown}: expected a run to resume, found none"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_train::Preset;

    fn begin_run(out: &Path) -> RunFolder {
        let folder = RunFolder::open(out, EarlierRun::Overwrite).unwrap();
        folder
            .begin(&TrainConfig::preset(Preset::Tiny), &RunRecord::default())
            .unwrap();
        folder
    }

    #[test]
    fn one_process_at_a_time() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        let folder = begin_run(&out);
        let error = RunFolder::open(&out, EarlierRun::Resume).unwrap_err().to_string();
        assert!(error.contains("another unic"), "{error}");
        drop(folder);
        assert!(RunFolder::open(&out, EarlierRun::Resume).is_ok());
    }

    #[test]
    fn an_earlier_run_is_discarded_only_when_a_new_one_begins() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        assert!(RunFolder::open(&out, EarlierRun::Resume).is_err());
        drop(begin_run(&out));
        fs::write(out.with_extension("run").join("metrics.jsonl"), "{}\n").unwrap();
        assert!(RunFolder::open(&out, EarlierRun::Refuse).is_err());
        // Opening to overwrite removes nothing: the new run may fail before it begins.
        drop(RunFolder::open(&out, EarlierRun::Overwrite).unwrap());
        assert!(out.with_extension("run").join("metrics.jsonl").exists());
        drop(begin_run(&out));
        assert!(!out.with_extension("run").join("metrics.jsonl").exists());
    }

    #[test]
    fn files_of_a_killed_process_are_not_taken_for_those_of_a_new_run() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        let folder = begin_run(&out);
        let checkpoint = folder.checkpoints(Fit::HeldOut).join("step-00000001.safetensors");
        let half = ["a.run/.run.toml.AbC123.tmp", ".a.unic.AbC123.tmp"].map(|name| parent.path().join(name));
        let foreign = parent.path().join(".b.unic.AbC123.tmp");
        fs::create_dir_all(checkpoint.parent().unwrap()).unwrap();
        for file in half.iter().chain([&checkpoint, &foreign]) {
            fs::write(file, "x").unwrap();
        }
        fs::remove_file(folder.config()).unwrap();
        drop(folder);
        let folder = RunFolder::open(&out, EarlierRun::Refuse).unwrap();
        assert!(half.iter().all(|file| !file.exists()) && foreign.exists());
        folder
            .begin(&TrainConfig::preset(Preset::Tiny), &RunRecord::default())
            .unwrap();
        assert!(!checkpoint.exists());
    }

    #[test]
    fn a_run_that_has_not_begun_leaves_no_files() {
        let parent = tempfile::tempdir().unwrap();
        drop(RunFolder::open(&parent.path().join("a.unic"), EarlierRun::Refuse).unwrap());
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
    }
}
