//! Start and end of a program: command line, threads, signals and exit code.

use crate::{failure, interrupt, invocation, output};
use anyhow::{Context, Result};
use clap::Parser;
use std::{ffi::OsString, num::NonZeroUsize};

/// A program, as its command line describes it.
pub trait Program: Parser {
    /// Name of the program, which begins each of its error messages.
    const NAME: &'static str;

    /// Returns the number of threads that the user asks for. `None` stands for one per core.
    fn threads(&self) -> Option<NonZeroUsize>;

    /// Runs the command that the user asks for.
    ///
    /// # Errors
    /// Everything that makes the command fail. [`run`] reports it.
    fn run_command(&self) -> Result<()>;
}

/// Runs a program with the words of a command line, the program's name first. Returns the exit
/// code.
///
/// It installs the handlers of panics and signals and starts the global threads, which can be done
/// only once in a process.
pub fn run<P: Program>(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = words.into_iter().collect();
    invocation::set(P::NAME, &words);
    failure::install_panic_hook();
    output::detect_json_option(words.iter().cloned());
    match P::try_parse_from(words) {
        Ok(program) => failure::exit_code(|| prepare(&program).and_then(|()| program.run_command())),
        Err(error) => failure::report_usage(&error),
    }
}

fn prepare(program: &impl Program) -> Result<()> {
    interrupt::install_handler()?;
    let Some(threads) = program.threads() else {
        return Ok(());
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get());
    pool.build_global()
        .context("--threads: the threads cannot be started")
}
