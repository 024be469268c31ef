//! Checks of the outputs of `unic eval`, before anything is measured.

use crate::{
    args::EvalArgs,
    failure::Usage,
    outputs::{Existing, Outputs},
};
use anyhow::Result;
use std::path::Path;
use unic_io::capture::OWN_FILES;

/// Refuses outputs that exist or are inputs, as far as their names are known without the capture.
///
/// # Errors
/// A [`Usage`] that names the output or the option.
pub(super) fn check(args: &EvalArgs) -> Result<()> {
    let pages = [
        ("--report", &args.report, "html"),
        ("--movie", &args.movie, "gif"),
    ];
    let mut outputs = beside_inputs(args);
    for (option, path, ending) in pages {
        if let Some(path) = path {
            check_ending(path, option, ending)?;
            outputs = outputs.file(path);
        }
    }
    for folder in [&args.dump, &args.pictures].into_iter().flatten() {
        outputs = outputs.folder(folder, []);
    }
    outputs.check(Existing::of(args.overwrite))?;
    match &args.made {
        // A capture is made once and then measured on: `--overwrite` does not replace it.
        Some(made) => beside_inputs(args)
            .folder(made, OWN_FILES.map(str::to_owned))
            .folder(&made.join("clips"), [])
            .check(Existing::Refused),
        None => Ok(()),
    }
}

/// Refuses files named after clips that exist or are inputs.
///
/// # Errors
/// A [`Usage`] that names the file.
pub(super) fn check_clips(args: &EvalArgs, clips: &[String]) -> Result<()> {
    let mut outputs = beside_inputs(args);
    for (folder, ending) in [(&args.dump, "npz"), (&args.pictures, "png")] {
        if let Some(folder) = folder {
            outputs = outputs.folder(folder, clips.iter().map(|clip| format!("{clip}.{ending}")));
        }
    }
    outputs.check(Existing::of(args.overwrite))
}

fn beside_inputs(args: &EvalArgs) -> Outputs {
    let inputs = [&args.model, &args.character, &args.control]
        .into_iter()
        .flatten();
    Outputs::with_inputs(inputs.chain([&args.capture]))
}

/// Refuses a path with another ending than `ending`.
// Such a path is probably a mistake, as of a model's path given for the report.
fn check_ending(path: &Path, option: &str, ending: &str) -> Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    let path = path.display();
    let text = format!("{option}: expected the name of an .{ending} file to write, found {path}");
    Err(Usage(text).into())
}
