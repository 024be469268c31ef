//! `unic bench lasting`: what an hour of play would show.

use crate::{
    args::LastingArgs,
    commands::eval,
    interrupt,
    output::{print, print_json},
    progress::Progress,
};
use anyhow::Result;
use serde::Serialize;
use unic_eval::lasting::{self, Lasting, Settings};
use unic_io::Capture;

/// Measures and prints.
pub(crate) fn run(args: &LastingArgs) -> Result<()> {
    let capture = Capture::open(&args.capture)?;
    let animator = eval::animator(&args.model, args.intersection, &capture)?;
    args.force.capture(&capture)?;
    let settings = Settings {
        seed: args.seed,
        random_frames: args.frames as usize,
    };
    let mut progress: Option<(&str, Progress)> = None;
    let lasting = lasting::measure(&capture, animator, &settings, &mut |tick| {
        interrupt::check()?;
        let (_, bar) = match progress.take() {
            Some(shown) if shown.0 == tick.measure => progress.insert(shown),
            _ => progress.insert((tick.measure, Progress::new(tick.measure, 0, tick.total as u64))),
        };
        bar.set(tick.done as u64, String::new);
        Ok(())
    })?;
    drop(progress);
    let machine = crate::commands::machine();
    match args.json {
        true => print_json(&Results { machine, lasting }),
        false => print(&format!("{machine}\n\n{lasting}")),
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Results {
    machine: String,
    #[serde(flatten)]
    lasting: Lasting,
}
