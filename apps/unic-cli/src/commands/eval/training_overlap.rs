//! Overlap of the clips that are measured with those that the training has used.

use serde::Deserialize;
use unic_core::Model;
use unic_io::{Capture, Split};

/// Largest number of clips that a sentence lists by name.
const MOST_NAMES: usize = 6;

/// Clips that are measured, by the use that the training has made of them.
pub(super) struct TrainingOverlap {
    /// Number of clips that are measured.
    clips: usize,
    /// Measured clips that the training has fitted.
    trained: Vec<String>,
    /// Other measured clips on which the training has validated.
    validated: Vec<String>,
    /// Clips on which the model was validated although it was trained on them.
    trained_and_validated: Vec<String>,
}

/// Part of the model file's record of its training. All of it is optional.
#[derive(Default, Deserialize)]
#[serde(default)]
struct TrainingRecord {
    training_clips: Vec<String>,
    validation: Option<ValidationRecord>,
}

/// Validation in a [`TrainingRecord`].
#[derive(Default, Deserialize)]
#[serde(default)]
struct ValidationRecord {
    clips: Vec<String>,
    motion: String,
}

impl TrainingOverlap {
    /// Finds the overlap of `clips` with the splits of the capture and the training of the model.
    ///
    /// The splits count even without a model, because the baselines are fitted on them.
    pub(super) fn of(capture: &Capture, model: Option<&Model>, clips: &[String]) -> Self {
        // Models of other programs may have another record, or none.
        let record: TrainingRecord = model
            .and_then(|model| serde_json::from_value(model.about().training.clone()).ok())
            .unwrap_or_default();
        let validation = record.validation.unwrap_or_default();
        // Clips go by name alone, which means the same motion only in the capture of the training.
        let is_same = model.is_some_and(|model| model.about().name == capture.manifest.name);
        let is_in = |clip: &String, split: Split, recorded: &[String]| {
            capture.clip_names(split).contains(clip) || is_same && recorded.contains(clip)
        };
        let (trained, others): (Vec<_>, Vec<_>) =
            (clips.iter().cloned()).partition(|clip| is_in(clip, Split::Train, &record.training_clips));
        let is_validated = |clip: &String| is_in(clip, Split::Validation, &validation.clips);
        Self {
            clips: clips.len(),
            trained,
            validated: others.into_iter().filter(is_validated).collect(),
            trained_and_validated: match validation.motion.as_str() {
                "trained_on" => validation.clips,
                _ => Vec::new(),
            },
        }
    }

    /// Beginning of a sentence about the measured clips, such as "On 2 clips that training has
    /// seen".
    pub(super) fn on_clips(&self) -> String {
        let clips = counted(self.clips, "clip");
        let phrase = |used: usize, verb: &str| match used == self.clips {
            true => format!("On {clips} that training {verb}"),
            false => format!("On {clips}, {used} of which training {verb}"),
        };
        match (self.trained.len(), self.validated.len()) {
            (0, 0) => format!("On {clips} that training has never seen"),
            (0, validated) => phrase(validated, "was validated on"),
            (trained, _) => phrase(trained, "has seen"),
        }
    }

    /// Reasons why the errors may be smaller than on unseen motion, a sentence each.
    pub(super) fn caveats(&self) -> Vec<String> {
        let sentence = |clips: &[String], text: &dyn Fn(&str) -> String| {
            (!clips.is_empty()).then(|| text(&listed(clips, self.clips)))
        };
        let all = [
            sentence(&self.trained, &|clips| {
                format!("Training has seen {clips}: errors there are no measure of unseen motion.")
            }),
            sentence(&self.validated, &|clips| {
                format!(
                    "Training was validated on {clips}: settings were chosen there, and errors there are a little too small."
                )
            }),
            sentence(&self.trained_and_validated, &|clips| {
                format!(
                    "The model was validated on {clips}, which it was trained on: its validation error is no measure of unseen motion."
                )
            }),
        ];
        all.into_iter().flatten().collect()
    }
}

/// Names of some of `all` clips, or their number if they are too many for a sentence.
fn listed(clips: &[String], all: usize) -> String {
    match clips.len() {
        0..=MOST_NAMES => clips.join(", "),
        n if n == all => format!("all {n} clips"),
        n => format!("{n} of the clips"),
    }
}

/// Number with its noun, such as "2 threads".
pub(super) fn counted(count: usize, thing: &str) -> String {
    match count {
        1 => format!("1 {thing}"),
        n => format!("{n} {thing}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overlap(clips: usize, trained: &[&str], validated: &[&str], both: &[&str]) -> TrainingOverlap {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        TrainingOverlap {
            clips,
            trained: names(trained),
            validated: names(validated),
            trained_and_validated: names(both),
        }
    }

    #[test]
    fn unseen_clips_need_no_caveat() {
        let unseen = overlap(2, &[], &[], &[]);
        assert_eq!(unseen.on_clips(), "On 2 clips that training has never seen");
        assert!(unseen.caveats().is_empty());
    }

    #[test]
    fn clips_that_training_has_used_are_named() {
        let seen = overlap(1, &["walk"], &[], &["walk"]);
        assert_eq!(seen.on_clips(), "On 1 clip that training has seen");
        let [about_clip, about_validation] = seen.caveats().try_into().unwrap();
        assert!(about_clip.starts_with("Training has seen walk:"), "{about_clip}");
        assert!(about_validation.contains("validated on walk, which it was trained on"));
        let some = overlap(3, &["walk"], &["run"], &[]);
        assert_eq!(some.on_clips(), "On 3 clips, 1 of which training has seen");
        assert_eq!(some.caveats().len(), 2);
        let validated = overlap(1, &[], &["run"], &[]);
        assert_eq!(validated.on_clips(), "On 1 clip that training was validated on");
        let many: Vec<String> = (0..9).map(|k| k.to_string()).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert!(overlap(9, &many, &[], &[]).caveats()[0].contains("seen all 9 clips:"));
        assert!(overlap(10, &many, &[], &[]).caveats()[0].contains("seen 9 of the clips:"));
    }
}
