//! Failures of a program: one sentence on stderr, an exit code, and with `--json` an object on
//! stdout.

use crate::{
    invocation,
    output::{self, print_status},
};
use anyhow::{Error, Result};
use serde::Serialize;
use std::{
    io,
    panic::{self, AssertUnwindSafe},
    sync::atomic::{AtomicBool, Ordering},
};
use thiserror::Error;

/// Command line that makes no sense or would lose files: exit code 2, as of lines that clap
/// refuses.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Ctrl-C or SIGTERM: exit code 130. The text names what is kept and how to continue.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Interrupted(pub String);

/// Failure whose reason is part of a result that is already printed, in JSON too: exit code 1.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct AlreadyPrinted(pub(crate) String);

const SUCCEEDED: u8 = 0;
/// Exit code of files and numbers that cannot be used, and of errors in the program.
const FAILED: u8 = 1;
/// Exit code of a wrong command line, the one that clap uses.
const MISUSED: u8 = 2;
/// Exit code of an interrupted program: 128 + SIGINT, as shells report it.
pub(crate) const INTERRUPTED: u8 = 130;

/// Value of the key `error` of the JSON object that a failed command prints.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ErrorObject {
    /// Sentence that stderr has too.
    message: String,
    kind: FailureKind,
    exit_code: u8,
}

/// Kind of a failure. The names are values in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum FailureKind {
    /// Wrong command line.
    Usage,
    /// Ctrl-C or SIGTERM.
    Interrupted,
    /// Error in the program itself.
    Internal,
    /// Everything else, mostly files that cannot be used.
    Failed,
}

impl ErrorObject {
    pub(crate) fn of(error: &Error) -> Self {
        Self::new(sentence(error), kind(error))
    }

    fn new(message: String, kind: FailureKind) -> Self {
        let exit_code = kind.exit_code();
        Self {
            message,
            kind,
            exit_code,
        }
    }
}

impl FailureKind {
    fn exit_code(self) -> u8 {
        match self {
            Self::Usage => MISUSED,
            Self::Interrupted => INTERRUPTED,
            Self::Internal | Self::Failed => FAILED,
        }
    }
}

/// Runs a command and reports its failure. Returns the exit code.
pub(crate) fn exit_code(command: impl FnOnce() -> Result<()>) -> u8 {
    match panic::catch_unwind(AssertUnwindSafe(command)) {
        Ok(Ok(())) => SUCCEEDED,
        Ok(Err(error)) => {
            report(&error);
            kind(&error).exit_code()
        }
        // The panic hook has reported it.
        Err(_) => FAILED,
    }
}

/// Reports a failure on stderr, and with `--json` on stdout. Only the first call has an effect.
pub(crate) fn report(error: &Error) {
    // The signal handler may report an interruption while a command reports its own failure.
    static REPORTED: AtomicBool = AtomicBool::new(false);
    if REPORTED.swap(true, Ordering::SeqCst) {
        return;
    }
    print_status(&format!("{}: {}", invocation::name(), sentence(error)));
    if !error.chain().any(|e| e.is::<AlreadyPrinted>()) {
        print_object(ErrorObject::of(error));
    }
}

/// Reports an error of clap, or prints the help or the version. Returns the exit code of clap.
pub(crate) fn report_usage(error: &clap::Error) -> u8 {
    // A closed terminal cannot be reported anywhere.
    let _ = error.print();
    // Clap treats help and version as errors that go to stdout.
    if error.use_stderr() {
        // The first paragraph is the error; usage and hints follow.
        let text = error.to_string();
        let message = one_line(text.split("\n\n").next().unwrap_or_default());
        let message = message.strip_prefix("error: ").unwrap_or(&message).to_owned();
        print_object(ErrorObject::new(message, FailureKind::Usage));
    }
    u8::try_from(error.exit_code()).unwrap_or(MISUSED)
}

fn print_object(error: ErrorObject) {
    // Two objects are not JSON, and a second write could wait for a reader that does not read.
    if output::is_json() && !output::has_printed_result() {
        // A failure is being reported already: an error of stdout would hide it.
        let _ = output::print_json_of_failure(&serde_json::json!({ "error": error }));
    }
}

fn kind(error: &Error) -> FailureKind {
    // The whole chain is searched: libraries return the error of a listener inside their own.
    if error.chain().any(|e| e.is::<Interrupted>()) {
        FailureKind::Interrupted
    } else if error.chain().any(|e| e.is::<Usage>()) {
        FailureKind::Usage
    } else {
        FailureKind::Failed
    }
}

/// Text of an error on one line, with the reason of the operating system.
fn sentence(error: &Error) -> String {
    let interrupted = error.chain().find(|e| e.is::<Interrupted>());
    let text = interrupted.map_or_else(|| one_line(&error.to_string()), |e| one_line(&e.to_string()));
    // Errors of the libraries contain the reason, an anyhow context does not.
    let reason = error.chain().find_map(|e| e.downcast_ref::<io::Error>());
    match reason.map(|reason| one_line(&reason.to_string())) {
        Some(reason) if !text.contains(&reason) => format!("{text}: {reason}"),
        _ => text,
    }
}

/// Joins the lines of an error message and leaves out quotations of a TOML source.
// Errors of the crate `toml` quote the source in lines that begin with a line number and a bar.
pub(crate) fn one_line(text: &str) -> String {
    let quoted = |line: &&str| {
        line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ')
            .starts_with('|')
    };
    let lines: Vec<&str> = text.lines().filter(|line| !quoted(line)).map(str::trim).collect();
    lines
        .into_iter()
        .filter(|line| !line.is_empty())
        .collect::<Vec<_>>()
        .join(": ")
}

/// Makes panics report one sentence, as other failures do.
pub(crate) fn install_panic_hook() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!(" at {l}")).unwrap_or_default();
        // A payload that is no string comes from `panic_any`, which no dependency should use.
        let what = info.payload_as_str().unwrap_or("no message");
        let message = format!("internal error{place}: {}; please report it", one_line(what));
        print_status(&format!("{}: {message}", invocation::name()));
        print_object(ErrorObject::new(message, FailureKind::Internal));
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn quotations_of_toml_errors_are_left_out() {
        let error = toml::from_str::<toml::Table>("a = 1\nb = = 2\n").unwrap_err();
        let line = one_line(&error.to_string());
        assert!(line.starts_with("TOML parse error at line 2, column"), "{line}");
        assert!(!line.contains('\n') && !line.contains('|'), "{line}");
    }

    #[test]
    fn the_reason_of_the_operating_system_appears_once() {
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        let expected = "a.txt cannot be written: no storage space";
        assert_eq!(
            sentence(&Error::from(full()).context("a.txt cannot be written")),
            expected
        );
        let own = unic_io::Error::Io {
            path: "a.txt".into(),
            action: "write",
            source: full(),
        };
        assert_eq!(sentence(&own.into()), "a.txt: cannot write: no storage space");
    }

    #[test]
    fn the_exit_code_follows_from_any_error_of_the_chain() {
        assert_eq!(kind(&anyhow!("a file")).exit_code(), FAILED);
        assert_eq!(kind(&Usage("--set".into()).into()).exit_code(), MISUSED);
        let inside = unic_eval::Error::Observer {
            clip: "walk".into(),
            source: Box::new(Interrupted("stopped".into())),
        };
        let error = Error::from(inside);
        assert_eq!(
            (kind(&error).exit_code(), sentence(&error).as_str()),
            (INTERRUPTED, "stopped")
        );
    }
}
