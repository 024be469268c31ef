//! `unic bench`.

mod accuracy;
mod lasting;

use crate::args::{Bench, BenchArgs};
use anyhow::Result;

/// Measures and prints.
pub(crate) fn run(args: &BenchArgs) -> Result<()> {
    match &args.bench {
        Bench::Accuracy(args) => accuracy::run(args),
        Bench::Lasting(args) => lasting::run(args),
    }
}
