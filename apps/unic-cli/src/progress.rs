//! Progress on stderr: a bar with time left on a terminal, a line now and then elsewhere.

use crate::output::say;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::{
    io::{IsTerminal, stderr},
    time::{Duration, Instant},
};

/// Between lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(15);

/// Work with a known length.
pub(crate) enum Progress {
    /// On a terminal.
    Bar(ProgressBar),
    /// In a log.
    Lines(Lines),
}

impl Progress {
    /// Starts at `done` of `total`.
    pub(crate) fn new(title: &str, done: u64, total: u64) -> Self {
        match stderr().is_terminal() {
            true => Self::Bar(bar(title, done, total)),
            false => Self::Lines(Lines::new(title, done, total)),
        }
    }

    /// `done` units are done; `message` is made only when it is shown.
    pub(crate) fn set(&mut self, done: u64, message: impl Fn() -> String) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(done);
                bar.set_message(message());
            }
            Self::Lines(lines) if lines.last.elapsed() >= LINE_INTERVAL => {
                lines.last = Instant::now();
                lines.write(done, &message());
            }
            Self::Lines(_) => {}
        }
    }

    /// Something that a log should hold; a bar shows it in its message already.
    pub(crate) fn log(&self, done: u64, message: &str) {
        if let Self::Lines(lines) = self {
            lines.write(done, message);
        }
    }
}

impl Drop for Progress {
    /// What follows, errors included, finds a clean line.
    fn drop(&mut self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn bar(title: &str, done: u64, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total)
        .with_prefix(title.to_owned())
        .with_position(done);
    let template = "{prefix} {wide_bar:.cyan/dim} {pos}/{len}  {msg}  {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar.reset_eta();
    bar
}

/// Lines of a log.
pub(crate) struct Lines {
    title: String,
    first: u64,
    total: u64,
    started: Instant,
    last: Instant,
}

impl Lines {
    fn new(title: &str, first: u64, total: u64) -> Self {
        let now = Instant::now();
        Self {
            title: title.to_owned(),
            first,
            total,
            started: now,
            last: now,
        }
    }

    fn write(&self, done: u64, message: &str) {
        let left = time_left(
            self.started.elapsed(),
            done.saturating_sub(self.first),
            self.total.saturating_sub(done),
        );
        let left = left.map_or_else(String::new, |left| format!("  {} left", HumanDuration(left)));
        say(&format!("{} {done}/{}  {message}{left}", self.title, self.total));
    }
}

/// At the pace so far.
fn time_left(elapsed: Duration, done: u64, to_do: u64) -> Option<Duration> {
    (done > 0 && to_do > 0).then(|| elapsed.mul_f64(to_do as f64 / done as f64))
}
