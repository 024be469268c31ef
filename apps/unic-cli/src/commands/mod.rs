//! One module for each command.
//!
//! Only what other programs run is public.

pub(crate) mod animate;
pub(crate) mod bench;
pub(crate) mod demo;
pub(crate) mod eval;
pub(crate) mod export;
pub(crate) mod import;
pub(crate) mod inspect;
pub(crate) mod motion_database;
#[cfg(feature = "viewer")]
pub(crate) mod play;
pub(crate) mod retarget;
pub(crate) mod simulate;
pub mod train;
#[cfg(feature = "viewer")]
pub(crate) mod view;

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
