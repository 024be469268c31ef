//! The program `unic` as a library: simulate, train, evaluate and animate neural garments.
//!
//! [`run`] is the whole program. The public modules hold what another program needs to follow the
//! same rules as `unic`:
//!
//! | rule | where |
//! |---|---|
//! | start of a program, threads, exit code | [`program`] |
//! | errors: one sentence on stderr, an exit code, an object with `--json` | [`failure`] |
//! | Ctrl-C and SIGTERM | [`interrupt`] |
//! | results on stdout, notes on stderr, progress | [`output`], [`progress`] |
//! | files that may be written | [`outputs`] |
//! | folders of one process at a time | [`folder_lock`] |
//! | plausible mistakes in captures and motions | [`checks`] |
//! | trained garments that come with the program | [`garments`] |
//! | models, and the time of a frame | [`model_file`], [`timing`] |
//! | training as `unic train` does | [`args::TrainArgs`], [`commands::train`], [`settings`] |
//! | description of the machine | [`machine`] |

pub mod args;
pub mod checks;
pub mod commands;
pub mod failure;
pub mod folder_lock;
pub mod garments;
pub mod interrupt;
mod invocation;
mod limits;
pub mod machine;
mod mesh_units;
pub mod model_file;
mod motion_file;
mod motion_source;
#[cfg(feature = "viewer")]
mod movie;
pub mod output;
pub mod outputs;
mod pictures;
#[cfg(feature = "viewer")]
mod portraits;
pub mod program;
pub mod progress;
mod run_folder;
mod scene_reader;
pub mod settings;
pub mod timing;
mod worst_frames;

use anyhow::Result;
use args::{Args, Command};
use cap::Cap;
use program::Program;
use std::{alloc::System, ffi::OsString, num::NonZeroUsize, process::ExitCode};

/// Counts the bytes that are allocated, for the memory per instance of `unic bench`. Limits
/// nothing.
#[global_allocator]
static HEAP: Cap<System> = Cap::new(System, usize::MAX);

/// Runs `unic` with the words of a command line, the program's name first.
///
/// A process can call it once: handlers of signals and threads are global.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words: Vec<OsString> = words.into_iter().collect();
    if let Some(code) = scene_reader::serve(&words) {
        return ExitCode::from(code);
    }
    scene_reader::use_own_program();
    ExitCode::from(run_for_status(words))
}

/// Runs `unic` as [`run`] does. Returns the exit code as a number, for callers that are no `main`.
pub fn run_for_status(words: impl IntoIterator<Item = OsString>) -> u8 {
    program::run::<Args>(words)
}

impl Program for Args {
    const NAME: &'static str = "unic";

    fn threads(&self) -> Option<NonZeroUsize> {
        self.threads.count()
    }

    fn run_command(&self) -> Result<()> {
        match &self.command {
            Command::Demo(args) => commands::demo::run(args),
            Command::Simulate(args) => commands::simulate::run(args),
            Command::Import(args) => commands::import::run(args),
            Command::Train(args) => commands::train::run(args),
            Command::Eval(args) => commands::eval::run(args),
            Command::Animate(args) => commands::animate::run(args),
            #[cfg(feature = "viewer")]
            Command::Play(args) => commands::play::run(args),
            #[cfg(feature = "viewer")]
            Command::View(args) => commands::view::run(args),
            Command::Inspect(args) => commands::inspect::run(args),
            Command::Bench(args) => commands::bench::run(args),
            Command::Export(args) => commands::export::run(args),
            Command::Retarget(args) => commands::retarget::run(args),
            Command::MotionDatabase(args) => commands::motion_database::run(args),
            Command::Completions { shell } => commands::completions(*shell),
        }
    }
}
