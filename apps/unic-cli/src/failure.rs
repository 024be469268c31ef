//! How the program ends: one sentence on stderr and an exit code.

use crate::output::{self, say};
use anyhow::{Error, Result};
use serde::Serialize;
use std::{
    io,
    panic::{self, AssertUnwindSafe},
    process::ExitCode,
    sync::atomic::{AtomicBool, Ordering},
};
use thiserror::Error;

/// A command line that cannot be meant: exit code 2, as for those that clap refuses.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct Usage(pub(crate) String);

/// Ctrl-C or a request to terminate: exit code 130. The text says what is left and how to go on.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct Interrupted(pub(crate) String);

/// A failure whose reason is part of a result that stdout has already, in JSON too: exit code 1.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct Shown(pub(crate) String);

const FAILED: u8 = 1;
const MISUSED: u8 = 2;
/// 128 + SIGINT, as shells report it.
pub(crate) const INTERRUPTED: u8 = 130;

/// The key `error` of the one JSON object that a failed command prints.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ErrorObject {
    /// One sentence.
    message: String,
    kind: Kind,
    exit_code: u8,
}

/// Why a command fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// A command line that cannot be meant.
    Usage,
    /// Somebody has stopped it.
    Interrupted,
    /// An error in the program itself.
    Internal,
    /// Everything else: files above all.
    Failed,
}

impl ErrorObject {
    pub(crate) fn of(error: &Error) -> Self {
        Self::new(sentence(error), kind(error))
    }

    fn new(message: String, kind: Kind) -> Self {
        let exit_code = kind.exit_code();
        Self {
            message,
            kind,
            exit_code,
        }
    }
}

impl Kind {
    fn exit_code(self) -> u8 {
        match self {
            Self::Usage => MISUSED,
            Self::Interrupted => INTERRUPTED,
            Self::Internal | Self::Failed => FAILED,
        }
    }
}

/// Runs a command, tells why it failed if it did, and gives the exit code.
pub(crate) fn exit_code(command: impl FnOnce() -> Result<()>) -> ExitCode {
    match panic::catch_unwind(AssertUnwindSafe(command)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            tell(&error);
            ExitCode::from(kind(&error).exit_code())
        }
        // The hook has told already.
        Err(_) => ExitCode::from(FAILED),
    }
}

/// Says why the program fails: once, however many threads find out.
pub(crate) fn tell(error: &Error) {
    static TOLD: AtomicBool = AtomicBool::new(false);
    if TOLD.swap(true, Ordering::SeqCst) {
        return;
    }
    say(&format!("unic: {}", sentence(error)));
    if !error.chain().any(|e| e.is::<Shown>()) {
        print_object(ErrorObject::of(error));
    }
}

/// Says what clap has found; the exit code is clap's.
pub(crate) fn tell_usage(error: &clap::Error) -> ExitCode {
    // Help and version are no failures. Where the terminal is gone there is nobody to tell.
    let _ = error.print();
    if error.use_stderr() {
        let text = error.to_string();
        let message = one_line(text.split("\n\n").next().unwrap_or_default());
        let message = message.strip_prefix("error: ").unwrap_or(&message).to_owned();
        print_object(ErrorObject::new(message, Kind::Usage));
    }
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(MISUSED))
}

fn print_object(error: ErrorObject) {
    // A second object would be none, and a reader that does not read would be waited for.
    if output::is_json() && !output::is_begun() {
        // A closed stdout is nobody's failure.
        let _ = output::print_json_of_failure(&serde_json::json!({ "error": error }));
    }
}

fn kind(error: &Error) -> Kind {
    // Libraries hand a listener's error back inside their own.
    if error.chain().any(|e| e.is::<Interrupted>()) {
        Kind::Interrupted
    } else if error.chain().any(|e| e.is::<Usage>()) {
        Kind::Usage
    } else {
        Kind::Failed
    }
}

/// The error on one line. The libraries' errors name their causes themselves; a context of ours leaves
/// the operating system's reason to be added.
fn sentence(error: &Error) -> String {
    let interrupted = error.chain().find(|e| e.is::<Interrupted>());
    let text = interrupted.map_or_else(|| one_line(&error.to_string()), |e| one_line(&e.to_string()));
    let reason = error.chain().find_map(|e| e.downcast_ref::<io::Error>());
    match reason.map(|reason| one_line(&reason.to_string())) {
        Some(reason) if !text.contains(&reason) => format!("{text}: {reason}"),
        _ => text,
    }
}

/// TOML's errors quote the source over several lines: those that begin with a margin go.
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

/// The last resort: a panic is one sentence too.
pub(crate) fn install_panic_hook() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!(" at {l}")).unwrap_or_default();
        let what = info.payload_as_str().unwrap_or("no message");
        let message = format!("internal error{place}: {}; please report it", one_line(what));
        say(&format!("unic: {message}"));
        print_object(ErrorObject::new(message, Kind::Internal));
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn toml_errors_lose_their_quotations() {
        let error = toml::from_str::<toml::Table>("a = 1\nb = = 2\n").unwrap_err();
        let line = one_line(&error.to_string());
        assert!(line.starts_with("TOML parse error at line 2, column"), "{line}");
        assert!(!line.contains('\n') && !line.contains('|'), "{line}");
    }

    #[test]
    fn the_systems_reason_is_told_once() {
        let full = || io::Error::from(io::ErrorKind::StorageFull);
        let told = "a.txt cannot be written: no storage space";
        assert_eq!(
            sentence(&Error::from(full()).context("a.txt cannot be written")),
            told
        );
        let own = unic_io::Error::Io {
            path: "a.txt".into(),
            action: "write",
            source: full(),
        };
        assert_eq!(sentence(&own.into()), "a.txt: cannot write: no storage space");
    }

    #[test]
    fn exit_codes_follow_the_cause_wherever_it_sits() {
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
