//! Results on stdout, status and warnings on stderr.
//!
//! A closed pipe or terminal is never an error: `unic ... | head` ends well.

use anyhow::{Context, Result};
use serde::Serialize;
use std::{
    ffi::OsString,
    io::{self, ErrorKind, Write},
    sync::atomic::{AtomicBool, Ordering},
};

/// Prints a line of status or a warning to stderr.
pub fn print_status(line: &str) {
    // A closed stderr cannot be reported anywhere, and is no reason to stop the work.
    let _ = writeln!(io::stderr(), "{line}");
}

// Statics, because results are printed from many places and failures also from a panic hook and a
// signal handler, which take no arguments.
static STAGE: AtomicBool = AtomicBool::new(false);

/// Guard of a stage of a larger command. As long as it lives, results go to stderr.
#[derive(Debug)]
pub(crate) struct StageGuard(());

/// Sends results to stderr as long as the returned guard lives.
pub(crate) fn redirect_results_to_stderr() -> StageGuard {
    STAGE.store(true, Ordering::SeqCst);
    StageGuard(())
}

impl Drop for StageGuard {
    fn drop(&mut self) {
        STAGE.store(false, Ordering::SeqCst);
    }
}

/// Prints a result to stdout.
///
/// # Errors
/// A stdout that cannot be written, such as a file on a full disk.
pub fn print(text: &str) -> Result<()> {
    if STAGE.load(Ordering::SeqCst) {
        print_status(text.trim_end());
        return Ok(());
    }
    to_stdout(text)
}

/// Prints the JSON object of a failure to stdout, even within a stage.
pub(crate) fn print_json_of_failure(value: &impl Serialize) -> Result<()> {
    to_stdout(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

static BEGUN: AtomicBool = AtomicBool::new(false);

/// Has the program begun to write to stdout?
pub(crate) fn has_printed_result() -> bool {
    BEGUN.load(Ordering::SeqCst)
}

fn to_stdout(text: &str) -> Result<()> {
    // Set before the write, which may block or fail half-way: a second object must not follow.
    BEGUN.store(true, Ordering::SeqCst);
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        // The reader of a pipe closes it when it has read enough.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout cannot be written"),
        _ => Ok(()),
    }
}

static JSON: AtomicBool = AtomicBool::new(false);

/// Notes whether a command line contains `--json`, before it is parsed: a wrong one fails in JSON
/// too.
pub(crate) fn detect_json_option(words: impl IntoIterator<Item = OsString>) {
    let asked = words
        .into_iter()
        .take_while(|word| word != "--")
        .any(|word| word == "--json");
    JSON.store(asked, Ordering::SeqCst);
}

/// Does the command line ask for JSON?
pub(crate) fn is_json() -> bool {
    JSON.load(Ordering::SeqCst)
}

/// Prints a result as one JSON object to stdout.
///
/// # Errors
/// A stdout that cannot be written.
pub fn print_json(value: &impl Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}
