//! One module a subcommand.

pub(crate) mod animate;
pub(crate) mod bench;
pub(crate) mod demo;
pub(crate) mod eval;
pub(crate) mod inspect;
pub(crate) mod simulate;
pub(crate) mod train;

use crate::{args::Args, output};
use anyhow::Result;
use clap::CommandFactory;
use clap_complete::{Shell, generate};

/// Prints the completion script of a shell.
pub(crate) fn completions(shell: Shell) -> Result<()> {
    let mut script = Vec::new();
    generate(shell, &mut Args::command(), "unic", &mut script);
    output::print(&String::from_utf8_lossy(&script))
}

/// One line about the program and the machine.
pub(crate) fn machine() -> String {
    let cpu = cpu_name().unwrap_or_else(|| "unknown processor".to_owned());
    let command: Vec<String> = std::env::args().collect();
    format!(
        "unic {} on {cpu} ({} {}), {} threads: {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        rayon::current_num_threads(),
        command.join(" ")
    )
}

/// The processor's own, where the system tells.
pub(crate) fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
