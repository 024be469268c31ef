//! The process in which FBX and USD files are read: this program once more.

use std::{ffi::OsString, process::Command};
use unic_scene::guard;

/// First word of the command line of that process. No command has such a name, so that help and
/// completions do not list it.
const WORD: &str = "@read-scene";

/// Reads the file that the parent process names, if this process is for that. Returns the exit code.
pub(crate) fn serve(words: &[OsString]) -> Option<u8> {
    (words.get(1)? == WORD).then(guard::serve)
}

/// Lets files be read by processes of this program. Where its path is not known, as after it has been
/// deleted, they are read in this process.
pub(crate) fn use_own_program() {
    if let Ok(program) = std::env::current_exe() {
        guard::use_child(move || {
            let mut command = Command::new(&program);
            command.arg(WORD);
            command
        });
    }
}
