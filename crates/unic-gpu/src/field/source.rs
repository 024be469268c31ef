//! WGSL that the field's kernels share.

use super::FieldShape;
use std::fmt::Write;
use unic_core::{Model, animator::FARTHEST, config::StateConfig};

/// Replaces the placeholders of a template.
pub(super) fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let fill = |text: String, (placeholder, part): &(&str, String)| text.replace(placeholder, part);
    parts.iter().fold(template.to_owned(), fill)
}

/// Declares constants: the sizes of the model, and further ones.
pub(super) fn constants(shape: &FieldShape, model: &Model, further: &[(&str, usize)]) -> String {
    let numbers = [
        ("WIDTH", shape.width),
        ("LAYERS", shape.layers),
        // Without a skip layer, a number that no layer has.
        ("SKIP", shape.skip.unwrap_or(shape.layers)),
        ("INPUTS", shape.inputs),
        ("VERTICES", model.vertex_count()),
    ];
    let mut text = String::new();
    for (name, value) in numbers.iter().chain(further) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "const {name} = {value}u;");
    }
    text
}

/// Returns the function that updates the state from the field's output, and the constants that it
/// reads.
pub(super) fn state_update(model: &Model) -> (&'static str, String) {
    match &model.config().state {
        StateConfig::RootRelative => (
            include_str!("../kernels/update_position.wgsl"),
            format!("const FARTHEST = {FARTHEST:?}f;"),
        ),
        StateConfig::Displacement(config) => {
            // `{:?}` prints the shortest text that parses to the same f32.
            let decay = config.decay(1.0 / model.config().fps);
            let (limit, scale) = (config.output_limit, config.scale_m);
            (
                include_str!("../kernels/update_displacement.wgsl"),
                format!("const DECAY = {decay:?}f; const LIMIT = {limit:?}f; const SCALE = {scale:?}f;"),
            )
        }
    }
}
