//! Name and command line of the program that runs, for messages and logs.

use std::{ffi::OsString, sync::OnceLock};

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

/// Remembers the program and its command line. Later calls change nothing.
pub(crate) fn set(name: &'static str, words: &[OsString]) {
    INVOCATION.get_or_init(|| Invocation::new(name, words));
}

/// Returns the name of the program that runs.
pub(crate) fn name() -> &'static str {
    INVOCATION.get().map_or("unic", |invocation| invocation.name)
}

/// Returns the command line of the program that runs.
pub(crate) fn command_line() -> &'static str {
    INVOCATION.get().map_or("", |invocation| &invocation.command_line)
}
