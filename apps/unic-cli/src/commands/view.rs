//! The command `unic view`: models, captures and animations side by side.

mod pictures;
pub(crate) mod sources;

use crate::{args::ViewArgs, failure::Usage};
use anyhow::{Error, Result};
use sources::Reader;
use std::{path::Path, sync::Arc};
use unic_viewer::{Loader, ViewLooks, ViewSession, ViewSettings, ViewerError, view_in_window};

/// Opens the window, or writes a movie or a picture.
///
/// # Errors
/// Unusable options or inputs, no window, an interruption.
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    pictures::check(args)?;
    let is_drawn = args.record.record.is_some() || args.record.screenshot.is_some();
    if args.record.json && !is_drawn {
        let sentence = "--json: expected --record or --screenshot, whose result it prints, found neither";
        return Err(Usage(sentence.into()).into());
    }
    let reader = Reader::new(args)?;
    let mut session = ViewSession::new(reader.read_all(&args.paths)?)?;
    session.quantity = args.show.into();
    session.heat_most_m = args.heat_max * 1e-3;
    session.looks = ViewLooks {
        skin: args.looks.skin(),
        cloth: args.looks.cloth(session.looks.cloth),
    };
    if is_drawn {
        return pictures::run(&args.record, session);
    }
    pictures::aim(&args.record, &mut session, 0.0);
    let opened = view_in_window(ViewSettings {
        title: "unic view".into(),
        session,
        load: loader(reader),
        updates: None,
    });
    opened.map_err(no_window)
}

/// Reader of files that are dropped on the window.
pub(crate) fn loader(reader: Reader) -> Loader {
    Arc::new(move |path: &Path| reader.read(path).map_err(|error| format!("{error:#}")))
}

/// Error of a window. Nothing is wrong with the files where this machine has none.
fn no_window(error: ViewerError) -> Error {
    match error {
        ViewerError::Window(_) => {
            let hint = "`unic view --record FILE.gif` and `--screenshot FILE.png` draw without a window";
            Usage(format!("{error}; {hint}")).into()
        }
        error => error.into(),
    }
}
