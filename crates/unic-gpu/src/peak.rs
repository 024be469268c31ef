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
/// Rounds beyond which a device is not believed.
const MOST_ROUNDS: u32 = 1 << 22;

/// A kernel that multiplies and adds in registers and does nothing else: what the field's rate is a share of.
///
/// Clock rates move, and so does what else a machine is doing: measure it beside what it is compared with.
#[derive(Debug)]
pub struct MultiplyAdds {
    context: GpuContext,
    program: Program,
    rounds: u32,
}

impl MultiplyAdds {
    /// Compiles the kernel and finds out how long it must run.
    ///
    /// # Errors
    /// A device without timestamps or without the precision.
    pub fn new(context: &GpuContext, precision: Precision) -> Result<Self, GpuError> {
        let mut rounds = 16;
        loop {
            let kernel = Self {
                context: context.clone(),
                program: program(context, precision, rounds)?,
                rounds,
            };
            // The first run pages in.
            kernel.seconds()?;
            if kernel.seconds()? >= LEAST_MS * 1e-3 || rounds >= MOST_ROUNDS {
                return Ok(kernel);
            }
            rounds *= 4;
        }
    }

    /// Floating-point operations a second of one run, two a multiply-add.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn rate(&self) -> Result<f64, GpuError> {
        let flop = (GROUPS * 256 * SUMS * 4 * 2) as f64 * f64::from(self.rounds);
        Ok(flop / self.seconds()?)
    }

    fn seconds(&self) -> Result<f64, GpuError> {
        let stages = self.program.submit_timed(&self.context)?;
        Ok(stages.iter().map(|stage| stage.ms * 1e-3).sum())
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
