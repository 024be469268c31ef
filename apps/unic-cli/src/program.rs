//! Start and end of a program: command line, threads, signals and exit code.

use crate::{failure, interrupt, output};
use anyhow::{Context, Result};
use clap::Parser;
use std::{ffi::OsString, num::NonZeroUsize, sync::OnceLock};

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
    INVOCATION.get_or_init(|| Invocation::new(P::NAME, &words));
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

/// The program that this process runs.
struct Invocation {
    name: &'static str,
    command_line: String,
}

impl Invocation {
    fn new(name: &'static str, words: &[OsString]) -> Self {
        let words: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
        Self {
            name,
            command_line: words.join(" "),
        }
    }
}

// A static, because panics and signals are reported from handlers that take no arguments.
static INVOCATION: OnceLock<Invocation> = OnceLock::new();

/// Returns the name of the program that runs.
pub(crate) fn name() -> &'static str {
    INVOCATION.get().map_or("unic", |invocation| invocation.name)
}

/// Returns the command line of the program that runs.
pub(crate) fn command_line() -> &'static str {
    INVOCATION.get().map_or("", |invocation| &invocation.command_line)
}
