//! Units of length, estimated from the ratio of a length to its usual value.

/// A wrong unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LengthUnit {
    /// Name for messages.
    pub(crate) name: &'static str,
    /// Number of these units in a metre: lengths read as metres are too large by this factor.
    per_metre: f32,
}

impl LengthUnit {
    /// Returns the factor that converts lengths of this unit to metres.
    pub(crate) fn metres(self) -> f32 {
        1.0 / self.per_metre
    }
}

/// Wrong units that files come in.
const UNITS: [LengthUnit; 5] = [
    LengthUnit {
        name: "millimetres",
        per_metre: 1000.0,
    },
    LengthUnit {
        name: "centimetres",
        per_metre: 100.0,
    },
    LengthUnit {
        name: "inches",
        per_metre: 1.0 / 0.0254,
    },
    LengthUnit {
        name: "decimetres",
        per_metre: 10.0,
    },
    LengthUnit {
        name: "hundredths of the right size",
        per_metre: 0.01,
    },
];

/// Largest factor between a ratio and that of its unit. Garments and bodies come in sizes.
///
/// The ranges of centimetres and inches overlap (their ratio is 2.54): the nearer unit is taken.
const SIZE_RANGE: f32 = 1.8;

/// Returns the unit that makes lengths `ratio` times too large, if one is near.
pub(crate) fn unit_of(ratio: f32) -> Option<LengthUnit> {
    // Ratios are compared as logarithms: twice too large is as far off as twice too small.
    let off = |unit: &LengthUnit| (ratio / unit.per_metre).ln().abs();
    let nearest = UNITS.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
    (off(nearest) < SIZE_RANGE.ln()).then_some(*nearest)
}

/// Probable cause of lengths of a wrong size, and the remedy; both words of a finding.
pub(crate) struct Diagnosis {
    pub(crate) probably: String,
    pub(crate) remedy: String,
}

/// Returns the diagnosis for lengths that are `ratio` times too large; `thing` has these lengths.
pub(crate) fn diagnose(ratio: f32, thing: &str) -> Diagnosis {
    match unit_of(ratio) {
        Some(unit) => Diagnosis {
            probably: unit.name.to_owned(),
            remedy: format!("scale {thing} by {} to metres", unit.metres()),
        },
        None => Diagnosis {
            probably: "another unit".to_owned(),
            remedy: format!("bring {thing} to metres"),
        },
    }
}

/// Returns the median, the upper one of an even number of values; `None` for an empty list.
pub(crate) fn median(mut values: Vec<f32>) -> Option<f32> {
    // Selection instead of sorting: linear time.
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
