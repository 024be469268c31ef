//! `unic bench`.

mod accuracy;
mod lasting;
mod speed;

use crate::args::{Bench, BenchArgs};
use anyhow::Result;

/// Measures and prints.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    match &args.command {
        None => speed::run(&args.speed),
        Some(Bench::Accuracy(args)) => accuracy::run(args),
        Some(Bench::Lasting(args)) => lasting::run(args),
    }
}
