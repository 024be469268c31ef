//! The command `unic eval`: measures a model beside the baselines, with pictures and a report.
//!
//! A row is one predictor, the model or a baseline. All rows run over the same clips, and listeners
//! draw pictures and gather the report from their frames while they run.

mod frame_comparison;
mod gallery;
mod listener;
mod outputs;
mod protocol;
mod report;
mod training_overlap;

use crate::{
    args::EvalArgs,
    failure::Usage,
    model_file,
    output::{print, print_json, print_status},
    timing::Timing,
};
use anyhow::{Result, bail};
use listener::EvaluationListener;
use serde::Serialize;
use std::collections::HashSet;
use training_overlap::TrainingOverlap;
use unic_core::{Animator, CodeSampling, IntersectionMode, Precision};
use unic_eval::{
    CONTROL, CodeCertainty, ControlPredictor, Evaluation, Event, IntersectionHandler, ModelPredictor,
    NamedPredictor, PRIOR, PriorPredictor, Protocol, baselines, evaluate_by, training_set,
};
use unic_io::{Capture, Split};

/// Measures and prints the results.
///
/// # Errors
/// Unusable options or inputs, files that cannot be read or written, an interruption.
pub(crate) fn run(args: &EvalArgs) -> Result<()> {
    print_results(args, &measure(args)?)
}

/// Measures and writes pictures, positions and the report. Prints nothing but progress.
fn measure(args: &EvalArgs) -> Result<Measurements> {
    if args.baselines && args.code.gumbel.is_some() {
        return Err(Usage("expected a model for --gumbel, found --baselines".to_owned()).into());
    }
    // Outputs are checked in two steps: those named after clips are known once the capture is open.
    outputs::check(args)?;
    let capture = protocol::capture(args)?;
    let clips = clip_names(args, &capture)?;
    outputs::check_clips(args, &clips)?;
    let animator = match &args.model {
        Some(path) => {
            let model = args.precision.apply(model_file::read_fitting(path, &capture)?);
            let mut animator = model_file::animator_of(model, args.intersection);
            animator.set_code_sampling(args.code.sampling());
            Some(animator)
        }
        None => None,
    };
    args.force.check_capture(&capture)?;
    let handler = IntersectionHandler::new(
        handling(args, animator.as_ref()),
        &capture.character,
        &capture.garment,
    );
    // The baseline beside the model in movies: the strongest one, with the model's handling if it
    // has any, so that the pictures compare like with like.
    let rival = match handler {
        Some(_) => baselines::RIDGE_HANDLED,
        None => baselines::RIDGE,
    };
    let control = control(args, &capture, &clips)?;
    let protocol = Protocol {
        nearest_every: args.nearest_every,
        ..args.protocol.map_or_else(Protocol::default, protocol::of)
    };
    let mut listener = EvaluationListener::new(args, &protocol, &capture, &clips, rival)?;
    let mut rows = rows(&capture, animator.as_ref(), handler)?;
    rows.extend(control.map(|control| NamedPredictor::baseline(CONTROL, control)));
    let mut listen = |event: &Event| listener.listen(event);
    let evaluation = evaluate_by(&protocol, &capture, &mut rows, &clips, &mut listen)?;
    let recorder = listener.into_recorder();
    // Timed after the evaluation, in which the rows compete for the cores.
    let timing = match &animator {
        Some(animator) => Some(Timing::measure(animator.clone(), &capture, &clips)?),
        None => None,
    };
    let code = match &animator {
        Some(animator) => CodeCertainty::of_clips(animator.model(), &capture, &clips)?,
        None => None,
    };
    let overlap = TrainingOverlap::of(&capture, animator.as_ref().map(|a| &**a.model()), &clips);
    let measured = Measurements {
        evaluation,
        timing,
        code,
        precision: animator.as_ref().map(|animator| animator.model().precision()),
        caveats: overlap.caveats(),
    };
    if let (Some(recorder), Some(animator), Some(path)) = (recorder, &animator, &args.model) {
        let bytes = recorder.finish(animator.model(), path, &measured)?;
        print_status(&format!("the report has {:.1} MB", bytes as f64 / 1e6));
    }
    Ok(measured)
}

/// Results of an evaluation.
struct Measurements {
    /// Metrics of all rows.
    evaluation: Evaluation,
    /// Time of a frame of the model. `None` with `--baselines`.
    timing: Option<Timing>,
    /// Certainty of the model's motion code on these clips. `None` without a model or a code.
    code: Option<CodeCertainty>,
    /// Precision of the model's networks. `None` with `--baselines`.
    precision: Option<Precision>,
    /// Reasons why the errors may be smaller than on unseen motion, a sentence each.
    caveats: Vec<String>,
}

/// Intersection handling of the row `ridge_handled`: that of the model, or that of the option.
fn handling(args: &EvalArgs, animator: Option<&Animator>) -> IntersectionMode {
    match (animator, args.intersection) {
        (Some(animator), _) => animator.intersection(),
        (None, Some(name)) => model_file::usual_intersection(name),
        (None, None) => IntersectionMode::Off,
    }
}

/// Names of the clips to measure on.
///
/// # Errors
/// A split without clips.
fn clip_names(args: &EvalArgs, capture: &Capture) -> Result<Vec<String>> {
    let split = Split::from(args.split);
    let names = match args.clips.as_slice() {
        [] => capture.clip_names(split).to_vec(),
        // A clip that is named twice is measured once: results and files go by its name.
        named => {
            let mut seen = HashSet::new();
            named.iter().filter(|name| seen.insert(*name)).cloned().collect()
        }
    };
    if names.is_empty() {
        let path = args.capture.join("capture.toml");
        bail!(
            "{}: expected clips in [splits] {}, found none",
            path.display(),
            split.name()
        );
    }
    Ok(names)
}

/// Second simulation of the measured clips, of `--control`.
///
/// # Errors
/// A capture that cannot be read, or of another garment or motion.
fn control(args: &EvalArgs, capture: &Capture, clips: &[String]) -> Result<Option<ControlPredictor>> {
    let Some(path) = &args.control else {
        return Ok(None);
    };
    let control = Capture::open(path)?;
    Ok(Some(ControlPredictor::new(control, capture, clips)?))
}

fn rows(
    capture: &Capture,
    animator: Option<&Animator>,
    handler: Option<IntersectionHandler>,
) -> Result<Vec<NamedPredictor>> {
    let mut rows = Vec::new();
    if let Some(animator) = animator {
        rows.push(NamedPredictor::model(ModelPredictor::from_animator(
            animator.clone(),
        )));
        let prior = PriorPredictor::new(animator)?;
        rows.extend(prior.map(|prior| NamedPredictor::baseline(PRIOR, prior)));
    }
    let set = training_set(capture)?;
    print_status("fitting the baselines on the training clips");
    rows.extend(baselines::fit_with(&set, handler));
    Ok(rows)
}

/// Object that `--json` prints: the keys of the evaluation, `timing` and `code` of a model, and
/// `caveats` if there are any. The field names are a contract.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    evaluation: &'a Evaluation,
    #[serde(skip_serializing_if = "Option::is_none")]
    protocol: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    timing: Option<Timing>,
    #[serde(skip_serializing_if = "Option::is_none")]
    code: Option<CodeCertainty>,
    /// Precision of the model's networks.
    #[serde(skip_serializing_if = "Option::is_none")]
    precision: Option<&'static str>,
    /// Choice of the categories of the model's motion code.
    #[serde(skip_serializing_if = "Option::is_none")]
    code_sampling: Option<CodeSampling>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    caveats: &'a [String],
}

fn print_results(args: &EvalArgs, measured: &Measurements) -> Result<()> {
    let Measurements {
        evaluation,
        timing,
        code,
        precision,
        caveats,
    } = measured;
    let (timing, code) = (*timing, *code);
    if args.json {
        let protocol = args.protocol.map(protocol::name);
        return print_json(&Output {
            evaluation,
            protocol,
            timing,
            code,
            precision: precision.map(Precision::name),
            code_sampling: args.model.is_some().then(|| args.code.sampling()),
            caveats,
        });
    }
    let timing = timing.map_or_else(String::new, |Timing { frame_ms, threads }| {
        let precision = precision.unwrap_or_default().name();
        format!("a frame of the model takes {frame_ms:.2} ms (median, threads: {threads}, {precision})\n")
    });
    let code = code.map_or_else(String::new, |code| {
        format!("mean top probability of the motion code: {code}\n")
    });
    let headline = args.protocol.map(|name| protocol::headline(name, evaluation));
    let caveats: String = caveats.iter().map(|text| format!("{text}\n")).collect();
    print(&format!(
        "{evaluation}{}{code}{timing}{caveats}",
        headline.unwrap_or_default()
    ))
}
