//! Measuring rows on a capture's test clips.

use crate::{interrupt, output::say, progress::Progress};
use anyhow::{Result, anyhow};
use std::{fs, num::NonZeroUsize, path::Path};
use unic_eval::{Evaluation, Event, Mode, Row, baselines, evaluate_sampled, training_set};
use unic_io::{Capture, Split, atomic};

/// Nearest points are looked for in every fifth frame: what hangs on them changes by less than a
/// hundredth, and a table takes a third of the time.
const NEAREST_EVERY: NonZeroUsize = NonZeroUsize::new(5).unwrap();

/// Of all baselines, kept in `folder`: they depend on the capture alone.
pub(super) fn baselines(capture: &Capture, folder: &Path) -> Result<Evaluation> {
    let path = folder.join("baselines.json");
    if let Ok(text) = fs::read_to_string(&path) {
        return serde_json::from_str(&text).map_err(|e| anyhow!("{}: {e}", path.display()));
    }
    say(&format!("{}: fitting the baselines", capture.manifest.name));
    let mut rows = baselines::fit(&training_set(capture)?);
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
