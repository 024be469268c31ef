//! Checks of a command's input for plausible mistakes, such as another unit.
//!
//! A finding stops the command before any work is done. `--force` turns it into a warning.

use crate::{interrupt, output::print_status};
use anyhow::{Result, bail};
use std::path::Path;
use unic_io::{
    Capture, Split,
    check::{self, Finding},
};

/// Option that turns plausible mistakes from errors into warnings.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct ForceArgs {
    /// Continue with input that is probably a mistake, and print what was found.
    #[arg(long)]
    pub force: bool,
}

impl ForceArgs {
    /// Reports the findings in the file or folder `path`.
    ///
    /// # Errors
    /// The first finding, unless `--force` is given.
    pub fn check_findings(self, path: &Path, findings: &[Finding]) -> Result<()> {
        let path = path.display();
        if self.force {
            findings
                .iter()
                .for_each(|finding| print_status(&format!("{path}: {finding}")));
            return Ok(());
        }
        match findings {
            [] => Ok(()),
            [finding] => bail!("{path}: {finding}, or continue with --force"),
            [first, rest @ ..] => bail!(
                "{path}: {first}, or continue with --force; and {} more, of which the next is {}",
                rest.len(),
                rest[0]
            ),
        }
    }

    /// Checks a capture with the clips of all splits, and reports the findings.
    ///
    /// # Errors
    /// The first finding, unless `--force` is given; clips that cannot be read; an interruption.
    pub fn check_capture(self, capture: &Capture) -> Result<()> {
        let mut proceed = || -> Result<()> { Ok(interrupt::check()?) };
        self.check_findings(
            &capture.root,
            &check::capture(capture, &Split::ALL, &mut proceed)?,
        )
    }
}
