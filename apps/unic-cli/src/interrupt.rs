//! Ctrl-C and SIGTERM: the first asks the program to save and stop, the second ends it at once.

use crate::{failure::Interrupted, output::say};
use anyhow::{Context, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use unic_train::Control;

static ASKED: AtomicBool = AtomicBool::new(false);

/// Listens from here on.
pub(crate) fn listen() -> Result<()> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        say("unic: stopping; once more to stop at once");
    })
    .context("Ctrl-C cannot be listened to")
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
        true => Err(Interrupted(
            "interrupted; no unfinished file is left behind".into(),
        )),
        false => Ok(()),
    }
}
