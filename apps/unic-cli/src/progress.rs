//! Progress on stderr: a bar on a terminal, lines at intervals in a log. Both show the time left.

use crate::output::print_status;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::{
    io::{IsTerminal, stderr},
    time::{Duration, Instant},
};

/// Interval between lines of progress in a log.
const LINE_INTERVAL: Duration = Duration::from_secs(15);

/// Progress of work with a known length.
pub struct Progress {
    display: Display,
}

/// Form of the progress on stderr.
enum Display {
    /// Bar on a terminal.
    Bar(ProgressBar),
    /// Lines of a log.
    Lines(Lines),
}

impl Progress {
    /// Starts the progress at `done` of `total` units.
    pub fn new(title: &str, done: u64, total: u64) -> Self {
        let display = match stderr().is_terminal() {
            true => Display::Bar(bar(title, done, total)),
            false => Display::Lines(Lines::new(title, done, total)),
        };
        Self { display }
    }

    /// Sets the number of units done. `message` is called only when it is shown.
    pub fn set(&mut self, done: u64, message: impl Fn() -> String) {
        match &mut self.display {
            Display::Bar(bar) => {
                bar.set_position(done);
                bar.set_message(message());
            }
            Display::Lines(lines) if lines.last.elapsed() >= LINE_INTERVAL => {
                lines.last = Instant::now();
                lines.write(done, &message());
            }
            Display::Lines(_) => {}
        }
    }

    /// Writes a line to a log at once. A bar shows its messages with [`Progress::set`].
    pub(crate) fn log(&self, done: u64, message: &str) {
        if let Display::Lines(lines) = &self.display {
            lines.write(done, message);
        }
    }
}

impl Drop for Progress {
    /// Removes the bar, so that later output begins on an empty line.
    fn drop(&mut self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

fn bar(title: &str, done: u64, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total)
        .with_prefix(title.to_owned())
        .with_position(done);
    let template = "{prefix} {wide_bar:.cyan/dim} {pos}/{len}  {msg}  {eta} left";
    // With a wrong template the bar keeps its default style.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    // Units of an earlier run took no time in this one.
    bar.reset_eta();
    bar
}

/// Progress in the lines of a log.
struct Lines {
    title: String,
    /// Number of units that an earlier run has done.
    first: u64,
    total: u64,
    started: Instant,
    /// Time of the last line.
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
        // The rate is that of this run: units of an earlier run took none of its time.
        let left = time_left(
            self.started.elapsed(),
            done.saturating_sub(self.first),
            self.total.saturating_sub(done),
        );
        let left = left.map_or_else(String::new, |left| format!("  {} left", HumanDuration(left)));
        print_status(&format!("{} {done}/{}  {message}{left}", self.title, self.total));
    }
}

/// Time left at the mean rate so far. `None` at the beginning and at the end.
fn time_left(elapsed: Duration, done: u64, to_do: u64) -> Option<Duration> {
    (done > 0 && to_do > 0).then(|| elapsed.mul_f64(to_do as f64 / done as f64))
}
