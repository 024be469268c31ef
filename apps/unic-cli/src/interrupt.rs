//! Ctrl-C and SIGTERM: the first asks the program to save and stop, the second ends it at once.
//!
//! Work asks [`check`] now and then. Where it does not for [`PATIENCE`], the program ends all the same, without its
//! temporary files, unless it is [`saving`].

use crate::{failure, failure::Interrupted, output::say};
use anyhow::{Context, Result};
use std::{
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
    time::Duration,
};
use unic_train::Control;

static ASKED: AtomicBool = AtomicBool::new(false);
static SAVING: AtomicUsize = AtomicUsize::new(0);

/// Time for the program to come to its end by itself.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Listens from here on.
pub(crate) fn listen() -> Result<()> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            end();
        }
        say("unic: stopping; once more to stop at once");
        thread::spawn(end_after_patience);
    })
    .context("Ctrl-C cannot be listened to")
}

fn end_after_patience() {
    thread::sleep(PATIENCE);
    while SAVING.load(Ordering::SeqCst) > 0 {
        thread::sleep(PATIENCE / 100);
    }
    end();
}

fn end() -> ! {
    unic_io::atomic::remove_temporary();
    failure::tell(&interrupted().into());
    std::process::exit(failure::INTERRUPTED.into());
}

/// Work whose result would be lost, a training's above all: as long as this lives, only the second signal ends the
/// program.
#[derive(Debug)]
pub(crate) struct Saving(());

/// From here on, see [`Saving`].
pub(crate) fn saving() -> Saving {
    SAVING.fetch_add(1, Ordering::SeqCst);
    Saving(())
}

impl Drop for Saving {
    fn drop(&mut self) {
        SAVING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Has anyone asked to stop?
pub(crate) fn is_asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// What a training that asks is told.
pub(crate) fn control() -> Control {
    match is_asked() {
        true => Control::Stop,
        false => Control::Continue,
    }
}

/// An error once somebody has asked to stop: for work that leaves nothing to save.
pub(crate) fn check() -> Result<(), Interrupted> {
    match is_asked() {
        true => Err(interrupted()),
        false => Ok(()),
    }
}

fn interrupted() -> Interrupted {
    Interrupted("interrupted; no unfinished file is left behind".into())
}
