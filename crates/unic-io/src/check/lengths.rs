//! Units of length, told by a ratio.

/// Units that files come in, by the factor that they are too large by.
const UNITS: [(&str, f32); 5] = [
    ("millimetres", 1000.0),
    ("centimetres", 100.0),
    ("inches", 1.0 / 0.0254),
    ("decimetres", 10.0),
    ("hundredths of the right size", 0.01),
];

/// How far a ratio may be from a unit's factor, as a ratio: garments and bodies come in sizes.
const SIZES: f32 = 1.8;

/// The unit that makes lengths `ratio` times too large, and what brings them to metres.
pub(super) fn unit_of(ratio: f32) -> Option<(&'static str, f32)> {
    let off = |factor: f32| (ratio / factor).ln().abs();
    let nearest = UNITS.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
    (off(nearest.1) < SIZES.ln()).then_some((nearest.0, 1.0 / nearest.1))
}

/// The probable unit of lengths that are `ratio` times too large, and its remedy.
pub(super) fn words(ratio: f32, thing: &str) -> (String, String) {
    match unit_of(ratio) {
        Some((unit, scale)) => (unit.to_owned(), format!("scale {thing} by {scale} to metres")),
        None => ("another unit".to_owned(), format!("bring {thing} to metres")),
    }
}

/// The median; none of nothing.
pub(super) fn median(mut values: Vec<f32>) -> Option<f32> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
