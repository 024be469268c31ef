//! Plausible mistakes in what a command reads: refused before any work, unless `--force` goes on.

use crate::{interrupt, output::say};
use anyhow::{Result, bail};
use std::path::Path;
use unic_io::{
    Capture, Split,
    check::{self, Finding},
};

/// Whether plausible mistakes stop a command.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct ForceArgs {
    /// Go on with input that is probably a mistake; what was found is said all the same.
    #[arg(long)]
    pub(crate) force: bool,
}

impl ForceArgs {
    /// Says what was found in the file or folder `path`.
    ///
    /// # Errors
    /// The first finding, unless the user goes on all the same.
    pub(crate) fn settle(self, path: &Path, findings: &[Finding]) -> Result<()> {
        let path = path.display();
        if self.force {
            findings
                .iter()
                .for_each(|finding| say(&format!("{path}: {finding}")));
            return Ok(());
        }
        match findings {
            [] => Ok(()),
            [finding] => bail!("{path}: {finding}, or go on with --force"),
            [first, rest @ ..] => bail!(
                "{path}: {first}, or go on with --force; and {} more, of which the next is {}",
                rest.len(),
                rest[0]
            ),
        }
    }

    /// A capture with its clips of all splits.
    pub(crate) fn capture(self, capture: &Capture) -> Result<()> {
        let mut proceed = || -> Result<()> { Ok(interrupt::check()?) };
        self.settle(
            &capture.root,
            &check::capture(capture, &Split::ALL, &mut proceed)?,
        )
    }
}
