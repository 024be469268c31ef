//! Judge: a classifier that learns to tell predictions from the truth by windows of a second.

use super::{
    logistic::{LogisticRegression, Sample},
    window::Window,
};
use crate::{
    baselines::RIDGE,
    predictor::{CONTROL, MODEL},
};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display, Formatter};

/// Least share of windows in which the judge must tell ridge regression from the truth, percent.
/// Ridge is visibly too smooth: a judge that does not see it sees nothing.
const LEAST_RIDGE_PERCENT: f64 = 80.0;

/// Share of windows in which a judge tells predictions from the truth, percent. 50 is chance: the
/// predictions look like the truth.
///
/// The judge is trained on half of the clips and tested on the other half, and the other way
/// round. Names of the fields are a public JSON contract.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JudgeReport {
    /// Share for the model. `None` without a model, where clips are too short, and where
    /// `judge_ridge_percent` is below 80.
    #[serde(default)]
    pub judge_accuracy_percent: Option<f64>,
    /// Share for a second simulation of the same motions with another history. `None` without one.
    #[serde(default)]
    pub judge_control_percent: Option<f64>,
    /// Share for ridge regression.
    #[serde(default)]
    pub judge_ridge_percent: Option<f64>,
}

/// Windows of the truth and of all predictors on one clip.
#[derive(Clone, Debug)]
pub(crate) struct ClipWindows {
    /// Windows of the truth.
    pub(crate) truth: Vec<Window>,
    /// Windows of each predictor, at the times of the truth's.
    pub(crate) predicted: Vec<Vec<Window>>,
}

/// Judges the predictors of an evaluation, given by their names, by the windows of each clip.
pub(crate) fn judge<'a>(names: impl Iterator<Item = &'a str>, clips: &[ClipWindows]) -> JudgeReport {
    let mut report = JudgeReport::default();
    for (index, name) in names.enumerate() {
        let share = match name {
            MODEL => &mut report.judge_accuracy_percent,
            CONTROL => &mut report.judge_control_percent,
            RIDGE => &mut report.judge_ridge_percent,
            _ => continue,
        };
        let pairs = clips.iter().filter_map(|clip| {
            let predicted = clip.predicted.get(index)?;
            Some(ClipPair::new(&clip.truth, predicted))
        });
        *share = accuracy_percent(&pairs.collect::<Vec<_>>());
    }
    if !report.counts() {
        report.judge_accuracy_percent = None;
    }
    report
}

impl JudgeReport {
    /// Returns whether the judge tells ridge regression from the truth well enough to be believed.
    fn counts(&self) -> bool {
        self.judge_ridge_percent
            .is_some_and(|percent| percent >= LEAST_RIDGE_PERCENT)
    }
}

/// Writes one line, or nothing without a judge.
impl Display for JudgeReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(ridge) = self.judge_ridge_percent else {
            return Ok(());
        };
        if !self.counts() {
            return writeln!(
                f,
                "judge: does not count, since it tells ridge from the truth in {ridge:.0} % of windows only \
                 (expected {LEAST_RIDGE_PERCENT:.0} %, chance 50 %)"
            );
        }
        let control = self.judge_control_percent;
        let control = control.map_or_else(String::new, |percent| format!("control {percent:.0} %, "));
        match self.judge_accuracy_percent {
            Some(model) => writeln!(
                f,
                "judge: tells the model from the truth in {model:.0} % of windows (ridge {ridge:.0} %, \
                 {control}chance 50 %)"
            ),
            None => writeln!(
                f,
                "judge: tells ridge from the truth in {ridge:.0} % of windows ({control}chance 50 %)"
            ),
        }
    }
}

/// Windows of one clip: the truth's and a prediction's.
#[derive(Clone, Debug)]
struct ClipPair<'a> {
    truth: Vec<&'a Window>,
    predicted: Vec<&'a Window>,
}

impl<'a> ClipPair<'a> {
    fn new(truth: &'a [Window], predicted: &'a [Window]) -> Self {
        Self {
            truth: truth.iter().collect(),
            predicted: predicted.iter().collect(),
        }
    }

    /// Returns the part with the windows that a condition holds for.
    fn part(&self, condition: impl Fn(&Window) -> bool) -> Self {
        let keep = |windows: &[&'a Window]| windows.iter().copied().filter(|w| condition(w)).collect();
        Self {
            truth: keep(&self.truth),
            predicted: keep(&self.predicted),
        }
    }

    /// Iterates over the windows. Predictions are the positive class.
    fn samples(&self) -> impl Iterator<Item = Sample<'a>> {
        let classes = [(&self.truth, false), (&self.predicted, true)];
        classes.into_iter().flat_map(|(windows, is_positive)| {
            windows.iter().map(move |window| Sample {
                inputs: &window.features,
                is_positive,
            })
        })
    }
}

/// Returns the mean over both halves of the share of windows that a classifier trained on the other
/// half tells right, percent. `None` where a half has no windows, or windows are not finite, as in
/// a prediction that has diverged.
fn accuracy_percent(clips: &[ClipPair]) -> Option<f64> {
    let halves = halves(clips)?;
    let samples = halves.each_ref().map(|half| {
        let samples = half.iter().flat_map(ClipPair::samples);
        samples.collect::<Vec<_>>()
    });
    let [first, second] = &samples;
    let shares = [(first, second), (second, first)].map(|(train, test)| balanced_accuracy(train, test));
    let percent = 100.0 * (shares[0]? + shares[1]?) / 2.0;
    percent.is_finite().then_some(percent)
}

/// Splits clips into two halves: every other clip, or the two halves in time of a single clip with
/// a second between them. `None` where a half has no windows.
fn halves<'a>(clips: &[ClipPair<'a>]) -> Option<[Vec<ClipPair<'a>>; 2]> {
    let used: Vec<&ClipPair> = clips.iter().filter(|clip| !clip.truth.is_empty()).collect();
    let halves = match used.as_slice() {
        [] => return None,
        [clip] => {
            let (first, last) = (clip.truth.first()?, clip.truth.last()?);
            // The first window ends after one second, so that its end is the length of a second.
            let second = first.end;
            let middle = last.end as f64 / 2.0;
            let gap = second as f64 / 2.0;
            [
                vec![clip.part(|window| window.end as f64 <= middle - gap)],
                vec![clip.part(|window| (window.end - second) as f64 >= middle + gap)],
            ]
        }
        clips => [0, 1].map(|parity| {
            let half = clips.iter().skip(parity).step_by(2);
            half.map(|&clip| clip.clone()).collect()
        }),
    };
    let has_windows = |half: &Vec<ClipPair>| half.iter().any(|clip| !clip.truth.is_empty());
    halves.iter().all(has_windows).then_some(halves)
}

/// Trains on samples and returns the mean over both classes of the share of test samples that are
/// told right. A score of 0 counts half. `None` where a class has no samples or a score is NaN.
fn balanced_accuracy(train: &[Sample], test: &[Sample]) -> Option<f64> {
    let classifier = LogisticRegression::fit(train);
    let share = |is_positive: bool| {
        let scores: Vec<f64> = test
            .iter()
            .filter(|sample| sample.is_positive == is_positive)
            .map(|sample| classifier.score(sample.inputs))
            .collect();
        let told = |&score: &f64| match score.partial_cmp(&0.0)? {
            std::cmp::Ordering::Equal => Some(0.5),
            order => Some(f64::from(order.is_gt() == is_positive)),
        };
        let right = scores.iter().map(told).sum::<Option<f64>>()?;
        (!scores.is_empty()).then(|| right / scores.len() as f64)
    };
    Some((share(false)? + share(true)?) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

    /// Windows of a clip whose statistics are pseudo-random with the given shift.
    fn windows(seed: u64, shift: f64, count: usize) -> Vec<Window> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|i| Window {
                end: 10 + 5 * i,
                features: std::array::from_fn(|_| random.random_range(-0.5..0.5) + shift),
            })
            .collect()
    }

    fn told(clips: &[[Vec<Window>; 2]]) -> Option<f64> {
        let pairs = clips.iter().map(|[truth, other]| ClipPair::new(truth, other));
        accuracy_percent(&pairs.collect::<Vec<_>>())
    }

    #[test]
    fn equal_distributions_are_told_apart_by_chance_alone() {
        let clips = (0..10).map(|s| [windows(2 * s, 0.0, 31), windows(2 * s + 1, 0.0, 31)]);
        let percent = told(&clips.collect::<Vec<_>>()).unwrap();
        assert!((40.0..60.0).contains(&percent), "{percent}");
        let same = [3, 4].map(|s| [windows(s, 0.0, 31), windows(s, 0.0, 31)]);
        assert_eq!(told(&same), Some(50.0));
    }

    #[test]
    fn shifted_distributions_are_told_apart_in_several_clips_and_in_one() {
        let clips = [0, 1, 2].map(|s| [windows(2 * s, 0.0, 31), windows(2 * s + 1, 0.5, 31)]);
        assert!(told(&clips).unwrap() > 95.0);
        assert!(told(&clips[..1]).unwrap() > 95.0);
        assert_eq!(
            told(&[[windows(0, 0.0, 3), windows(1, 0.5, 3)]]),
            None,
            "too short"
        );
    }

    #[test]
    fn a_diverged_prediction_is_not_judged() {
        let clips = [0, 1].map(|s| [windows(s, 0.0, 9), windows(s, f64::NAN, 9)]);
        assert_eq!(told(&clips), None);
    }

    #[test]
    fn the_model_counts_only_where_ridge_is_told() {
        let (truth, model) = (windows(0, 0.0, 31), windows(1, 0.5, 31));
        let report = |ridge: f64| {
            let clip = |_| ClipWindows {
                truth: truth.clone(),
                predicted: vec![model.clone(), windows(2, ridge, 31), windows(0, 0.0, 31)],
            };
            let clips: Vec<ClipWindows> = (0..2).map(clip).collect();
            judge([MODEL, RIDGE, CONTROL].into_iter(), &clips)
        };
        let counting = report(0.7);
        assert!(counting.judge_accuracy_percent.unwrap() > 95.0);
        assert_eq!(counting.judge_control_percent, Some(50.0));
        let text = counting.to_string();
        assert!(
            text.starts_with("judge: tells the model from the truth in") && text.contains("control 50 %")
        );
        let blind = report(0.0);
        assert_eq!(blind.judge_accuracy_percent, None);
        assert!(blind.to_string().starts_with("judge: does not count"));
        assert_eq!(JudgeReport::default().to_string(), "");
    }
}
