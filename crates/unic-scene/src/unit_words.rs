//! Words about units and axes, the same for every format.

/// Name of a unit of a length in metres.
pub(crate) fn unit_name(metres: f64) -> String {
    match metres {
        1.0 => "metres".to_owned(),
        0.1 => "decimetres".to_owned(),
        0.01 => "centimetres".to_owned(),
        0.001 => "millimetres".to_owned(),
        0.0254 => "inches".to_owned(),
        other => format!("units of {other} m"),
    }
}

/// Adds what is converted to the notes.
pub(crate) fn note_conversions(metres: f64, up: &str, notes: &mut Vec<String>) {
    if metres != 1.0 {
        notes.push(format!("{} converted to metres", unit_name(metres)));
    }
    if up != "Y" {
        notes.push(format!("{up} up converted to Y up"));
    }
}
