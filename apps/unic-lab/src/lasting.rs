//! `unic-lab lasting`: behaviour of a model in long use.

use crate::args::LastingArgs;
use anyhow::Result;
use serde::Serialize;
use unic_cli::{
    interrupt, machine, model_file,
    output::{print, print_json},
    progress::Progress,
};
use unic_eval::lasting::{self, LastingReport, Settings};
use unic_io::Capture;

/// Measures and prints.
pub(crate) fn run(args: &LastingArgs) -> Result<()> {
    let capture = Capture::open(&args.capture)?;
    let animator = model_file::animator(&args.model, args.intersection, &capture)?;
    args.force.check_capture(&capture)?;
    let settings = Settings {
        seed: args.seed,
        random_frames: args.frames as usize,
    };
    let mut shown: Option<(&str, Progress)> = None;
    let report = lasting::measure(&capture, animator, &settings, &mut |progress| {
        interrupt::check()?;
        let (name, total) = (progress.measure, progress.total as u64);
        let (_, bar) = match shown.take() {
            Some(current) if current.0 == name => shown.insert(current),
            // Another measure begins: its bar replaces that of the one before.
            _ => shown.insert((name, Progress::new(name, 0, total))),
        };
        bar.set(progress.done as u64, String::new);
        Ok(())
    })?;
    drop(shown);
    let machine = machine::description();
    match args.json {
        true => print_json(&LastingResults { machine, report }),
        false => print(&format!("{machine}\n\n{report}")),
    }
}

/// Results of all measures: the object that `--json` prints.
#[derive(Serialize)]
struct LastingResults {
    machine: String,
    #[serde(flatten)]
    report: LastingReport,
}
