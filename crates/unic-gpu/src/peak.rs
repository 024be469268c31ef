//! How fast a device multiplies and adds when nothing else is in its way.

use crate::{
    GpuContext, GpuError, Precision,
    kernel::{Kernel, Source},
    program::Program,
};
use std::fmt::Write;
use wgpu::BufferUsages;

/// Independent sums of four in one invocation, enough to hide the latency of an addition.
const SUMS: usize = 16;
/// Workgroups of 256: as many as the largest devices hold at one time.
const GROUPS: usize = 2048;
/// A measurement lasts at least so long, milliseconds: clocks have risen and starting costs nothing.
const LEAST_MS: f64 = 20.0;
/// Medians are taken of so many.
const REPEATS: usize = 5;

/// Floating-point operations a second of a kernel that multiplies and adds in registers and does nothing
/// else, two an operation: what the field's rate is a share of.
///
/// # Errors
/// A device without timestamps or without the precision.
pub fn multiply_add_peak(context: &GpuContext, precision: Precision) -> Result<f64, GpuError> {
    let mut rounds = 16;
    loop {
        let program = program(context, precision, rounds)?;
        let mut times = Vec::new();
        for _ in 0..REPEATS {
            times.extend(program.submit_timed(context)?.iter().map(|stage| stage.ms));
        }
        times.sort_by(f64::total_cmp);
        let ms = times[REPEATS / 2];
        if ms >= LEAST_MS || rounds >= 1 << 20 {
            let flop = (GROUPS * 256 * SUMS * 4 * 2) as f64 * f64::from(rounds);
            return Ok(flop / (ms * 1e-3));
        }
        rounds *= 4;
    }
}

fn program(context: &GpuContext, precision: Precision, rounds: u32) -> Result<Program, GpuError> {
    let text = source(precision);
    let source = Source {
        text: &text,
        entry: "peak",
        constants: &[("ROUNDS", f64::from(rounds))],
    };
    let mut program = Program::default();
    let dispatch = context.checked(|| {
        let out = context.zeroed("peak", 16 * (2 + GROUPS * 256), BufferUsages::empty());
        Kernel::new(context, &source).dispatch(&[(0, &out)], GROUPS)
    })?;
    program.stage("peak", vec![dispatch]);
    Ok(program)
}

fn source(precision: Precision) -> String {
    let (enable, real) = match precision {
        Precision::F32 => ("", "f32"),
        Precision::F16 => ("enable f16;\n", "f16"),
    };
    let (mut starts, mut steps) = (String::new(), String::new());
    for i in 0..SUMS {
        // Writing to a string cannot fail.
        let _ = writeln!(starts, "var s{i} = vec4<{real}>({real}(id.x + {i}u));");
        let _ = writeln!(steps, "s{i} = s{i} * a + b;");
    }
    let sum: Vec<String> = (0..SUMS).map(|i| format!("vec4<f32>(s{i})")).collect();
    let template = include_str!("kernels/peak.wgsl");
    let text = template
        .replace("//{starts}", &starts)
        .replace("//{steps}", &steps)
        .replace("//{sum}", &sum.join(" + "))
        .replace("Real", real);
    enable.to_owned() + &text
}
