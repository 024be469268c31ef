//! The program `unic`, and the processes in which FBX and USD files are read.

use crate::error::{Error, Result, detached};
use pyo3::prelude::*;
use std::{
    ffi::OsString,
    io::Write,
    process::Command,
    sync::atomic::{AtomicBool, Ordering},
};
use unic_scene::guard;

/// Runs the program with the words of a command line, its name first. Once in a process.
#[pyfunction]
pub(crate) fn run(py: Python<'_>, words: Vec<OsString>) -> Result<u8> {
    // Handlers of signals and threads are global.
    static HAS_RUN: AtomicBool = AtomicBool::new(false);
    if HAS_RUN.swap(true, Ordering::SeqCst) {
        return Err(Error::value("run", "one run in a process", "a second one"));
    }
    detached(py, || {
        let code = unic_cli::run_for_status(words);
        // Rust writes what is left when its own `main` returns, and here is none. An error of a closed
        // terminal cannot be reported anywhere.
        let _ = std::io::stdout().flush();
        Ok(code)
    })
}

/// Lets FBX and USD files be read in processes of a command, which must call `read_scene`.
#[pyfunction]
pub(crate) fn read_scenes_with(command: Vec<OsString>) -> Result<()> {
    let [program, arguments @ ..] = &command[..] else {
        return Err(Error::value("command", "a program with its arguments", "none"));
    };
    let (program, arguments) = (program.clone(), arguments.to_vec());
    guard::use_child(move || {
        let mut command = Command::new(&program);
        command.args(&arguments);
        command
    });
    Ok(())
}

/// Reads the file that the parent process names on stdin. Returns the exit code.
#[pyfunction]
pub(crate) fn read_scene() -> u8 {
    guard::serve()
}
