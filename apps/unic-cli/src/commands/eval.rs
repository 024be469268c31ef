//! `unic eval`.

mod gallery;
mod knowledge;
mod listener;
mod moment;
mod outputs;
mod protocol;
mod report;
pub(crate) mod timing;

use crate::{
    args::{EvalArgs, IntersectionName},
    failure::Usage,
    model_file,
    output::{print, print_json, say},
};
use anyhow::{Result, bail};
use knowledge::Knowledge;
use listener::Listener;
use serde::Serialize;
use std::{collections::HashSet, path::Path, sync::Arc};
use timing::Timing;
use unic_core::{animator::Animator, config::IntersectionMode, model::Model, network::CodeSampling};
use unic_eval::{
    CodeCertainty, Evaluation, Event, Handler, ModelPredictor, PRIOR, PriorPredictor, Protocol, Row,
    baselines, evaluate_by, training_set,
};
use unic_io::{Capture, Split};

/// Evaluates and prints.
pub(crate) fn run(args: &EvalArgs) -> Result<()> {
    show(args, &measure(args)?)
}

/// Evaluates and writes what is asked for, and prints nothing but progress.
fn measure(args: &EvalArgs) -> Result<Measured> {
    if args.baselines && args.code.gumbel.is_some() {
        return Err(Usage("expected a model for --gumbel, found --baselines".to_owned()).into());
    }
    outputs::check(args)?;
    let capture = protocol::capture(args)?;
    let clips = clip_names(args, &capture)?;
    outputs::check_clips(args, &clips)?;
    let animator = match &args.model {
        Some(path) => {
            let mut animator = animator(path, args.intersection, &capture)?;
            animator.set_code_sampling(args.code.sampling());
            Some(animator)
        }
        None => None,
    };
    args.force.capture(&capture)?;
    let handler = Handler::new(
        handling(args, animator.as_ref()),
        &capture.character,
        &capture.garment,
    );
    let rival = match handler {
        Some(_) => baselines::RIDGE_HANDLED,
        None => baselines::RIDGE,
    };
    let mut listener = Listener::new(args, &capture, &clips, rival)?;
    let mut rows = rows(&capture, animator.as_ref(), handler)?;
    let mut listen = |event: &Event| listener.listen(event);
    let protocol = args.protocol.map_or_else(Protocol::default, protocol::of);
    let every = args.nearest_every;
    let evaluation = evaluate_by(&protocol, &capture, &mut rows, &clips, every, &mut listen)?;
    let recorder = listener.into_recorder();
    let timing = match &animator {
        Some(animator) => Some(Timing::measure(animator.clone(), &capture, &clips)?),
        None => None,
    };
    let code = match &animator {
        Some(animator) => CodeCertainty::of_clips(animator.model(), &capture, &clips)?,
        None => None,
    };
    let measured = Measured {
        evaluation,
        timing,
        code,
        caveats: Knowledge::of(&capture, animator.as_ref().map(|a| &**a.model()), &clips).caveats(),
    };
    if let (Some(recorder), Some(animator), Some(path)) = (recorder, &animator, &args.model) {
        let bytes = recorder.finish(animator.model(), path, &measured)?;
        say(&format!("the report has {:.1} MB", bytes as f64 / 1e6));
    }
    Ok(measured)
}

/// What an evaluation has found.
struct Measured {
    /// All numbers.
    evaluation: Evaluation,
    /// Of the model, where there is one.
    timing: Option<Timing>,
    /// How far the clips decide the model's code.
    code: Option<CodeCertainty>,
    /// Why the numbers may be better than those of unseen motion.
    caveats: Vec<String>,
}

/// The intersection handling that ridge regression is shown with: the model's, or without one what is asked for.
fn handling(args: &EvalArgs, animator: Option<&Animator>) -> IntersectionMode {
    match (animator, args.intersection) {
        (Some(animator), _) => animator.intersection(),
        (None, Some(name)) => model_file::usual_intersection(name),
        (None, None) => IntersectionMode::Off,
    }
}

fn clip_names(args: &EvalArgs, capture: &Capture) -> Result<Vec<String>> {
    let split = Split::from(args.split);
    let names = match args.clips.as_slice() {
        [] => capture.clip_names(split).to_vec(),
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

/// Of a model that fits the capture.
pub(crate) fn animator(
    path: &Path,
    intersection: Option<IntersectionName>,
    capture: &Capture,
) -> Result<Animator> {
    let model = Arc::new(model_file::read(path)?);
    check_fit(&model, path, capture)?;
    let mode = intersection.map(|name| model_file::intersection(&model, name));
    let mut animator = Animator::new(model);
    if let Some(mode) = mode {
        animator.set_intersection(mode);
    }
    Ok(animator)
}

/// The same garment, character and frame rate, by their counts.
fn check_fit(model: &Model, path: &Path, capture: &Capture) -> Result<()> {
    let (garment, skeleton) = (&capture.garment.rest, &capture.character.skeleton);
    let counts = [
        ("garment vertices", garment.vertices.len(), model.vertex_count()),
        ("joints", skeleton.len(), model.character().skeleton.len()),
    ];
    let capture_path = capture.root.display();
    if let Some((what, expected, found)) = counts.into_iter().find(|(_, expected, found)| expected != found) {
        bail!(
            "{}: expected a model of {expected} {what} as in {capture_path}, found {found}",
            path.display()
        );
    }
    let [expected, found] = [skeleton, &model.character().skeleton].map(|skeleton| skeleton.names());
    // Other spellings are no other order.
    let is_elsewhere = |(joint, (a, b)): &(usize, (&String, &String))| {
        a != b && (expected.iter().enumerate()).any(|(place, name)| name == *b && place != *joint)
    };
    if let Some((_, (expected, found))) = expected.iter().zip(found).enumerate().find(is_elsewhere) {
        bail!(
            "{}: expected joints in the order of {capture_path}, found {found} in the place of {expected}: probably \
             a model of another export of the character; train it on this capture",
            path.display()
        );
    }
    let (expected, found) = (capture.manifest.fps, model.config().fps);
    if (expected - found).abs() > 1e-3 * expected {
        bail!(
            "{}: expected a model for {expected} fps as in {capture_path}, found {found}",
            path.display()
        );
    }
    Ok(())
}

fn rows(capture: &Capture, animator: Option<&Animator>, handler: Option<Handler>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    if let Some(animator) = animator {
        rows.push(Row::model(ModelPredictor::from_animator(animator.clone())));
        let prior = PriorPredictor::new(animator)?;
        rows.extend(prior.map(|prior| Row::baseline(PRIOR, prior)));
    }
    let set = training_set(capture)?;
    say("fitting the baselines on the training clips");
    rows.extend(baselines::fit_with(&set, handler));
    Ok(rows)
}

/// The JSON contract: the evaluation's own keys, `timing` and `code` where there is a model, and `caveats` where
/// there are any.
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
    /// How the model picked its code's categories.
    #[serde(skip_serializing_if = "Option::is_none")]
    code_sampling: Option<CodeSampling>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    caveats: &'a [String],
}

fn show(args: &EvalArgs, measured: &Measured) -> Result<()> {
    let Measured {
        evaluation,
        timing,
        code,
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
            code_sampling: args.model.is_some().then(|| args.code.sampling()),
            caveats,
        });
    }
    let timing = timing.map_or_else(String::new, |Timing { frame_ms, threads }| {
        format!("a frame of the model takes {frame_ms:.2} ms (median, threads: {threads})\n")
    });
    let code = code.map_or_else(String::new, |code| {
        format!("mean top probability of the motion's code: {code}\n")
    });
    let headline = args.protocol.map(|name| protocol::headline(name, evaluation));
    let caveats: String = caveats.iter().map(|text| format!("{text}\n")).collect();
    print(&format!(
        "{evaluation}{}{code}{timing}{caveats}",
        headline.unwrap_or_default()
    ))
}
