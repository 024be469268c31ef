//! `unic demo`.

use clap::ValueEnum;
use std::path::PathBuf;

/// From nothing to a moving garment: simulate, train, evaluate, animate.
///
/// Needs no files. The built-in human wears a built-in garment in built-in motions; a model learns it
/// from the simulation and is measured on motions that it has not seen. Each stage is a command that
/// you can run yourself, and is printed. What is there already is kept: after Ctrl-C the same command
/// goes on.
///
/// In the folder afterwards: report.html to look at, animation.glb for Blender, the model
/// (demo.unic), and the capture.
///
/// Examples:
///   unic demo
///   unic demo --garment skirt --out skirt_demo
///   unic demo --quick
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct DemoArgs {
    /// What is worn.
    #[arg(long, value_enum, default_value_t = DemoGarment::Tshirt)]
    pub(crate) garment: DemoGarment,
    /// The folder to write.
    #[arg(long, value_name = "DIR", default_value = "unic_demo")]
    pub(crate) out: PathBuf,
    /// Less motion and less training: within 90 seconds, to see that everything works.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Make everything in the folder anew.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the result on stdout; what the stages print goes to stderr.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Garments that a demo is made of: they simulate in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DemoGarment {
    /// Fitted, of cotton.
    Tshirt,
    /// Flared, knee-length.
    Skirt,
}
