//! Errors, the exceptions that they become, and the boundary that no panic crosses.

use crate::threads::on_own_threads;
use pyo3::{PyErr, Python, prelude::*, sync::PyOnceLock, types::PyType};
use std::{
    any::Any,
    io,
    panic::{AssertUnwindSafe, catch_unwind},
};
use unic_core::{AnimatorError, animator::SavedStateError, model::ModelError};

/// Failure of a call. The classes are those of `unic/errors.py`.
#[derive(Debug)]
pub(crate) enum Error {
    /// An argument that cannot be used: `unic.Error`.
    Value(String),
    /// A file that cannot be read: `unic.FileError`, with the number of the operating system.
    File { text: String, errno: Option<i32> },
    /// A fault of the library: `unic.Fault`.
    Fault(String),
    /// An exception of Python, such as that of Ctrl-C.
    Python(PyErr),
}

/// Result of a call.
pub(crate) type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Makes the sentence about an argument.
    pub(crate) fn value(what: &str, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Self {
        Self::Value(format!("{what}: expected {expected}, found {found}"))
    }

    /// Makes the error of a file from one of the program's functions.
    pub(crate) fn of_file(error: &anyhow::Error) -> Self {
        let reason = error.chain().find_map(|e| e.downcast_ref::<io::Error>());
        let mut text = error.to_string();
        // Errors of the libraries contain the reason, an anyhow context does not.
        if let Some(reason) = reason.map(ToString::to_string).filter(|r| !text.contains(r)) {
            text = format!("{text}: {reason}");
        }
        Self::File {
            text,
            errno: reason.and_then(io::Error::raw_os_error),
        }
    }
}

/// Number of the operating system, if it has refused an operation.
fn errno(error: &unic_io::Error) -> Option<i32> {
    match error {
        unic_io::Error::Io { source, .. } => source.raw_os_error(),
        _ => None,
    }
}

impl From<unic_io::Error> for Error {
    fn from(error: unic_io::Error) -> Self {
        Self::File {
            errno: errno(&error),
            text: error.to_string(),
        }
    }
}

impl From<AnimatorError> for Error {
    fn from(error: AnimatorError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<SavedStateError> for Error {
    fn from(error: SavedStateError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<PyErr> for Error {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        // Attached already: errors become exceptions where a call returns to Python.
        Python::attach(|py| exception(py, error).unwrap_or_else(|failure| failure))
    }
}

/// Makes the exception of an error.
fn exception(py: Python<'_>, error: Error) -> PyResult<PyErr> {
    static ERROR: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    static FILE_ERROR: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    static FAULT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let module = "unic.errors";
    let raised = match error {
        Error::Value(text) => ERROR.import(py, module, "Error")?.call1((text,))?,
        Error::File { text, errno } => {
            let raised = FILE_ERROR.import(py, module, "FileError")?.call1((text,))?;
            // Set afterwards: given to the class, it would become part of the sentence.
            raised.setattr("errno", errno)?;
            raised
        }
        Error::Fault(text) => FAULT.import(py, module, "Fault")?.call1((text,))?,
        Error::Python(error) => return Ok(error),
    };
    Ok(PyErr::from_value(raised))
}

/// Runs work without the interpreter's lock. A panic becomes a fault.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    // What a panic leaves half changed is behind a lock, which it poisons.
    py.detach(|| catch_unwind(AssertUnwindSafe(|| on_own_threads(work))))
        .unwrap_or_else(|panic| {
            Err(Error::Fault(format!(
                "fault of the library: {}",
                text_of(&*panic)
            )))
        })
}

/// Text of a panic.
fn text_of(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}
