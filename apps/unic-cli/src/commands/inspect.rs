//! `unic inspect`.

use crate::{
    args::InspectArgs,
    failure::Usage,
    model_file, motion_file,
    output::{self, say},
};
use anyhow::{Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use unic_core::{config::LatentCode, model::Model};
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
        open_model(&mut report);
    }
    match args.json {
        true => output::print_json(&report)?,
        false => output::print(&report.to_string())?,
    }
    let path = report.path.display().to_string();
    match report.problems.as_slice() {
        [] => Ok(()),
        [problem] if problem.starts_with(&path) => bail!("{problem}"),
        [problem] => bail!("{path}: {problem}"),
        [first, rest @ ..] => bail!("{path}: {first}; and {} more", rest.len()),
    }
}

/// Facts about the motion's code: its size, its kind, and how far the training motions decided it.
fn code_facts(model: &Model) -> Vec<(String, String)> {
    let encoder = &model.config().encoder;
    let code = match encoder.code {
        LatentCode::PickedLogit => "picked logits",
        LatentCode::OneHot => "one-hot",
    };
    let sizes = format!(
        "{} channels of {} categories, {code}",
        encoder.channels, encoder.categories
    );
    let certainty = model_file::code_certainty(model).unwrap_or_else(|| "not told by this file".to_owned());
    vec![
        ("motion code".to_owned(), sizes),
        ("mean top probability".to_owned(), certainty),
    ]
}

/// The report reads a model's header and checksum; a model that opens is one that runs.
fn open_model(report: &mut Report) {
    match model_file::read(&report.path) {
        Ok(model) => {
            let mut fact = |name: &str, value: usize| report.facts.push((name.to_owned(), value.to_string()));
            fact("parameters", model.parameter_count());
            fact("garment vertices", model.vertex_count());
            fact("body vertices", model.character().body.vertices.len());
            fact("joints", model.character().skeleton.len());
            report.facts.extend(code_facts(&model));
        }
        Err(error) => report.problems.push(error.to_string()),
    }
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
    let coverage = Coverage::of(&capture)?;
    let clips = match motions {
        [] => capture_clips(&capture, Split::Test)?,
        _ => {
            let fps = capture.manifest.fps;
            let read = |path: &PathBuf| motion_file::read(path, &capture.character, fps, &args.reading);
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
