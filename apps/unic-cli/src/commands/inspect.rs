//! `unic inspect`.

use crate::{args::InspectArgs, model_file, output};
use anyhow::{Result, bail};
use unic_io::inspect::{Kind, Report};

/// Prints what is there; an error where something is wrong with it.
pub(crate) fn run(args: &InspectArgs) -> Result<()> {
    let mut report = unic_io::inspect(&args.path)?;
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

/// The report reads a model's header alone; a model that opens is one that runs.
fn open_model(report: &mut Report) {
    match model_file::read(&report.path) {
        Ok(model) => {
            let mut fact = |name: &str, value: usize| report.facts.push((name.to_owned(), value.to_string()));
            fact("parameters", model.parameter_count());
            fact("garment vertices", model.vertex_count());
            fact("body vertices", model.character().body.vertices.len());
            fact("joints", model.character().skeleton.len());
        }
        Err(error) => report.problems.push(error.to_string()),
    }
}
