//! `unic-lab accuracy`: rows of settings, trained and measured on captures.
//!
//! ```text
//! OUT/CAPTURE/baselines.json      metrics of the baselines
//! OUT/CAPTURE/ROW/seed-1.unic     model with its run folder; none for networks of other methods
//! OUT/CAPTURE/ROW/seed-1.json     metrics of the row
//! ```

mod measure;
mod networks;
mod row;
mod stored;
mod table;

use crate::args::AccuracyArgs;
use anyhow::{Result, bail};
use row::RowSettings;
use serde::Serialize;
use std::path::{Path, PathBuf};
use stored::{Trained, TrainingJob};
use unic_cli::{
    folder_lock::FolderLock,
    interrupt, machine,
    output::{print, print_json, print_status},
    outputs::{Existing, Outputs},
};
use unic_eval::Evaluation;
use unic_io::{Capture, Split};

/// Trains the rows that have no result yet, measures them and prints all results.
pub(crate) fn run(args: &AccuracyArgs) -> Result<()> {
    if args.list {
        return print(&row::list());
    }
    let rows = RowSettings::read_all(&args.rows)?;
    let captures = open_all(&args.captures)?;
    check_outputs(args, &captures)?;
    for capture in &captures {
        args.force.check_capture(capture)?;
    }
    // Another benchmark in the same folder would train the same rows.
    let _lock = FolderLock::acquire(&args.out)?;
    let mut tables = Vec::new();
    for (path, capture) in args.captures.iter().zip(&captures) {
        tables.push(CaptureResults::measure(args, path, capture, &rows)?);
    }
    let results = AccuracyResults {
        budget: JobBudget::of(args),
        budget_in_words: TrainingJob::budget_in_words(args),
        machine: machine::description(),
        captures: tables,
    };
    match args.json {
        true => print_json(&results),
        false => print(&results.to_string()),
    }
}

/// Refuses an output folder that is a capture. Results are written to one folder for each capture.
fn check_outputs(args: &AccuracyArgs, captures: &[Capture]) -> Result<()> {
    let folders = captures
        .iter()
        .map(|capture| args.out.join(&capture.manifest.name));
    folders
        .fold(
            Outputs::with_inputs(&args.captures).folder(&args.out, []),
            |outputs, folder| outputs.folder(&folder, []),
        )
        .check(Existing::Resumed)
}

/// Opens all captures before the first training, so that no mistake shows up only after hours.
fn open_all(paths: &[PathBuf]) -> Result<Vec<Capture>> {
    let mut captures: Vec<Capture> = Vec::new();
    for path in paths {
        let capture = Capture::open(path)?;
        if capture.clip_names(Split::Test).is_empty() {
            bail!(
                "{}: expected clips in [splits] test to measure on, found none",
                path.display()
            );
        }
        // The name becomes a folder: separators and `..` would lead elsewhere.
        if Path::new(&capture.manifest.name).file_name() != Some(capture.manifest.name.as_ref()) {
            let (path, name) = (path.display(), &capture.manifest.name);
            bail!("{path}: expected a capture whose name can be a folder's, found {name}");
        }
        if captures.iter().any(|c| c.manifest.name == capture.manifest.name) {
            let name = &capture.manifest.name;
            bail!(
                "{}: expected captures of different names, found {name} again",
                path.display()
            );
        }
        captures.push(capture);
    }
    Ok(captures)
}

/// Results of all captures: the object that `--json` prints.
#[derive(Serialize)]
struct AccuracyResults {
    budget: JobBudget,
    #[serde(skip)]
    budget_in_words: String,
    machine: String,
    captures: Vec<CaptureResults>,
}

/// Budget of each training: steps or seconds.
#[derive(Serialize)]
struct JobBudget {
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
}

impl JobBudget {
    fn of(args: &AccuracyArgs) -> Self {
        Self {
            steps: args.steps,
            seconds: args.steps.is_none().then_some(args.budget.as_secs_f64()),
        }
    }
}

/// Results on one capture: one table.
#[derive(Serialize)]
struct CaptureResults {
    capture: String,
    /// Duration of the motion that rows are trained on, seconds.
    training_seconds: f64,
    test_clips: Vec<String>,
    baselines: Evaluation,
    rows: Vec<RowResults>,
}

/// Results of one row, one entry for each seed.
#[derive(Serialize)]
struct RowResults {
    name: String,
    title: String,
    seeds: Vec<Trained>,
}

impl CaptureResults {
    /// Trains and measures all rows on one capture.
    fn measure(args: &AccuracyArgs, path: &Path, capture: &Capture, rows: &[RowSettings]) -> Result<Self> {
        let name = &capture.manifest.name;
        let folder = args.out.join(name);
        let baselines = measure::baselines(capture, &folder)?;
        let mut row_results = Vec::new();
        for (i, row) in rows.iter().enumerate() {
            let mut seeds = Vec::new();
            for &seed in &args.seeds {
                interrupt::check()?;
                print_status(&format!(
                    "{name}: row {} of {}, {}, seed {seed}",
                    i + 1,
                    rows.len(),
                    row.name
                ));
                seeds.push(TrainingJob::new(args, path, &folder, row, seed).trained(capture)?);
            }
            row_results.push(RowResults {
                name: row.name.clone(),
                title: row.title.clone(),
                seeds,
            });
        }
        Ok(Self {
            capture: name.clone(),
            training_seconds: seconds(capture, Split::Train)?,
            test_clips: capture.clip_names(Split::Test).to_vec(),
            baselines,
            rows: row_results,
        })
    }
}

/// Returns the duration of all clips of a split, seconds.
fn seconds(capture: &Capture, split: Split) -> Result<f64> {
    let names = capture.clip_names(split).iter();
    let frames = names.map(|name| Ok(capture.summarise_clip(name)?.pose_frames));
    let frames: usize = frames.sum::<Result<usize>>()?;
    Ok(frames as f64 / f64::from(capture.manifest.fps))
}
