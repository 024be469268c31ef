//! The folder of a training run, beside its model: `tshirt.run` for `tshirt.unic`.
//!
//! ```text
//! run.toml        capture, clips and preset: what a resumed run must find again
//! config.toml     all settings; there from the moment that training starts
//! metrics.jsonl   one JSON object a line
//! checkpoints/    the two newest of each fit, in held_out/ and all_clips/
//! log.txt         what ran when, on which machine
//! .unic.lock      there while a process trains into the folder
//! ```

mod metrics;
mod record;

pub(crate) use metrics::{MetricsLog, Moment};
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

/// What becomes of a run that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Earlier {
    /// It stays, and is an error.
    Refuse,
    /// It is thrown away once the new one starts.
    Overwrite,
    /// It goes on.
    Resume,
}

/// A run's folder, locked against other processes.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    _lock: FolderLock,
}

impl RunFolder {
    /// Locks the folder beside the model `out` and checks that both can be written, so that no
    /// training is lost for want of a place. What a killed process has left half-written goes.
    pub(crate) fn open(out: &Path, earlier: Earlier) -> Result<Self> {
        let path = path_beside(out)?;
        if !path.exists() {
            // Nothing is made for a run that is refused.
            check_earlier(out, &path, earlier)?;
        }
        drop(AtomicFile::create(out)?);
        let lock = FolderLock::hold(&path)?;
        check_earlier(out, &path, earlier)?;
        drop(AtomicFile::create(&path.join("checkpoints").join("writable"))?);
        let folder = Self { path, _lock: lock };
        folder.remove_leftovers(out);
        Ok(folder)
    }

    /// The folder itself.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Settings in TOML.
    pub(crate) fn config(&self) -> PathBuf {
        self.path.join("config.toml")
    }

    /// Where the trainer keeps the checkpoints of a fit.
    pub(crate) fn checkpoints(&self, fit: Fit) -> PathBuf {
        self.path.join("checkpoints").join(fit.name())
    }

    /// Losses and validation errors.
    pub(crate) fn metrics(&self) -> PathBuf {
        self.path.join("metrics.jsonl")
    }

    /// The settings of the run that is there.
    pub(crate) fn stored_config(&self) -> Result<TrainConfig> {
        let path = self.config();
        let text = fs::read_to_string(&path).map_err(|e| anyhow!("{}: cannot read: {e}", path.display()))?;
        TrainConfig::from_toml(&text).map_err(|e| anyhow!("{}: {e}", path.display()))
    }

    /// The record of the run that is there.
    pub(crate) fn stored_record(&self) -> Result<RunRecord> {
        RunRecord::read(&self.path.join("run.toml"))
    }

    /// Begins a new run: from here on there is something to resume. Whatever is there of another one
    /// goes, be it all of it or what a process killed in between has left.
    pub(crate) fn begin(&self, config: &TrainConfig, record: &RunRecord) -> Result<()> {
        self.clear()?;
        record.write(&self.path.join("run.toml"))?;
        self.write_config(config)
    }

    /// Settings of the run from here on: those that it began with, or longer ones.
    pub(crate) fn write_config(&self, config: &TrainConfig) -> Result<()> {
        Ok(atomic::write(&self.config(), config.to_toml().as_bytes())?)
    }

    /// Adds a line to the log.
    pub(crate) fn log(&self, line: &str) -> Result<()> {
        let path = self.path.join("log.txt");
        let now = humantime::format_rfc3339_seconds(SystemTime::now());
        let file = OpenOptions::new().create(true).append(true).open(&path);
        // One call a line, so that no line is half there.
        file.and_then(|mut file| file.write_all(format!("{now} {line}\n").as_bytes()))
            .map_err(|e| anyhow!("{}: cannot write: {e}", path.display()))
    }

    fn remove_leftovers(&self, out: &Path) {
        let checkpoints = [Fit::HeldOut, Fit::AllClips].map(|fit| self.checkpoints(fit));
        let own = [self.path.clone(), self.path.join("checkpoints")];
        for folder in own.iter().chain(&checkpoints) {
            atomic::remove_leftovers(folder, |_| true);
        }
        // A bare name has an empty parent.
        let beside = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(model) = out.file_name() {
            atomic::remove_leftovers(beside.unwrap_or(Path::new(".")), |name| {
                name == model.to_string_lossy()
            });
        }
    }

    fn clear(&self) -> Result<()> {
        let checkpoints = [Fit::HeldOut, Fit::AllClips]
            .into_iter()
            .flat_map(|fit| fs::read_dir(self.checkpoints(fit)))
            .flat_map(|entries| entries.flatten().map(|entry| entry.path()));
        let files = ["config.toml", "run.toml", "metrics.jsonl", "log.txt"].map(|name| self.path.join(name));
        for file in files.into_iter().chain(checkpoints).filter(|file| file.exists()) {
            fs::remove_file(&file).map_err(|e| anyhow!("{}: cannot remove: {e}", file.display()))?;
        }
        Ok(())
    }
}

impl Drop for RunFolder {
    /// A run that never began leaves no folder; `remove_dir` spares those that hold anything.
    fn drop(&mut self) {
        if !self.config().exists() {
            let _ = fs::remove_dir(self.path.join("checkpoints"));
        }
    }
}

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

fn check_earlier(out: &Path, path: &Path, earlier: Earlier) -> Result<()> {
    let has_run = path.join("config.toml").exists();
    let shown = path.display();
    match earlier {
        Earlier::Refuse if has_run => Err(Usage(format!(
            "{shown}: expected no earlier run, found one; --resume goes on with it, --overwrite throws it away"
        ))
        .into()),
        Earlier::Refuse if out.exists() => {
            let out = out.display();
            Err(Usage(format!("{out}: expected no such model yet, found one; --overwrite replaces it")).into())
        }
        Earlier::Resume if !has_run => bail!("{shown}: expected a run to resume, found none"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_train::Preset;

    fn begun(out: &Path) -> RunFolder {
        let folder = RunFolder::open(out, Earlier::Overwrite).unwrap();
        folder
            .begin(&TrainConfig::preset(Preset::Tiny), &RunRecord::default())
            .unwrap();
        folder
    }

    #[test]
    fn one_process_at_a_time() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        let folder = begun(&out);
        let error = RunFolder::open(&out, Earlier::Resume).unwrap_err().to_string();
        assert!(error.contains("another unic"), "{error}");
        drop(folder);
        assert!(RunFolder::open(&out, Earlier::Resume).is_ok());
    }

    #[test]
    fn an_earlier_run_is_lost_on_request_alone() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        assert!(RunFolder::open(&out, Earlier::Resume).is_err());
        drop(begun(&out));
        fs::write(out.with_extension("run").join("metrics.jsonl"), "{}\n").unwrap();
        assert!(RunFolder::open(&out, Earlier::Refuse).is_err());
        // Opening to overwrite loses nothing yet: the new run may fail before it begins.
        drop(RunFolder::open(&out, Earlier::Overwrite).unwrap());
        assert!(out.with_extension("run").join("metrics.jsonl").exists());
        drop(begun(&out));
        assert!(!out.with_extension("run").join("metrics.jsonl").exists());
    }

    #[test]
    fn a_killed_process_leaves_nothing_that_a_new_run_would_take_for_its_own() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("a.unic");
        let folder = begun(&out);
        let checkpoint = folder.checkpoints(Fit::HeldOut).join("step-00000001.safetensors");
        let half = ["a.run/.run.toml.AbC123.tmp", ".a.unic.AbC123.tmp"].map(|name| parent.path().join(name));
        let foreign = parent.path().join(".b.unic.AbC123.tmp");
        fs::create_dir_all(checkpoint.parent().unwrap()).unwrap();
        for file in half.iter().chain([&checkpoint, &foreign]) {
            fs::write(file, "x").unwrap();
        }
        fs::remove_file(folder.config()).unwrap();
        drop(folder);
        let folder = RunFolder::open(&out, Earlier::Refuse).unwrap();
        assert!(half.iter().all(|file| !file.exists()) && foreign.exists());
        folder
            .begin(&TrainConfig::preset(Preset::Tiny), &RunRecord::default())
            .unwrap();
        assert!(!checkpoint.exists());
    }

    #[test]
    fn a_run_that_never_began_leaves_nothing() {
        let parent = tempfile::tempdir().unwrap();
        drop(RunFolder::open(&parent.path().join("a.unic"), Earlier::Refuse).unwrap());
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
    }
}
