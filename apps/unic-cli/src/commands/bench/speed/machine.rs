//! What is measured on.

use crate::commands::cpu_name;
use serde::Serialize;
use unic_core::network::{Instructions, Precision};

#[derive(Serialize)]
pub(super) struct Machine {
    /// Name of the processor, where the system tells.
    cpu: String,
    cores: usize,
    /// By precision, what the field runs on.
    instructions: serde_json::Value,
    os: &'static str,
}

impl Machine {
    pub(super) fn this() -> Self {
        let best = |p: Precision| {
            (
                p.name().to_owned(),
                format!("{:?}", Instructions::best(p)).to_lowercase().into(),
            )
        };
        Self {
            cpu: cpu_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            instructions: serde_json::Value::Object(Precision::ALL.into_iter().map(best).collect()),
            os: std::env::consts::OS,
        }
    }

    pub(super) fn line(&self) -> String {
        format!("{}, cores: {}, {}", self.cpu, self.cores, self.instructions)
    }
}
