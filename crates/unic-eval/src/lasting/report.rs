//! Targets of the measures, and all results as text.

use super::{Comparison, Disturbance, LastingReport, Stop};
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// Target of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Largest value that meets the target.
    AtMost(f64),
    /// Least and largest value that meet the target.
    Within([f64; 2]),
}

impl Target {
    /// Returns whether a value meets the target. NaN does not.
    pub fn is_met(&self, value: f64) -> bool {
        match *self {
            Self::AtMost(most) => value <= most,
            Self::Within([least, most]) => (least..=most).contains(&value),
        }
    }
}

/// Number with its target.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Description of the number.
    pub measure: String,
    /// Measured number. `None` where the capture has nothing to measure it on. A number that is not
    /// finite is `null` in JSON and misses its target.
    pub value: Option<f64>,
    /// Target of the number.
    pub target: Target,
    /// Result of the comparison with the target. `None` without a number.
    #[serde(rename = "met")]
    pub is_met: Option<bool>,
}

impl Verdict {
    /// Compares a number with its target.
    fn new(measure: impl Into<String>, value: Option<f64>, target: Target) -> Self {
        Self {
            measure: measure.into(),
            is_met: value.map(|value| target.is_met(value)),
            value,
            target,
        }
    }
}

/// Returns the main numbers beside the targets that preset `standard` is designed for.
pub(super) fn verdicts(lasting: &LastingReport) -> Vec<Verdict> {
    let LastingReport {
        drift,
        random_motion,
        standing,
        aliveness,
        stops,
        recovery,
        ..
    } = lasting;
    let worst = |values: Vec<f64>| values.into_iter().max_by(f64::total_cmp);
    // Energies are summed over clips before they are divided, as errors are pooled everywhere. A
    // mean of ratios would let clips with little motion dominate.
    let found = aliveness.iter().map(|a| a.band_energy_mm2).sum::<f64>();
    let truth = aliveness.iter().map(|a| a.true_band_energy_mm2).sum::<f64>();
    let mean_jitter = aliveness.iter().map(|a| a.jitter_ratio).sum::<f64>() / aliveness.len() as f64;
    let alive = |value: f64| (!aliveness.is_empty()).then_some(value);
    let random = |value: f64| (random_motion.frames > 0).then_some(value);
    let mut verdicts = vec![
        Verdict::new(
            format!("drift after 50 s, worst of {} clips", drift.len()),
            worst(drift.iter().map(|d| d.ratio).collect()),
            Target::AtMost(1.05),
        ),
        Verdict::new(
            "largest displacement in random motion, by that in training",
            random(random_motion.ratio),
            Target::AtMost(1.5),
        ),
        Verdict::new(
            "frames of it that are not finite",
            random(random_motion.frames_not_finite as f64),
            Target::AtMost(0.0),
        ),
        Verdict::new(
            "3 s of standing still after it, mm from a fresh start",
            random(standing.worst_mm),
            Target::AtMost(10.0),
        ),
        Verdict::new(
            "jitter, by the truth's",
            alive(mean_jitter),
            Target::Within([0.8, 1.2]),
        ),
        Verdict::new(
            "energy of 0.5 to 5 Hz, by the truth's",
            alive(found / truth),
            Target::Within([0.7, 1.3]),
        ),
        of_stops("decay time", stops.iter().filter_map(Stop::decay).collect()),
        of_stops(
            "first overshoot",
            stops.iter().map(|stop| stop.overshoot_mm).collect(),
        ),
    ];
    verdicts.extend(recovery.iter().map(|recovery| {
        let ratio = (recovery.events > 0).then_some(recovery.ratio);
        let measure = format!(
            "error 1 s after {}, by the undisturbed",
            words(recovery.disturbance)
        );
        Verdict::new(measure, ratio, Target::AtMost(1.05))
    }));
    verdicts
}

/// Returns the ratio of two sums over stops, so that stops with a large swing count more.
fn of_stops(what: &str, pairs: Vec<Comparison<f64>>) -> Verdict {
    let sum = |part: fn(&Comparison<f64>) -> f64| pairs.iter().map(part).sum::<f64>();
    let (found, truth) = (sum(|pair| pair.predicted), sum(|pair| pair.truth));
    Verdict::new(
        format!("{what} after sudden stops ({}), by the truth's", pairs.len()),
        (truth > 0.0).then(|| found / truth),
        Target::Within([0.75, 1.25]),
    )
}

/// Returns a disturbance in words.
fn words(disturbance: Disturbance) -> &'static str {
    match disturbance {
        Disturbance::MeanShape => "a start as it hangs on average",
        Disturbance::RestShape => "a start from the rest shape",
        Disturbance::OtherGarment => "a start from another moment's garment",
        Disturbance::Teleport => "a teleport",
        Disturbance::Cut => "a cut",
        Disturbance::Dropped => "half a second dropped",
        Disturbance::Cartwheel => "a cartwheel",
    }
}

impl Display for LastingReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "| measure | found | target | met |\n|---|---|---|---|")?;
        for verdict in &self.verdicts {
            let Verdict {
                measure,
                value,
                target,
                is_met,
            } = verdict;
            let met = is_met.map_or("–", |met| if met { "yes" } else { "**no**" });
            writeln!(f, "| {measure} | {} | {target} | {met} |", number(*value, 2))?;
        }
        self.write_drift(f)?;
        self.write_aliveness(f)?;
        self.write_stops(f)?;
        self.write_recovery(f)
    }
}

impl Display for Target {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(most) => write!(f, "≤ {most}"),
            Self::Within([least, most]) => write!(f, "{least} to {most}"),
        }
    }
}

impl LastingReport {
    /// Writes the drift of each clip.
    fn write_drift(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if !self.drift.is_empty() {
            writeln!(
                f,
                "\n| seconds 50–60 of | split | from frame 0, mm | from 45 s, mm | ratio |\n|---|---|---|---|---|"
            )?;
        }
        for drift in &self.drift {
            let [from_start, restarted, ratio] =
                [drift.from_start_mm, drift.restarted_mm, drift.ratio].map(Some);
            writeln!(
                f,
                "| {} | {} | {} | {} | {} |",
                drift.clip,
                drift.split,
                number(from_start, 2),
                number(restarted, 2),
                number(ratio, 3)
            )?;
        }
        Ok(())
    }

    /// Writes the liveliness in each test clip.
    fn write_aliveness(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if !self.aliveness.is_empty() {
            writeln!(
                f,
                "\n| test clip | jitter | energy, mm² | the truth's, mm² | ratio |\n|---|---|---|---|---|"
            )?;
        }
        for alive in &self.aliveness {
            let [jitter, found, truth, ratio] = [
                alive.jitter_ratio,
                alive.band_energy_mm2,
                alive.true_band_energy_mm2,
                alive.band_energy_ratio,
            ]
            .map(Some);
            writeln!(
                f,
                "| {} | {} | {} | {} | {} |",
                alive.clip,
                number(jitter, 2),
                number(found, 1),
                number(truth, 1),
                number(ratio, 2)
            )?;
        }
        Ok(())
    }

    /// Writes each sudden stop.
    fn write_stops(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if !self.stops.is_empty() {
            writeln!(
                f,
                "\n| sudden stop | split | decay, s | the truth's, s | overshoot, mm | the truth's, mm |\n\
                 |---|---|---|---|---|---|"
            )?;
        }
        for stop in &self.stops {
            let Comparison { predicted, truth } = stop.decay_s;
            let decay = [number(predicted, 2), number(truth, 2)].join(" | ");
            let Comparison { predicted, truth } = stop.overshoot_mm;
            let overshoot = [number(Some(predicted), 1), number(Some(truth), 1)].join(" | ");
            let (clip, split, at) = (&stop.clip, stop.split, stop.at_s);
            writeln!(f, "| {clip} at {at:.1} s | {split} | {decay} | {overshoot} |")?;
        }
        Ok(())
    }

    /// Writes the recovery from each disturbance.
    fn write_recovery(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let happened = || self.recovery.iter().filter(|recovery| recovery.events > 0);
        if happened().next().is_some() {
            writeln!(
                f,
                "\n| second 1–2 after | events | RMSE, mm | undisturbed, mm | ratio | worst event | ratio of second 0–1 |\n\
                 |---|---|---|---|---|---|---|"
            )?;
        }
        for recovery in happened() {
            writeln!(
                f,
                "| {} | {} | {} | {} | {} | {} | {} |",
                words(recovery.disturbance),
                recovery.events,
                number(Some(recovery.rmse_mm), 2),
                number(Some(recovery.undisturbed_mm), 2),
                number(Some(recovery.ratio), 3),
                number(Some(recovery.worst_ratio), 2),
                number(Some(recovery.first_second_ratio), 2)
            )?;
        }
        Ok(())
    }
}

/// Formats a number. A dash stands for none.
fn number(value: Option<f64>, digits: usize) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if value.is_finite() => format!("{value:.digits$}"),
        Some(_) => "no number".to_owned(),
    }
}
