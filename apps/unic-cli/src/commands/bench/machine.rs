//! The machine that is measured.

use crate::machine::cpu_name;
use serde::Serialize;
use unic_core::Precision;

/// Description of the machine in the JSON result.
#[derive(Serialize)]
pub(super) struct Machine {
    /// Name of the processor, or its architecture where the system does not tell the name.
    cpu: String,
    /// Number of processors that the program may use.
    cores: usize,
    /// Instruction set of the field for each precision.
    instructions: serde_json::Value,
    /// Name of the operating system.
    os: &'static str,
}

impl Machine {
    /// Describes the machine that the program runs on.
    pub(super) fn this() -> Self {
        let best = |p: Precision| (p.name().to_owned(), p.best_instructions().name().into());
        Self {
            cpu: cpu_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            instructions: serde_json::Value::Object(Precision::ALL.into_iter().map(best).collect()),
            os: std::env::consts::OS,
        }
    }

    /// Returns the description in one line.
    pub(super) fn line(&self) -> String {
        format!("{}, cores: {}, {}", self.cpu, self.cores, self.instructions)
    }
}
