//! The program `unic-lab`: benchmarks for research with `unic`.

mod accuracy;
mod args;
mod comparison;
mod lasting;
mod pretrain;
mod wardrobe;

use anyhow::Result;
use args::{Args, Command};
use std::{num::NonZeroUsize, process::ExitCode};
use unic_cli::program::{self, Program};

fn main() -> ExitCode {
    ExitCode::from(program::run::<Args>(std::env::args_os()))
}

impl Program for Args {
    const NAME: &'static str = "unic-lab";

    fn threads(&self) -> Option<NonZeroUsize> {
        self.threads.count()
    }

    fn run_command(&self) -> Result<()> {
        match &self.command {
            Command::Accuracy(args) => accuracy::run(args),
            Command::Lasting(args) => lasting::run(args),
            Command::Pretrain(args) => pretrain::run(args),
            Command::Wardrobe(args) => wardrobe::run(args),
        }
    }
}
