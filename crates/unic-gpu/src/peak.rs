//! How fast a device multiplies and adds when nothing else is in its way.

use crate::{
    GpuContext, GpuError, Precision,
    context::MatrixUnits,
    kernel::{Kernel, Source},
    program::Program,
};
use wgpu::BufferUsages;

/// Independent sums of four in one invocation, enough to hide the latency of an addition.
const SUMS: usize = 16;
/// Independent sums of matrices in one subgroup.
const MATRIX_SUMS: usize = 8;
/// Workgroups of 256: as many as the largest devices hold at one time.
const GROUPS: usize = 2048;
const GROUP: usize = 256;
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
    /// Floating-point operations of a round, two a multiply-add.
    flop: f64,
}

impl MultiplyAdds {
    /// Compiles the kernel and finds out how long it must run.
    ///
    /// # Errors
    /// A device without timestamps or without the precision.
    pub fn new(context: &GpuContext, precision: Precision) -> Result<Self, GpuError> {
        let work = Work::new(context, precision)?;
        let mut rounds = 16;
        loop {
            let kernel = Self {
                context: context.clone(),
                program: work.program(context, rounds)?,
                rounds,
                flop: work.flop as f64,
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
        Ok(self.flop * f64::from(self.rounds) / self.seconds()?)
    }

    fn seconds(&self) -> Result<f64, GpuError> {
        let stages = self.program.submit_timed(&self.context)?;
        Ok(stages.iter().map(|stage| stage.ms * 1e-3).sum())
    }
}

/// What a round is.
struct Work {
    text: String,
    /// Floating-point operations of all workgroups.
    flop: usize,
    /// Of what is written.
    bytes: usize,
}

impl Work {
    fn new(context: &GpuContext, precision: Precision) -> Result<Self, GpuError> {
        let numbers = |text| Self {
            text,
            flop: GROUPS * GROUP * SUMS * 4 * 2,
            bytes: 16 * (2 + GROUPS * GROUP),
        };
        match precision {
            Precision::F32 => Ok(numbers(numbers_source("", "f32"))),
            Precision::F16 => Ok(numbers(numbers_source("enable f16;\n", "f16"))),
            Precision::F16Matrix => {
                let MatrixUnits { side, subgroup } = context.needed_matrix_units()?;
                // Where subgroups differ in size, those of the largest: a rate that is surely reached.
                let subgroups = GROUPS * GROUP / subgroup[1];
                Ok(Self {
                    text: matrices_source(side),
                    flop: subgroups * MATRIX_SUMS * 2 * side.pow(3),
                    bytes: 4 * GROUPS * MATRIX_SUMS * side * side,
                })
            }
        }
    }

    fn program(&self, context: &GpuContext, rounds: u32) -> Result<Program, GpuError> {
        let source = Source {
            text: &self.text,
            entry: "peak",
            constants: &[("ROUNDS", f64::from(rounds))],
        };
        let mut program = Program::default();
        let dispatch = context.checked(|| {
            let out = context.zeroed("peak", self.bytes, BufferUsages::empty());
            Kernel::new(context, &source).dispatch(&[(0, &out)], GROUPS)
        })?;
        program.stage("peak", vec![dispatch]);
        Ok(program)
    }
}

fn numbers_source(enable: &str, real: &str) -> String {
    let sum: Vec<String> = (0..SUMS).map(|i| format!("vec4<f32>(s{i})")).collect();
    let starts = lines(SUMS, |i| format!("var s{i} = vec4<{real}>({real}(id.x + {i}u));"));
    let text = include_str!("kernels/peak.wgsl")
        .replace("//{starts}", &starts)
        .replace("//{steps}", &lines(SUMS, |i| format!("s{i} = s{i} * a + b;")))
        .replace("//{sum}", &sum.join(" + "))
        .replace("Real", real);
    enable.to_owned() + &text
}

fn matrices_source(side: usize) -> String {
    let matrix = |name, real, role| format!("alias {name} = coop_mat{side}x{side}<{real}, {role}>;\n");
    let constants = [
        matrix("Left", "f16", "A"),
        matrix("Right", "f16", "B"),
        matrix("Sum", "f32", "C"),
        format!("const SIDE = {side}u; const SUMS = {MATRIX_SUMS}u;"),
    ];
    let stores = |i| format!("coopStore(s{i}, &out[at + {i}u * SIDE * SIDE], SIDE);");
    include_str!("kernels/peak_matrix.wgsl")
        .replace("//{constants}", &constants.concat())
        .replace(
            "//{starts}",
            &lines(MATRIX_SUMS, |i| format!("var s{i} = Sum();")),
        )
        .replace(
            "//{steps}",
            &lines(MATRIX_SUMS, |i| format!("s{i} = coopMultiplyAdd(a, b, s{i});")),
        )
        .replace("//{stores}", &lines(MATRIX_SUMS, stores))
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect::<Vec<_>>().join("\n")
}
