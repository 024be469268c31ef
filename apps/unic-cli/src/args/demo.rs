//! Options of `unic demo`.

use clap::ValueEnum;
use std::path::PathBuf;

/// Run all steps on built-in data: simulate a garment, train, evaluate and animate a model.
///
/// Needs no files. A built-in character wears a built-in garment in built-in motions. A model
/// learns the simulated garment and is measured on motions that it has not seen. Each stage prints
/// and runs one `unic` command that you can run yourself. Finished stages are skipped, so the same
/// command continues after Ctrl-C.
///
/// The folder then holds:
///   report.html     the errors of the model, with movies; open it in a browser
///   animation.glb   body and garment in motion; open it in Blender
///   animation.png   moments of that motion, side by side
///   demo.unic       the trained model
///   capture         the training data: a folder with character, garment and simulated clips,
///                   which other commands call a capture
///
/// Examples:
///   unic demo
///   unic demo --garment skirt --out skirt_demo
///   unic demo --quick
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct DemoArgs {
    /// Garment that the character wears.
    #[arg(long, value_enum, default_value_t = DemoGarment::Tshirt)]
    pub(crate) garment: DemoGarment,
    /// Folder to write.
    #[arg(long, value_name = "DIR", default_value = "unic_demo")]
    pub(crate) out: PathBuf,
    /// Use less motion and less training, to check within 90 seconds that everything works.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Run all stages again and replace their results.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the result to stdout, and the output of the stages to stderr.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Built-in garments that simulate in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DemoGarment {
    /// Fitted cotton T-shirt.
    Tshirt,
    /// Flared, knee-length skirt.
    Skirt,
}
