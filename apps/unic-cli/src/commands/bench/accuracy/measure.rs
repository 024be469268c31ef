//! Measuring rows on a capture's test clips.

use crate::{args::IntersectionName, interrupt, model_file, output::say, progress::Progress};
use anyhow::{Result, anyhow};
use std::{fs, num::NonZeroUsize, path::Path};
use unic_eval::{
    Evaluation, Event, Handler, Mode, Row,
    baselines::{self, RIDGE_HANDLED},
    evaluate_sampled, training_set,
};
use unic_io::{Capture, Split, atomic};

/// Nearest points are looked for in every fifth frame: what hangs on them changes by less than a
/// hundredth, and a table takes a third of the time.
const NEAREST_EVERY: NonZeroUsize = NonZeroUsize::new(5).unwrap();

/// The evaluation of all baselines, kept in `folder`: they depend on the capture alone. Ridge stands there with intersections handled
/// as preset `standard` handles them, too.
pub(super) fn baselines(capture: &Capture, folder: &Path) -> Result<Evaluation> {
    let path = folder.join("baselines.json");
    if let Ok(text) = fs::read_to_string(&path) {
        let kept: Evaluation = serde_json::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()))?;
        // Others know no handled row: they cost a minute, not a training.
        if kept.pooled.baselines.contains_key(RIDGE_HANDLED) {
            return Ok(kept);
        }
    }
    say(&format!("{}: fitting the baselines", capture.manifest.name));
    let mode = model_file::usual_intersection(IntersectionName::Robust);
    let handler = Handler::new(mode, &capture.character, &capture.garment);
    let mut rows = baselines::fit_with(&training_set(capture)?, handler);
    let evaluation = rows_of(capture, &mut rows)?;
    fs::create_dir_all(folder).map_err(|e| anyhow!("{}: cannot create the folder: {e}", folder.display()))?;
    atomic::write(&path, serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
    Ok(evaluation)
}

/// On all test clips.
pub(super) fn rows_of(capture: &Capture, rows: &mut [Row]) -> Result<Evaluation> {
    let clips = capture.clip_names(Split::Test).to_vec();
    let frames = |name: &String| Ok(capture.summarise_clip(name)?.pose_frames as u64);
    let total: u64 = clips.iter().map(frames).sum::<Result<u64>>()?;
    let mut progress = Progress::new("measuring", 0, 2 * total);
    let (mut clip_name, mut before) = (String::new(), 0);
    let evaluation = evaluate_sampled(capture, rows, &clips, NEAREST_EVERY, &mut |event| {
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

fn words(mode: Mode) -> String {
    mode.name().replace('_', " ")
}
