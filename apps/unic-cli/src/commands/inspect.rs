//! `unic inspect`.

mod model;

use crate::{
    args::InspectArgs,
    checks::ForceArgs,
    failure::{ErrorObject, Shown, Usage},
    motion_file,
    output::{self, say},
};
use anyhow::{Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use unic_eval::{Coverage, CoverageReport, capture_clips};
use unic_io::{
    Capture, Split,
    inspect::{Kind, Report},
};

/// Prints what is there; an error where something is wrong with it.
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
    if report.kind == Kind::Model && report.problems.is_empty() {
        model::open(&mut report);
    }
    let failure = sentence(&report).map(|sentence| anyhow::Error::from(Shown(sentence)));
    match args.json {
        true => output::print_json(&Inspected {
            report: &report,
            error: failure.as_ref().map(ErrorObject::of),
        })?,
        false => output::print(&report.to_string())?,
    }
    failure.map_or(Ok(()), Err)
}

/// The object of `--json`: the report, and an error where something is wrong.
#[derive(Serialize)]
struct Inspected<'a> {
    #[serde(flatten)]
    report: &'a Report,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorObject>,
}

/// All that is wrong in one sentence.
fn sentence(report: &Report) -> Option<String> {
    let path = report.path.display().to_string();
    let [first, rest @ ..] = report.problems.as_slice() else {
        return None;
    };
    let named = match first.starts_with(&path) {
        true => first.clone(),
        false => format!("{path}: {first}"),
    };
    Some(match rest.len() {
        0 => named,
        more => format!("{named}; and {more} more"),
    })
}

/// What `--coverage --json` prints.
#[derive(Serialize)]
struct Covered<'a> {
    capture: &'a Path,
    /// In standard deviations of the training frames; distances below are relative to it.
    seen_distance: f32,
    motions: &'a [CoverageReport],
}

/// Compares motions, or the capture's own test clips, with its training clips.
fn coverage(args: &InspectArgs, path: &Path, motions: &[PathBuf]) -> Result<()> {
    let capture = Capture::open(path)?;
    let force = ForceArgs { force: args.force };
    force.capture(&capture)?;
    let coverage = Coverage::of(&capture)?;
    let clips = match motions {
        [] => capture_clips(&capture, Split::Test)?,
        _ => {
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
        say(&format!(
            "{}: its clips have little in common, so that a motion counts as seen even when it is not much like them",
            path.display()
        ));
    }
    let reports: Vec<CoverageReport> = clips.iter().map(|clip| coverage.assess(clip)).collect();
    if args.json {
        return output::print_json(&Covered {
            capture: path,
            seen_distance: coverage.seen_distance(),
            motions: &reports,
        });
    }
    let texts: Vec<String> = reports.iter().map(ToString::to_string).collect();
    output::print(&texts.join("\n"))
}
