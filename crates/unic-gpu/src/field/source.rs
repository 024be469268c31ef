//! The text of the field's kernel.

use super::{BLOCK, CHUNK, FieldShape};
use crate::Precision;
use std::fmt::Write;
use unic_core::{animator::FARTHEST, config::StateConfig, model::Model};

/// `field.wgsl` for these sizes.
pub(super) fn source(shape: &FieldShape, model: &Model, biases: usize) -> String {
    let (update, state) = state_update(model);
    let parts = [
        ("//{constants}", constants(shape, model, biases) + &state),
        ("//{places}", places(shape)),
        (
            "//{biases}",
            for_blocks(|n, h| format!("var a{n}{h} = vec4<f32>(bias{}.{});", n / 4, axis(n))),
        ),
        ("//{edge products}", for_blocks(|n, h| product("a", n, h))),
        ("//{fetch}", fetch(shape)),
        ("//{store}", store(shape)),
        (
            "//{zeros}",
            match shape.precision {
                Precision::F32 => String::new(),
                Precision::F16 => for_blocks(|n, h| format!("var c{n}{h} = vec4<f16>();")),
            },
        ),
        (
            "//{products}",
            for_blocks(|n, h| match shape.precision {
                Precision::F32 => product("a", n, h),
                Precision::F16 => product("c", n, h),
            }),
        ),
        (
            "//{totals}",
            match shape.precision {
                Precision::F32 => String::new(),
                Precision::F16 => for_blocks(|n, h| format!("a{n}{h} += vec4<f32>(c{n}{h});")),
            },
        ),
        ("//{activations}", for_blocks(activation)),
        ("//{update}", update.to_owned()),
    ];
    let template = include_str!("../kernels/field.wgsl").to_owned();
    parts
        .iter()
        .fold(template, |text, (mark, part)| text.replace(mark, part))
}

fn constants(shape: &FieldShape, model: &Model, biases: usize) -> String {
    let (width, lanes) = (shape.width, shape.lanes());
    let numbers = [
        ("WIDTH", width),
        ("WIDTH4", width / 4),
        ("COLUMNS", shape.columns()),
        ("LINES", shape.lines),
        ("TILE4", lanes / 4),
        ("THREADS", shape.invocations()),
        ("CHUNK", CHUNK),
        ("CHUNK4", CHUNK * width / 4),
        ("HIDDEN4", width * lanes / 4),
        ("LAYERS", shape.layers),
        // One that there is not, without a skip layer.
        ("SKIP", shape.skip.unwrap_or(shape.layers)),
        ("INPUTS", shape.inputs),
        ("STRIDE4", shape.stride(model.vertex_count()) / 4),
        ("BIASES4", biases / 4),
        ("HEAD4", 2 * shape.inputs * width / 4),
        ("VERTICES", model.vertex_count()),
    ];
    let mut text = match shape.precision {
        Precision::F32 => "alias Real = f32;\nconst LARGEST = 3.4e38f;\n".to_owned(),
        Precision::F16 => "enable f16;\nalias Real = f16;\nconst LARGEST = 65504.0f;\n".to_owned(),
    };
    for (name, value) in numbers {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "const {name} = {value}u;");
    }
    text
}

/// How outputs move the state, and the numbers that it takes.
fn state_update(model: &Model) -> (&'static str, String) {
    match &model.config().state {
        StateConfig::Position => (
            include_str!("../kernels/update_position.wgsl"),
            format!("const FARTHEST = {FARTHEST:?}f;"),
        ),
        StateConfig::Displacement(config) => {
            let decay = config.decay(1.0 / model.config().fps);
            let (limit, scale) = (config.output_limit, config.scale_m);
            (
                include_str!("../kernels/update_displacement.wgsl"),
                format!("const DECAY = {decay:?}f; const LIMIT = {limit:?}f; const SCALE = {scale:?}f;"),
            )
        }
    }
}

/// Which outputs and vertices an invocation has. Eight columns side by side, where there are as many, and then
/// the lines, so that 32 neighbours read few different weights and activations.
fn places(shape: &FieldShape) -> String {
    let run = if shape.columns().is_multiple_of(8) {
        8
    } else {
        shape.columns()
    };
    let fetched = (0..fetches(shape)).map(|i| format!(" var p{i} = vec4<Real>();"));
    format!(
        "let n = t / ({run}u * LINES) * {run}u + t % {run}u; let m = t / {run}u % LINES;{}",
        fetched.collect::<String>()
    )
}

/// Quadruples of a chunk that one invocation carries.
fn fetches(shape: &FieldShape) -> usize {
    (CHUNK * shape.width / 4).div_ceil(shape.invocations())
}

fn fetch(shape: &FieldShape) -> String {
    let line = |i| format!("p{i} = hidden_weights[next + {i}u * THREADS]; ");
    (0..fetches(shape)).map(line).collect()
}

fn store(shape: &FieldShape) -> String {
    let line = |i| format!("chunk[t + {i}u * THREADS] = p{i}; ");
    (0..fetches(shape)).map(line).collect()
}

/// Output n, half h of the vertices.
fn product(sum: &str, n: usize, h: usize) -> String {
    format!("{sum}{n}{h} += x{h} * w{}.{};", n / 4, axis(n))
}

fn activation(n: usize, h: usize) -> String {
    let output = format!("4u * (n + {}u * COLUMNS) + {}u", n / 4, n % 4);
    // Beyond the largest half a number would turn into infinity.
    let value = format!("clamp(a{n}{h}, vec4<f32>(), vec4<f32>(LARGEST))");
    format!("hidden[({output}) * TILE4 + m + {h}u * LINES] = vec4<Real>({value});")
}

fn axis(n: usize) -> char {
    ['x', 'y', 'z', 'w'][n % 4]
}

fn for_blocks(line: impl Fn(usize, usize) -> String) -> String {
    let lines = (0..BLOCK).flat_map(|n| [line(n, 0), line(n, 1)]);
    lines.collect::<Vec<_>>().join("\n")
}
