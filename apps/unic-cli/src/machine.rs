//! The machine that results come from.

use crate::invocation;

/// Returns one line with the program's version, the processor, the number of threads and the
/// command line.
///
/// Results and logs begin with it.
pub fn description() -> String {
    let cpu = cpu_name().unwrap_or_else(|| "unknown processor".to_owned());
    format!(
        "unic {} on {cpu} ({} {}), {} threads: {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        rayon::current_num_threads(),
        invocation::command_line()
    )
}

/// Returns the name of the processor, or `None` where the operating system does not tell it.
pub(crate) fn cpu_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
