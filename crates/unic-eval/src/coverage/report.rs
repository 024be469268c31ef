//! What is said about a motion.

use super::quantities::Unit;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// Quantities that the text names for a stretch and for the whole motion; JSON holds all.
const NAMED_FOR_STRETCH: usize = 3;
const NAMED: usize = 12;

/// A motion against a capture. Distances are relative to what counts as seen: 1 is the limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoverageReport {
    /// Name of the motion.
    pub clip: String,
    /// Its length, s.
    pub seconds: f32,
    /// Share of the frames that are no further from the capture than 1, %.
    pub covered_percent: f32,
    /// Median over the frames of the distance to the capture.
    pub median_distance: f32,
    /// The largest one.
    pub largest_distance: f32,
    /// Stretches that the capture has not seen, the heaviest first.
    pub worst: Vec<Stretch>,
    /// Quantities beyond the capture's range anywhere in the motion, the furthest first.
    pub outside: Vec<Excess>,
    /// Kinds of movement, here and in the capture.
    pub kinds: Vec<KindShare>,
}

/// A part of a motion that the capture has not seen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stretch {
    /// First frame, s.
    pub from_seconds: f32,
    /// End, s.
    pub to_seconds: f32,
    /// Largest distance in it.
    pub distance: f32,
    /// What the capture has that is most like its furthest frame.
    pub nearest: Place,
    /// Quantities beyond the capture's range in it, the furthest first; none where only the
    /// combination is new.
    pub reasons: Vec<Excess>,
}

/// A moment of a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Name of the clip.
    pub clip: String,
    /// Time in it, s.
    pub seconds: f32,
}

/// A quantity beyond the range of the capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excess {
    /// Such as "bend of the left elbow": the angle of its rotation away from the T-pose.
    pub quantity: String,
    /// Of all numbers here.
    pub unit: Unit,
    /// Least and largest value in the capture.
    pub seen: [f32; 2],
    /// The value furthest out.
    pub found: f32,
    /// When, s.
    pub at_seconds: f32,
    /// How long the quantity is out of range altogether, s.
    pub seconds: f32,
}

/// How much there is of a kind of movement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindShare {
    /// Such as "running".
    pub kind: String,
    /// In the motion, s.
    pub seconds: f32,
    /// In the capture, s.
    pub capture_seconds: f32,
}

impl Display for CoverageReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {:.1} % of {:.1} s within what the capture has seen (distance {:.2} in the median, {:.2} at \
             most; 1 is the limit)",
            self.clip, self.covered_percent, self.seconds, self.median_distance, self.largest_distance
        )?;
        for stretch in &self.worst {
            writeln!(f, "  {stretch}")?;
        }
        if !self.outside.is_empty() {
            writeln!(f, "  beyond the capture's range:")?;
        }
        for excess in self.outside.iter().take(NAMED) {
            writeln!(f, "    {excess}, for {:.1} s", excess.seconds)?;
        }
        if self.outside.len() > NAMED {
            writeln!(f, "    and {} more", self.outside.len() - NAMED)?;
        }
        let lacking = |k: &&KindShare| k.capture_seconds < k.seconds.min(1.0);
        for kind in self.kinds.iter().filter(lacking) {
            writeln!(f, "  the capture lacks: {kind}")?;
        }
        Ok(())
    }
}

impl Display for Stretch {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.1} s to {:.1} s: distance {:.2}, most like {} at {:.1} s",
            self.from_seconds, self.to_seconds, self.distance, self.nearest.clip, self.nearest.seconds
        )?;
        let reasons = self.reasons.iter().take(NAMED_FOR_STRETCH);
        reasons.enumerate().try_for_each(|(i, excess)| {
            let before = if i == 0 { ": " } else { "; " };
            write!(f, "{before}{excess}")
        })
    }
}

impl Display for Excess {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let ([least, most], digits, unit) = (self.seen, self.unit.digits(), self.unit.symbol());
        let (by, way) = match self.found > most {
            true => (self.found - most, "above"),
            false => (least - self.found, "below"),
        };
        let space = if unit.starts_with('°') { "" } else { " " };
        write!(
            f,
            "{} {by:.digits$}{space}{unit} {way} the {least:.digits$} to {most:.digits$}{space}{unit} seen (at {:.1} s)",
            self.quantity, self.at_seconds
        )
    }
}

impl Display for KindShare {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} ({:.1} s here, {:.1} s there)",
            self.kind, self.seconds, self.capture_seconds
        )
    }
}
