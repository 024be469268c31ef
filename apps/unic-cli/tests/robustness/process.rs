//! Programs that are paused, ended and killed while they work.

use super::common::command;
use std::{
    path::Path,
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// Signal, or signals, that end a program.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Signal {
    /// SIGKILL.
    Kill,
    /// SIGINT, as of Ctrl-C.
    Interrupt,
    /// SIGTERM, as of a system that shuts down.
    Terminate,
    /// SIGTERM, then SIGKILL while the program saves.
    TerminateThenKill,
}

/// Program that runs.
pub(crate) struct Running(Child);

impl Running {
    pub(crate) fn start(folder: &Path, line: &str) -> Self {
        let mut command = command(folder, line);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        Self(command.spawn().unwrap())
    }

    pub(crate) fn signal(&self, name: &str) {
        let id = self.0.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &id]).status().unwrap();
        assert!(sent.success());
    }

    /// Waits for `duration`, or until the program ends.
    pub(crate) fn sleep(&mut self, duration: Duration) {
        let started = Instant::now();
        while started.elapsed() < duration && self.is_running() {
            sleep(Duration::from_millis(1));
        }
    }

    /// Waits until a file exists.
    pub(crate) fn wait_for(&mut self, path: &Path) {
        let started = Instant::now();
        while !path.exists() {
            assert!(self.is_running(), "ended without {}", path.display());
            assert!(
                started.elapsed() < Duration::from_secs(120),
                "no {}",
                path.display()
            );
            sleep(Duration::from_millis(1));
        }
    }

    fn is_running(&mut self) -> bool {
        self.0.try_wait().unwrap().is_none()
    }

    /// Ends the program. `None` if it has ended by itself. `patience` is the time before the second
    /// signal.
    pub(crate) fn end(mut self, signal: Signal, patience: Duration) -> Option<Output> {
        if !self.is_running() {
            return None;
        }
        match signal {
            Signal::Kill => self.0.kill().unwrap(),
            Signal::Interrupt => self.signal("INT"),
            Signal::Terminate => self.signal("TERM"),
            Signal::TerminateThenKill => {
                self.signal("TERM");
                self.sleep(patience);
                self.0.kill().unwrap();
            }
        }
        let output = self.finish();
        (!output.status.success()).then_some(output)
    }

    pub(crate) fn finish(self) -> Output {
        self.0.wait_with_output().unwrap()
    }
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
