//! `unic-lab pretrain`: the unit that recurrences start from.

use crate::args::PretrainArgs;
use anyhow::Result;
use std::sync::{Mutex, PoisonError};
use unic_cli::{
    interrupt,
    output::print,
    outputs::{Existing, Outputs},
    progress::Progress,
};
use unic_io::{Capture, atomic};
use unic_train::{Preset, Pretraining, Processor, TrainConfig};

/// Trains and writes.
pub(crate) fn run(args: &PretrainArgs) -> Result<()> {
    let outputs = Outputs::with_inputs(&args.captures).file(&args.out);
    outputs.check(Existing::of(args.overwrite))?;
    let mut settings = TrainConfig::preset(Preset::Standard);
    settings.seed = args.seed;
    let captures = args.captures.iter().map(|folder| Capture::open(folder));
    let pretraining = Pretraining {
        captures: captures.collect::<Result<_, _>>()?,
        settings: &settings,
        processor: Processor::Cpu,
    };
    let progress = Mutex::new(None);
    let unit = pretraining.run(&|done, all| {
        let mut shown = progress.lock().unwrap_or_else(PoisonError::into_inner);
        (shown.get_or_insert_with(|| Progress::new("pretraining", done, all))).set(done, String::new);
        interrupt::control()
    });
    drop(progress);
    // A stop is a signal's, which has an exit code of its own.
    interrupt::check()?;
    let bytes = unit?.to_bytes()?;
    atomic::write(&args.out, &bytes)?;
    print(&format!("{}: {} kB\n", args.out.display(), bytes.len() / 1000))
}
