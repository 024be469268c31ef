//! Result of comparing a motion with a capture: JSON for programs, text for people.

use super::unit::Unit;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// Number of quantities that the text names for a stretch. JSON holds all.
const NAMED_FOR_STRETCH: usize = 3;
/// Number of quantities that the text names for the whole motion. JSON holds all.
const NAMED: usize = 12;

/// Comparison of a motion with a capture. Distances are in units of the largest covered distance: 1
/// is the limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoverageReport {
    /// Name of the motion.
    pub clip: String,
    /// Length of the motion, s.
    pub seconds: f32,
    /// Share of covered frames, whose distance is at most 1, %.
    pub covered_percent: f32,
    /// Median distance of the frames to the capture.
    pub median_distance: f32,
    /// Largest distance of a frame to the capture.
    pub largest_distance: f32,
    /// Stretches that the capture does not cover, the heaviest first.
    pub worst: Vec<Stretch>,
    /// Quantities beyond the capture's range anywhere in the motion, the farthest first.
    pub outside: Vec<Excess>,
    /// Kinds of movement in the motion and in the capture.
    pub kinds: Vec<KindShare>,
}

/// Part of a motion that a capture does not cover.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stretch {
    /// Time of the first frame, s.
    pub from_seconds: f32,
    /// Time of the end, s.
    pub to_seconds: f32,
    /// Largest distance of a frame in the stretch.
    pub distance: f32,
    /// Frame of the capture that is nearest to the stretch's farthest frame.
    pub nearest: Place,
    /// Quantities beyond the capture's range in the stretch, the farthest first. Empty where only
    /// their combination is new.
    pub reasons: Vec<Excess>,
}

/// Frame of a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Name of the clip.
    pub clip: String,
    /// Time in the clip, s.
    pub seconds: f32,
}

/// Quantity beyond its range in the capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excess {
    /// Name, such as "bend of the left elbow": the angle of its rotation away from the T-pose.
    pub quantity: String,
    /// Unit of all numbers of this quantity.
    pub unit: Unit,
    /// Least and largest value in the capture.
    pub seen: [f32; 2],
    /// Value farthest out of the range.
    pub found: f32,
    /// Time of that value, s.
    pub at_seconds: f32,
    /// Time for which the quantity is out of its range, s.
    pub seconds: f32,
}

/// Time of a kind of movement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindShare {
    /// Name, such as "running".
    pub kind: String,
    /// Time in the motion, s.
    pub seconds: f32,
    /// Time in the capture, s.
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
