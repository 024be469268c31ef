//! Ctrl-C and SIGTERM: the first signal asks the program to stop, the second ends it at once.
//!
//! Commands call [`check`] in their loops and stop in an orderly way. If that takes longer than
//! `PATIENCE`, the program removes its temporary files and ends, unless a `SaveGuard` is alive.

use crate::{failure, failure::Interrupted, invocation, output::print_status};
use anyhow::{Context, Result};
use std::{
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
    time::Duration,
};
use unic_train::Control;

static REQUESTED: AtomicBool = AtomicBool::new(false);
// A count, because guards may be nested.
static SAVING: AtomicUsize = AtomicUsize::new(0);

/// Time that a command has to stop by itself.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Installs the handler of both signals.
///
/// # Errors
/// A handler that cannot be installed.
pub(crate) fn install_handler() -> Result<()> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            end();
        }
        print_status(&format!(
            "{}: stopping; once more to stop at once",
            invocation::name()
        ));
        // The handler must return, so that a second signal can be received.
        thread::spawn(end_after_patience);
    })
    .context("the handler of Ctrl-C cannot be installed")
}

fn end_after_patience() {
    thread::sleep(PATIENCE);
    while SAVING.load(Ordering::SeqCst) > 0 {
        thread::sleep(PATIENCE / 100);
    }
    end();
}

fn end() -> ! {
    // Other threads still run, and `exit` calls no destructors: temporary files are removed by a
    // list.
    unic_io::atomic::remove_temporary();
    failure::report(&interrupted().into());
    std::process::exit(failure::INTERRUPTED.into());
}

/// Guard of work whose result would be lost, mainly a training. As long as it lives, the program
/// ends only after the work has stopped by itself or after a second signal.
#[derive(Debug)]
pub(crate) struct SaveGuard(());

/// Begins work that must be saved, which lasts as long as the returned guard.
pub(crate) fn begin_saving() -> SaveGuard {
    SAVING.fetch_add(1, Ordering::SeqCst);
    SaveGuard(())
}

impl Drop for SaveGuard {
    fn drop(&mut self) {
        SAVING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Has a signal asked the program to stop?
pub(crate) fn is_requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Answer to a training that asks whether to continue.
pub fn control() -> Control {
    match is_requested() {
        true => Control::Stop,
        false => Control::Continue,
    }
}

/// Returns an error if a signal has asked the program to stop, for work without anything to save.
///
/// # Errors
/// [`Interrupted`] after a signal.
pub fn check() -> Result<(), Interrupted> {
    match is_requested() {
        true => Err(interrupted()),
        false => Ok(()),
    }
}

/// The failure of interrupted work without anything to save.
pub(crate) fn interrupted() -> Interrupted {
    Interrupted("interrupted; no unfinished file is left behind".into())
}
