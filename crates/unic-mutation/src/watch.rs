//! Ends a program whose reader never does.

use std::{
    io::Write,
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread,
    time::Duration,
};

/// A thread cannot be stopped from outside: a reader that takes this long ends the program.
const LONGEST: Duration = Duration::from_secs(60);

/// Looks on while files are read; stops when it is dropped.
pub(super) struct Watch(Sender<String>);

impl Watch {
    pub(super) fn start(reader: String) -> Self {
        let (sender, labels) = channel::<String>();
        thread::spawn(move || {
            let mut label = String::new();
            loop {
                match labels.recv_timeout(LONGEST) {
                    Ok(next) => label = next,
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => end(&reader, &label),
                }
            }
        });
        Self(sender)
    }

    /// Another file is read from now on.
    pub(super) fn begin(&self, label: &str) {
        // The thread listens for as long as this lives.
        let _ = self.0.send(label.to_owned());
    }
}

fn end(reader: &str, label: &str) -> ! {
    // Past the capture of a test's output, which is lost with the process.
    let text = format!("{reader}, {label}: not read within {LONGEST:?}\n");
    let _ = std::io::stderr().write_all(text.as_bytes());
    std::process::abort()
}
