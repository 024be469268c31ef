//! Writing to the terminal without ever failing because somebody hung up.

use anyhow::{Context, Result};
use serde::Serialize;
use std::{
    ffi::OsString,
    io::{self, ErrorKind, Write},
    sync::atomic::{AtomicBool, Ordering},
};

/// A line on stderr. Where stderr is closed there is nobody to tell.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

static STAGE: AtomicBool = AtomicBool::new(false);

/// A stage of a larger command: as long as this lives, results go to stderr.
#[derive(Debug)]
pub(crate) struct Stage(());

/// From here on, see [`Stage`].
pub(crate) fn stage() -> Stage {
    STAGE.store(true, Ordering::SeqCst);
    Stage(())
}

impl Drop for Stage {
    fn drop(&mut self) {
        STAGE.store(false, Ordering::SeqCst);
    }
}

/// Text on stdout. A closed pipe (`| head`) is the reader's way to say that it has enough.
pub(crate) fn print(text: &str) -> Result<()> {
    if STAGE.load(Ordering::SeqCst) {
        say(text.trim_end());
        return Ok(());
    }
    to_stdout(text)
}

/// The same from within a stage: for the one object of a command that fails there.
pub(crate) fn print_json_of_failure(value: &impl Serialize) -> Result<()> {
    to_stdout(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

static BEGUN: AtomicBool = AtomicBool::new(false);

/// Has a result gone to stdout, or is it on its way?
pub(crate) fn is_begun() -> bool {
    BEGUN.load(Ordering::SeqCst)
}

fn to_stdout(text: &str) -> Result<()> {
    BEGUN.store(true, Ordering::SeqCst);
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout cannot be written"),
        _ => Ok(()),
    }
}

static JSON: AtomicBool = AtomicBool::new(false);

/// Finds out whether this command line asks for JSON, be it a right one or not.
pub(crate) fn look_for_json(words: impl IntoIterator<Item = OsString>) {
    let asked = words
        .into_iter()
        .take_while(|word| word != "--")
        .any(|word| word == "--json");
    JSON.store(asked, Ordering::SeqCst);
}

/// Is one JSON object to come out, whatever happens?
pub(crate) fn is_json() -> bool {
    JSON.load(Ordering::SeqCst)
}

/// One JSON object on stdout.
pub(crate) fn print_json(value: &impl Serialize) -> Result<()> {
    print(&format!("{}\n", serde_json::to_string_pretty(value)?))
}
