//! How the program ends: one sentence on stderr and an exit code.

use crate::output::say;
use anyhow::{Error, Result};
use std::{
    io,
    panic::{self, AssertUnwindSafe},
    process::ExitCode,
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

const FAILED: u8 = 1;
const MISUSED: u8 = 2;
/// 128 + SIGINT, as shells report it.
const INTERRUPTED: u8 = 130;

/// Runs a command, tells why it failed if it did, and gives the exit code.
pub(crate) fn exit_code(command: impl FnOnce() -> Result<()>) -> ExitCode {
    match panic::catch_unwind(AssertUnwindSafe(command)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            say(&format!("unic: {}", sentence(&error)));
            ExitCode::from(code(&error))
        }
        // The hook has told already.
        Err(_) => ExitCode::from(FAILED),
    }
}

fn code(error: &Error) -> u8 {
    // Libraries hand a listener's error back inside their own.
    if error.chain().any(|e| e.is::<Interrupted>()) {
        INTERRUPTED
    } else if error.chain().any(|e| e.is::<Usage>()) {
        MISUSED
    } else {
        FAILED
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
        say(&format!(
            "unic: internal error{place}: {}; please report it",
            one_line(what)
        ));
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
        assert_eq!(code(&anyhow!("a file")), FAILED);
        assert_eq!(code(&Usage("--set".into()).into()), MISUSED);
        let inside = unic_eval::Error::Observer {
            clip: "walk".into(),
            source: Box::new(Interrupted("stopped".into())),
        };
        let error = Error::from(inside);
        assert_eq!(
            (code(&error), sentence(&error).as_str()),
            (INTERRUPTED, "stopped")
        );
    }
}
