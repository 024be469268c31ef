//! Watchdog that ends the program if a reader does not return.

use std::{
    io::Write,
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread,
    time::Duration,
};

/// Time after which a reader ends the program: a thread cannot be stopped from outside.
const LONGEST: Duration = Duration::from_secs(60);

/// Thread that watches the time while files are read. It stops when this value is dropped.
pub(super) struct Watchdog(Sender<String>);

impl Watchdog {
    /// Starts the thread.
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

    /// Starts the time again for the next file.
    pub(super) fn begin(&self, label: &str) {
        // Sending cannot fail: the thread receives for as long as this value lives.
        let _ = self.0.send(label.to_owned());
    }
}

/// Prints the file that was being read and aborts the process.
fn end(reader: &str, label: &str) -> ! {
    // Written to the stream itself: output that the test harness captures is lost with the process.
    let text = format!("{reader}, {label}: not read within {LONGEST:?}\n");
    let _ = std::io::stderr().write_all(text.as_bytes());
    std::process::abort()
}
