//! The `unic` command: simulate, train, evaluate and animate neural garments.

mod args;
mod checks;
mod commands;
mod failure;
mod folder_lock;
mod interrupt;
mod limits;
mod model_file;
mod motion_file;
mod output;
mod outputs;
mod pictures;
mod progress;
mod run_folder;
mod settings;
mod worst_frames;

use anyhow::{Context, Result};
use args::{Args, Command};
use cap::Cap;
use clap::Parser;
use std::{alloc::System, process::ExitCode};

/// Knows how many bytes are allocated, and allows them all.
#[global_allocator]
static HEAP: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> ExitCode {
    failure::install_panic_hook();
    output::look_for_json(std::env::args_os());
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => return failure::tell_usage(&error),
    };
    failure::exit_code(|| prepare(&args).and_then(|()| run(&args.command)))
}

fn prepare(args: &Args) -> Result<()> {
    interrupt::listen()?;
    let Some(threads) = args.threads else {
        return Ok(());
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get());
    pool.build_global()
        .context("--threads: the threads cannot be started")
}

fn run(command: &Command) -> Result<()> {
    match command {
        Command::Demo(args) => commands::demo::run(args),
        Command::Simulate(args) => commands::simulate::run(args),
        Command::Train(args) => commands::train::run(args),
        Command::Eval(args) => commands::eval::run(args),
        Command::Animate(args) => commands::animate::run(args),
        Command::Inspect(args) => commands::inspect::run(args),
        Command::Bench(args) => commands::bench::run(args),
        Command::Completions { shell } => commands::completions(*shell),
    }
}
