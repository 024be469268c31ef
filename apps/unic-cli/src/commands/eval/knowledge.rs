//! Training's knowledge of the clips that are measured.

use serde::Deserialize;
use unic_core::model::Model;
use unic_io::{Capture, Split};

/// Names of clips that one sentence lists at most.
const MOST_NAMES: usize = 6;

/// Training's knowledge of the clips that are measured, and of those that the model was validated on.
pub(super) struct Knowledge {
    clips: usize,
    /// The clips that training has fitted.
    seen: Vec<String>,
    /// The others that choices were made by.
    steered: Vec<String>,
    /// The clips that the model was validated on, though it was trained on them.
    validated_on_itself: Vec<String>,
}

/// The part of a model's account of its training that matters here; files may tell anything.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Told {
    training_clips: Vec<String>,
    validation: Option<ToldValidation>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct ToldValidation {
    clips: Vec<String>,
    motion: String,
}

impl Knowledge {
    /// Follows from the capture's splits, which the baselines are fitted on, and from what a model says of its training.
    pub(super) fn of(capture: &Capture, model: Option<&Model>, clips: &[String]) -> Self {
        let told: Told = model
            .and_then(|model| serde_json::from_value(model.about().training.clone()).ok())
            .unwrap_or_default();
        let validation = told.validation.unwrap_or_default();
        let is_same = model.is_some_and(|model| model.about().name == capture.manifest.name);
        let is_in = |clip: &String, split: Split, told: &[String]| {
            capture.clip_names(split).contains(clip) || is_same && told.contains(clip)
        };
        let (seen, others): (Vec<_>, Vec<_>) =
            (clips.iter().cloned()).partition(|clip| is_in(clip, Split::Train, &told.training_clips));
        let is_steered = |clip: &String| is_in(clip, Split::Validation, &validation.clips);
        Self {
            clips: clips.len(),
            seen,
            steered: others.into_iter().filter(is_steered).collect(),
            validated_on_itself: match validation.motion.as_str() {
                "trained_on" => validation.clips,
                _ => Vec::new(),
            },
        }
    }

    /// The beginning of a sentence.
    pub(super) fn on_clips(&self) -> String {
        let clips = counted(self.clips, "clip");
        let those = |known: usize, verb: &str| match known == self.clips {
            true => format!("On {clips} that training {verb}"),
            false => format!("On {clips}, {known} of which training {verb}"),
        };
        match (self.seen.len(), self.steered.len()) {
            (0, 0) => format!("On {clips} that training has never seen"),
            (0, steered) => those(steered, "was validated on"),
            (seen, _) => those(seen, "has seen"),
        }
    }

    /// Why the numbers may be better than those of unseen motion, a sentence each; none where they are not.
    pub(super) fn caveats(&self) -> Vec<String> {
        let sentence = |clips: &[String], words: &dyn Fn(&str) -> String| {
            (!clips.is_empty()).then(|| words(&listed(clips, self.clips)))
        };
        let all = [
            sentence(&self.seen, &|clips| {
                format!("Training has seen {clips}: errors there are no measure of unseen motion.")
            }),
            sentence(&self.steered, &|clips| {
                format!(
                    "Training was validated on {clips}: choices were made there, and errors there are a little too small."
                )
            }),
            sentence(&self.validated_on_itself, &|clips| {
                format!(
                    "The model was validated on {clips}, which it was trained on: its validation error is no measure of unseen motion."
                )
            }),
        ];
        all.into_iter().flatten().collect()
    }
}

/// Names of some of `all` clips, as many as a sentence bears.
fn listed(clips: &[String], all: usize) -> String {
    match clips.len() {
        0..=MOST_NAMES => clips.join(", "),
        n if n == all => format!("all {n} clips"),
        n => format!("{n} of the clips"),
    }
}

/// A number with its noun, as in "2 threads".
pub(super) fn counted(count: usize, thing: &str) -> String {
    match count {
        1 => format!("1 {thing}"),
        n => format!("{n} {thing}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knowledge(clips: usize, seen: &[&str], steered: &[&str], itself: &[&str]) -> Knowledge {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Knowledge {
            clips,
            seen: names(seen),
            steered: names(steered),
            validated_on_itself: names(itself),
        }
    }

    #[test]
    fn unseen_clips_need_no_caveat() {
        let unseen = knowledge(2, &[], &[], &[]);
        assert_eq!(unseen.on_clips(), "On 2 clips that training has never seen");
        assert!(unseen.caveats().is_empty());
    }

    #[test]
    fn what_training_knew_is_said_of_each_clip() {
        let seen = knowledge(1, &["walk"], &[], &["walk"]);
        assert_eq!(seen.on_clips(), "On 1 clip that training has seen");
        let [about_clip, about_validation] = seen.caveats().try_into().unwrap();
        assert!(about_clip.starts_with("Training has seen walk:"), "{about_clip}");
        assert!(about_validation.contains("validated on walk, which it was trained on"));
        let some = knowledge(3, &["walk"], &["run"], &[]);
        assert_eq!(some.on_clips(), "On 3 clips, 1 of which training has seen");
        assert_eq!(some.caveats().len(), 2);
        let steered = knowledge(1, &[], &["run"], &[]);
        assert_eq!(steered.on_clips(), "On 1 clip that training was validated on");
        let many: Vec<String> = (0..9).map(|k| k.to_string()).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert!(knowledge(9, &many, &[], &[]).caveats()[0].contains("seen all 9 clips:"));
        assert!(knowledge(10, &many, &[], &[]).caveats()[0].contains("seen 9 of the clips:"));
    }
}
