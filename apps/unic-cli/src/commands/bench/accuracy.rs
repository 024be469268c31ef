//! `unic bench accuracy`: rows of settings, trained and measured on captures.
//!
//! ```text
//! OUT/CAPTURE/baselines.json      what needs no training
//! OUT/CAPTURE/ROW/seed-1.unic     a model, its run beside it; none of networks to compare with
//! OUT/CAPTURE/ROW/seed-1.json     what it was measured at
//! ```

mod measure;
mod rival;
mod row;
mod stored;
mod table;

use crate::{
    args::AccuracyArgs,
    folder_lock::FolderLock,
    interrupt,
    output::{print, print_json, say},
    outputs::{Existing, Outputs},
};
use anyhow::{Result, bail};
use row::RowSettings;
use serde::Serialize;
use std::path::{Path, PathBuf};
use stored::{Cell, Trained};
use unic_eval::Evaluation;
use unic_io::{Capture, Split};

/// Trains what is not trained yet, measures, prints.
pub(crate) fn run(args: &AccuracyArgs) -> Result<()> {
    if args.list {
        return print(&row::list());
    }
    let rows = RowSettings::read_all(&args.rows)?;
    let captures = open_all(&args.captures)?;
    check_outputs(args, &captures)?;
    for capture in &captures {
        args.force.capture(capture)?;
    }
    let _lock = FolderLock::hold(&args.out)?;
    let mut results = Vec::new();
    for (path, capture) in args.captures.iter().zip(&captures) {
        results.push(OfCapture::measure(args, path, capture, &rows)?);
    }
    let results = Results {
        budget: Budget::of(args),
        budget_in_words: Cell::budget(args),
        machine: crate::commands::machine(),
        captures: results,
    };
    match args.json {
        true => print_json(&results),
        false => print(&results.to_string()),
    }
}

/// Results are kept in a folder for each capture, which may not be the capture itself.
fn check_outputs(args: &AccuracyArgs, captures: &[Capture]) -> Result<()> {
    let folders = captures
        .iter()
        .map(|capture| args.out.join(&capture.manifest.name));
    folders
        .fold(
            Outputs::beside(&args.captures).folder(&args.out, []),
            |outputs, folder| outputs.folder(&folder, []),
        )
        .check(Existing::Resumed)
}

/// All of them before the first training, so that nothing is found wrong hours later.
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

/// What `--json` prints.
#[derive(Serialize)]
struct Results {
    budget: Budget,
    #[serde(skip)]
    budget_in_words: String,
    machine: String,
    captures: Vec<OfCapture>,
}

/// The budget of each training.
#[derive(Serialize)]
struct Budget {
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
}

impl Budget {
    fn of(args: &AccuracyArgs) -> Self {
        Self {
            steps: args.steps,
            seconds: args.steps.is_none().then_some(args.budget.as_secs_f64()),
        }
    }
}

/// One table.
#[derive(Serialize)]
struct OfCapture {
    capture: String,
    /// Seconds of motion that rows are trained on.
    training_seconds: f64,
    test_clips: Vec<String>,
    baselines: Evaluation,
    rows: Vec<OfRow>,
}

/// One row, once a seed.
#[derive(Serialize)]
struct OfRow {
    name: String,
    title: String,
    seeds: Vec<Trained>,
}

impl OfCapture {
    fn measure(args: &AccuracyArgs, path: &Path, capture: &Capture, rows: &[RowSettings]) -> Result<Self> {
        let name = &capture.manifest.name;
        let folder = args.out.join(name);
        let baselines = measure::baselines(capture, &folder)?;
        let mut of_rows = Vec::new();
        for (i, row) in rows.iter().enumerate() {
            let mut seeds = Vec::new();
            for &seed in &args.seeds {
                interrupt::check()?;
                say(&format!(
                    "{name}: row {} of {}, {}, seed {seed}",
                    i + 1,
                    rows.len(),
                    row.name
                ));
                seeds.push(Cell::new(args, path, &folder, row, seed).trained(capture)?);
            }
            of_rows.push(OfRow {
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
            rows: of_rows,
        })
    }
}

fn seconds(capture: &Capture, split: Split) -> Result<f64> {
    let names = capture.clip_names(split).iter();
    let frames = names.map(|name| Ok(capture.summarise_clip(name)?.pose_frames));
    let frames: usize = frames.sum::<Result<usize>>()?;
    Ok(frames as f64 / f64::from(capture.manifest.fps))
}
