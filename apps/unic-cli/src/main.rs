//! The program `unic`.

use std::process::ExitCode;

fn main() -> ExitCode {
    unic_cli::run(std::env::args_os())
}
