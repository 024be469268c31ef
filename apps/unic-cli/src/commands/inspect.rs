//! The command `unic inspect`: shows what files hold, and compares motions with a capture.

mod model;

use crate::{
    args::InspectArgs,
    checks::ForceArgs,
    failure::{AlreadyPrinted, ErrorObject, Usage},
    motion_file,
    output::{self, print_status},
};
use anyhow::{Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use unic_eval::{Coverage, CoverageReport, capture_clips};
use unic_io::{
    Capture, Split,
    inspect::{FileKind, Inspection},
};

/// Prints the contents of a file or folder, or the coverage of motions by a capture.
///
/// # Errors
/// Problems of the file, which are part of the output too; unusable options or inputs.
pub(crate) fn run(args: &InspectArgs) -> Result<()> {
    match (&args.coverage, args.path.as_slice()) {
        (Some(capture), motions) => coverage(args, capture, motions),
        (None, [path]) => inspect(args, path),
        (None, paths) => {
            let found = paths.len();
            Err(Usage(format!("expected one file or folder to inspect, found {found}")).into())
        }
    }
}

fn inspect(args: &InspectArgs, path: &Path) -> Result<()> {
    let mut report = unic_io::inspect(path)?;
    if report.kind == FileKind::Model && report.problems.is_empty() {
        model::add_facts(&mut report);
    }
    // The output holds the problems, so the failure must not print a second object with `--json`.
    let failure = sentence(&report).map(|sentence| anyhow::Error::from(AlreadyPrinted(sentence)));
    match args.json {
        true => output::print_json(&Inspected {
            report: &report,
            error: failure.as_ref().map(ErrorObject::of),
        })?,
        false => output::print(&report.to_string())?,
    }
    failure.map_or(Ok(()), Err)
}

/// Object that `--json` prints: the inspection, and an error if there are problems.
#[derive(Serialize)]
struct Inspected<'a> {
    #[serde(flatten)]
    report: &'a Inspection,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorObject>,
}

/// First problem of a file and the number of the others, in one sentence. `None` without problems.
fn sentence(report: &Inspection) -> Option<String> {
    let path = report.path.display().to_string();
    let [first, rest @ ..] = report.problems.as_slice() else {
        return None;
    };
    // Some problems name a file inside the folder themselves.
    let named = match first.starts_with(&path) {
        true => first.clone(),
        false => format!("{path}: {first}"),
    };
    Some(match rest.len() {
        0 => named,
        more => format!("{named}; and {more} more"),
    })
}

/// Object that `--coverage --json` prints.
#[derive(Serialize)]
struct CoverageResults<'a> {
    capture: &'a Path,
    /// Distance, in standard deviations of the training frames, within which a frame counts as
    /// seen. The distances of the motions are relative to it.
    seen_distance: f32,
    motions: &'a [CoverageReport],
}

/// Compares motions, or the capture's own test clips, with its training clips.
fn coverage(args: &InspectArgs, path: &Path, motions: &[PathBuf]) -> Result<()> {
    let capture = Capture::open(path)?;
    let force = ForceArgs { force: args.force };
    force.check_capture(&capture)?;
    let coverage = Coverage::of(&capture)?;
    let clips = match motions {
        [] => capture_clips(&capture, Split::Test)?,
        _ => {
            // Velocities are compared, so that motions must have the frame rate of the capture.
            let fps = capture.manifest.fps;
            let read =
                |path: &PathBuf| motion_file::read(path, &capture.character, fps, &args.reading, force);
            motions.iter().map(read).collect::<Result<Vec<_>>>()?
        }
    };
    if clips.is_empty() {
        bail!(
            "{}: expected test clips or motions to compare, found none",
            path.display()
        );
    }
    if coverage.is_sparse() {
        print_status(&format!(
            "{}: the clips have little in common, so that even a motion unlike them counts as seen",
            path.display()
        ));
    }
    let reports: Vec<CoverageReport> = clips.iter().map(|clip| coverage.assess(clip)).collect();
    if args.json {
        return output::print_json(&CoverageResults {
            capture: path,
            seen_distance: coverage.seen_distance(),
            motions: &reports,
        });
    }
    let texts: Vec<String> = reports.iter().map(ToString::to_string).collect();
    output::print(&texts.join("\n"))
}
