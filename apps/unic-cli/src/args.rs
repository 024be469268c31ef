//! Options and arguments of every command, as clap parses them. The doc comments are the help
//! texts.

mod animate;
mod bench;
mod code;
mod control;
mod demo;
mod eval;
mod export;
mod import;
mod inspect;
#[cfg(feature = "viewer")]
mod looks;
mod motion;
mod motion_database;
mod motion_source;
mod names;
pub mod parse;
#[cfg(feature = "viewer")]
mod play;
mod precision;
mod retarget;
mod simulate;
mod threads;
mod train;
#[cfg(feature = "viewer")]
mod view;

pub(crate) use animate::AnimateArgs;
pub(crate) use bench::{BenchArgs, OtherBench};
pub(crate) use code::CodeArgs;
pub(crate) use control::ControlArgs;
pub(crate) use demo::{DemoArgs, DemoGarment};
pub(crate) use eval::EvalArgs;
pub(crate) use export::ExportArgs;
pub(crate) use import::{ImportArgs, ImportFiles};
pub(crate) use inspect::InspectArgs;
#[cfg(feature = "viewer")]
pub(crate) use looks::LooksArgs;
pub(crate) use motion::MotionArgs;
pub(crate) use motion_database::MotionDatabaseArgs;
pub(crate) use motion_source::{CharacterArgs, ClipArgs, MotionSourceArgs};
pub(crate) use names::{
    FeetName, MaterialName, MeshUpName, NetworkName, PrecisionName, ProtocolName, SplitName, Switch, UpName,
};
pub use names::{IntersectionName, PresetName, ProcessorName};
#[cfg(feature = "viewer")]
pub(crate) use names::{RendererName, ScriptName};
#[cfg(feature = "viewer")]
pub(crate) use play::{PlayArgs, RecordArgs};
pub(crate) use precision::{PrecisionArgs, warn_if_slow};
pub(crate) use retarget::RetargetArgs;
pub(crate) use simulate::SimulateArgs;
pub use threads::ThreadArgs;
pub use train::TrainArgs;
#[cfg(feature = "viewer")]
pub(crate) use view::{PictureArgs, ViewArgs};

use clap::{Parser, Subcommand};
use clap_complete::Shell;

/// Learns how one garment moves on one character, then animates it on new motion in real time.
///
/// A capture is a folder with a character, a garment and clips. A clip is one motion with the
/// garment's vertex positions in every frame. Training turns a capture into a model (.unic).
///
/// The usual order of commands:
///
///   unic demo                                         runs all steps on built-in data, in minutes
///   unic simulate --out captures/tshirt               makes a capture by cloth simulation
///   unic import --garment coat.pc2 ... --out captures/coat   makes one of your own files
///   unic inspect captures/tshirt                      shows its contents and reports problems
///   unic eval --baselines captures/tshirt             measures simple methods, for comparison
///   unic train captures/tshirt --budget 45m           trains a model and writes tshirt.unic
///   unic eval tshirt.unic captures/tshirt             measures the model beside those methods
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
///   unic play tshirt.unic                             steers a character that wears it
///   unic bench                                        measures how long a frame takes
// Help texts are taken verbatim, here and in every command: clap would join the lines of their
// lists and examples into paragraphs. They fit into 100 columns.
#[derive(Debug, Parser)]
#[command(name = "unic", version, verbatim_doc_comment, max_term_width = 100)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) threads: ThreadArgs,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(DemoArgs),
    Simulate(SimulateArgs),
    Import(ImportArgs),
    Train(TrainArgs),
    Eval(EvalArgs),
    Animate(AnimateArgs),
    #[cfg(feature = "viewer")]
    Play(PlayArgs),
    #[cfg(feature = "viewer")]
    View(ViewArgs),
    Inspect(InspectArgs),
    Bench(BenchArgs),
    Export(ExportArgs),
    Retarget(RetargetArgs),
    MotionDatabase(MotionDatabaseArgs),
    /// Print a script that completes commands and options in a shell.
    ///
    /// Example:
    ///   unic completions bash > ~/.local/share/bash-completion/completions/unic
    #[command(verbatim_doc_comment)]
    Completions {
        /// Shell to print the script for.
        shell: Shell,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::time::Duration;

    #[test]
    fn clap_accepts_the_definition() {
        Args::command().debug_assert();
    }

    #[test]
    fn eval_takes_one_path_or_two() {
        let eval = |line: &str| match Args::try_parse_from(line.split(' ')).map(|a| a.command) {
            Ok(Command::Eval(args)) => Some((args.model, args.capture)),
            _ => None,
        };
        assert_eq!(eval("unic eval --baselines c"), Some((None, "c".into())));
        assert_eq!(eval("unic eval m c"), Some((Some("m".into()), "c".into())));
        assert_eq!(eval("unic eval c"), None);
        assert_eq!(eval("unic eval --baselines m c"), None);
    }

    #[test]
    fn budgets_and_frame_ranges_are_parsed() {
        assert_eq!(parse::budget("1h 30m"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse::budget("45m"), Ok(Duration::from_secs(2700)));
        assert!(parse::budget("45").is_err() && parse::budget("0s").is_err());
        assert_eq!(parse::frames("60..240"), Ok(60..240));
        for wrong in ["60", "60..60", "9..2", "a..b", "-1..4"] {
            assert!(parse::frames(wrong).is_err(), "{wrong}");
        }
    }
}
