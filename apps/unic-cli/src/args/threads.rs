//! The option `--threads`.

use super::parse;
use std::num::NonZeroUsize;

/// Number of threads of a program.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ThreadArgs {
    /// Number of threads [default: one per core].
    #[arg(long, global = true, value_name = "N", value_parser = parse::threads)]
    threads: Option<NonZeroUsize>,
}

impl ThreadArgs {
    /// Returns the number asked for. `None` stands for one per core.
    pub fn count(self) -> Option<NonZeroUsize> {
        self.threads
    }
}
