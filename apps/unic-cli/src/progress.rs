//! Progress on stderr: a bar with time left on a terminal, a line now and then elsewhere.

use crate::output::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::{IsTerminal, stderr},
    time::{Duration, Instant},
};

/// Between lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(15);

/// Work with a known length.
pub(crate) struct Progress {
    title: String,
    total: u64,
    display: Display,
}

enum Display {
    Bar(ProgressBar),
    Lines { last: Instant },
}

impl Progress {
    /// Starts at `done` of `total`.
    pub(crate) fn new(title: &str, done: u64, total: u64) -> Self {
        let display = match stderr().is_terminal() {
            true => Display::Bar(bar(title, done, total)),
            false => Display::Lines { last: Instant::now() },
        };
        Self { title: title.to_owned(), total, display }
    }

    /// `done` units are done; `message` is made only when it is shown.
    pub(crate) fn set(&mut self, done: u64, message: impl Fn() -> String) {
        match &mut self.display {
            Display::Bar(bar) => {
                bar.set_position(done);
                bar.set_message(message());
            }
            Display::Lines { last } if last.elapsed() >= LINE_INTERVAL => {
                *last = Instant::now();
                say(&format!("{} {done}/{}  {}", self.title, self.total, message()).trim_end().to_owned());
            }
            Display::Lines { .. } => {}
        }
    }

    /// A line that stays.
    pub(crate) fn note(&self, line: &str) {
        match &self.display {
            Display::Bar(bar) => bar.suspend(|| say(line)),
            Display::Lines { .. } => say(line),
        }
    }

    /// Notes are for people who have no bar to look at.
    pub(crate) fn has_bar(&self) -> bool {
        matches!(self.display, Display::Bar(_))
    }
}

impl Drop for Progress {
    /// Errors that end the work find a clean line.
    fn drop(&mut self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

fn bar(title: &str, done: u64, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total).with_prefix(title.to_owned()).with_position(done);
    let template = "{prefix} {wide_bar:.cyan/dim} {pos}/{len}  {msg}  {eta} left";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar.reset_eta();
    bar
}
