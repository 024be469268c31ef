//! Errors, their codes and texts, and the boundary that no panic crosses.

use crate::status::UnicStatus;
use std::{
    any::Any,
    cell::RefCell,
    ffi::{CString, c_char},
    fmt::Display,
    panic::{AssertUnwindSafe, catch_unwind},
};
use thiserror::Error;
use unic_core::{AnimatorError, ModelFileError, animator::SavedStateError, model::ModelError};

/// Error of a call.
#[derive(Debug, Error)]
pub(crate) enum Error {
    #[error("{what}: expected a pointer, found null")]
    Null { what: &'static str },
    #[error("{what}: expected a pointer aligned to {expected} bytes, found {found:#x}")]
    Misaligned {
        what: &'static str,
        expected: usize,
        found: usize,
    },
    #[error("{kind}: expected a handle in use, found one that is released or was never made")]
    Handle { kind: &'static str },
    #[error("instance: expected calls from one thread at a time, found another call that has not returned")]
    InUse,
    #[error("{what}: expected {expected}, found {found}")]
    Size {
        what: &'static str,
        expected: usize,
        found: usize,
    },
    #[error("{what}: expected a struct of at least {least} bytes, found one of {found}")]
    StructSize {
        what: &'static str,
        least: usize,
        found: usize,
    },
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        what: &'static str,
        expected: &'static str,
        found: String,
    },
    #[error("rotation of joint {joint}: expected a unit quaternion, found one of length {length}")]
    Rotation { joint: usize, length: f32 },
    #[error(transparent)]
    Animator(#[from] AnimatorError),
    #[error(transparent)]
    ModelFile(#[from] ModelFileError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("{path}: {source}")]
    Read { path: String, source: std::io::Error },
    #[error(transparent)]
    State(#[from] SavedStateError),
    #[error("buffer: expected room for {expected} bytes, found {found}")]
    Buffer { expected: usize, found: usize },
    #[error("cannot start a thread: {0}")]
    Threads(std::io::Error),
    #[error("fault of the library: {0}")]
    Panic(String),
    #[error("instance: a fault of the library left it unusable; release it")]
    Broken,
}

impl Error {
    /// Error of an argument or an option.
    pub(crate) fn value(what: &'static str, expected: &'static str, found: impl Display) -> Self {
        Self::Value {
            what,
            expected,
            found: found.to_string(),
        }
    }

    fn status(&self) -> UnicStatus {
        match self {
            Self::Null { .. } => UnicStatus::NullPointer,
            Self::Misaligned { .. } => UnicStatus::Misaligned,
            Self::Handle { .. } => UnicStatus::InvalidHandle,
            Self::InUse => UnicStatus::InUse,
            Self::Size { .. } | Self::StructSize { .. } => UnicStatus::WrongSize,
            Self::Value { .. } | Self::Rotation { .. } | Self::Model(_) => UnicStatus::InvalidValue,
            Self::Animator(error) => match error {
                AnimatorError::Joints { .. } | AnimatorError::Vertices { .. } => UnicStatus::WrongSize,
                AnimatorError::Pose | AnimatorError::Position { .. } => UnicStatus::InvalidValue,
                AnimatorError::State(_) => UnicStatus::BadState,
            },
            Self::ModelFile(_) => UnicStatus::BadModel,
            Self::Read { .. } => UnicStatus::CannotRead,
            Self::State(_) => UnicStatus::BadState,
            Self::Buffer { .. } => UnicStatus::BufferTooSmall,
            Self::Threads(_) => UnicStatus::OutOfThreads,
            Self::Panic(_) => UnicStatus::Panic,
            Self::Broken => UnicStatus::Broken,
        }
    }
}

thread_local! {
    static LAST: RefCell<Option<CString>> = const { RefCell::new(None) };
}

/// Runs a call and turns its error, or its panic, into a code; the text is kept for the thread.
pub(crate) fn guard(work: impl FnOnce() -> Result<(), Error>) -> UnicStatus {
    // What a panic interrupts is behind a mutex, which is poisoned by it and never used again.
    let result = catch_unwind(AssertUnwindSafe(work));
    match result.unwrap_or_else(|payload| Err(Error::Panic(panic_text(&*payload)))) {
        Ok(()) => UnicStatus::Ok,
        Err(error) => {
            remember(&error.to_string());
            error.status()
        }
    }
}

/// Text of a panic.
fn panic_text(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let owned = || payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(owned).unwrap_or("panic without a text").to_owned()
}

fn remember(text: &str) {
    let text = c_string(text);
    // The text of a thread that is ending is lost, and the code remains.
    let _ = LAST.try_with(|last| last.replace(Some(text)));
}

/// Copies a text for C. A text from a file may hold a zero byte, which ends a text in C.
pub(crate) fn c_string(text: &str) -> CString {
    let before_zero = text.split('\0').next().unwrap_or_default();
    CString::new(before_zero).unwrap_or_default()
}

/// Text of the last error on the calling thread: one sentence in English, in UTF-8.
///
/// Empty before the first error, never null. Calls that succeed leave it. The pointer is valid
/// until the next error on the same thread.
#[unsafe(no_mangle)]
pub extern "C" fn unic_last_error() -> *const c_char {
    let text = LAST.try_with(|last| last.borrow().as_ref().map(|text| text.as_ptr()));
    text.ok().flatten().unwrap_or(c"".as_ptr())
}
