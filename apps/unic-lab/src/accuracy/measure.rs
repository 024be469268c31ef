//! Measurement of predictors on the test clips of a capture.

use anyhow::{Result, anyhow};
use std::{fs, num::NonZeroUsize, path::Path};
use unic_cli::{args::IntersectionName, interrupt, model_file, output::print_status, progress::Progress};
use unic_eval::{
    Evaluation, Event, IntersectionHandler, Mode, NamedPredictor, Protocol,
    baselines::{self, RIDGE_HANDLED},
    evaluate_by, training_set,
};
use unic_io::{Capture, Split, atomic};

/// Interval of the frames whose nearest points are searched.
// Metrics of the body change by less than a hundredth, and a table takes a third of the time.
const NEAREST_EVERY: NonZeroUsize = NonZeroUsize::new(5).unwrap();

/// Returns the evaluation of all baselines. It is stored in `folder`, because it depends on the
/// capture alone.
///
/// Ridge regression is among them also with the intersection handling of preset `standard`.
pub(super) fn baselines(capture: &Capture, folder: &Path) -> Result<Evaluation> {
    let path = folder.join("baselines.json");
    if let Ok(text) = fs::read_to_string(&path) {
        let kept: Evaluation = serde_json::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()))?;
        // Files without this baseline are measured again, which takes a minute.
        if kept.pooled.baselines.contains_key(RIDGE_HANDLED) {
            return Ok(kept);
        }
    }
    print_status(&format!("{}: fitting the baselines", capture.manifest.name));
    let mode = model_file::usual_intersection(IntersectionName::Robust);
    // Without handling, no baseline tries to keep vertices out of the body.
    let handler = IntersectionHandler::new(mode, &capture.character, &capture.garment);
    let mut predictors = baselines::fit_with(&training_set(capture)?, handler);
    let evaluation = on_test_clips(capture, &mut predictors)?;
    fs::create_dir_all(folder).map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
    atomic::write(&path, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
    Ok(evaluation)
}

/// Measures predictors on all test clips.
pub(super) fn on_test_clips(capture: &Capture, predictors: &mut [NamedPredictor]) -> Result<Evaluation> {
    let clips = capture.clip_names(Split::Test).to_vec();
    let frames = |name: &String| Ok(capture.summarise_clip(name)?.pose_frames as u64);
    let total: u64 = clips.iter().map(frames).sum::<Result<u64>>()?;
    let mut progress = Progress::new("measuring", 0, 2 * total);
    let protocol = Protocol {
        nearest_every: NEAREST_EVERY,
        ..Protocol::default()
    };
    let (mut clip_name, mut before) = (String::new(), 0);
    let evaluation = evaluate_by(&protocol, capture, predictors, &clips, &mut |event| {
        interrupt::check()?;
        match *event {
            Event::ClipStarted { clip, .. } => clip_name = clip.name().to_owned(),
            Event::Progress { mode, done, total } => {
                progress.set(before + done as u64, || format!("{clip_name} {}", words(mode)));
                before += if done == total { total as u64 } else { 0 };
            }
            Event::Predicted { .. } | Event::ClipFinished => {}
        }
        Ok(())
    })?;
    Ok(evaluation)
}

/// Returns a mode in words.
fn words(mode: Mode) -> String {
    mode.name().replace('_', " ")
}
