//! The command line.

mod animate;
mod bench;
mod code;
mod demo;
mod eval;
mod inspect;
mod motion;
mod names;
mod parse;
mod simulate;
mod train;

pub(crate) use animate::AnimateArgs;
pub(crate) use bench::{AccuracyArgs, Bench, BenchArgs, LastingArgs, SpeedArgs};
pub(crate) use code::CodeArgs;
pub(crate) use demo::{DemoArgs, DemoGarment};
pub(crate) use eval::EvalArgs;
pub(crate) use inspect::InspectArgs;
pub(crate) use motion::MotionArgs;
pub(crate) use names::{
    IntersectionName, MaterialName, NetworkName, PrecisionName, PresetName, ProcessorName, ProtocolName,
    SplitName, Switch, UpName,
};
pub(crate) use simulate::SimulateArgs;
pub(crate) use train::TrainArgs;

use clap::{Parser, Subcommand};
use clap_complete::Shell;
use std::num::NonZeroUsize;

/// Learns how one garment moves on one character, and animates it on any motion in real time.
///
/// A capture (a folder with capture.toml) goes in, a model (.unic) comes out:
///
///   unic demo                                         all of it in minutes: no files are needed
///   unic simulate --out captures/tshirt               makes a capture
///   unic inspect captures/tshirt                      what is there, and what is wrong with it
///   unic eval --baselines captures/tshirt             the numbers to beat
///   unic train captures/tshirt --budget 45m           writes tshirt.unic
///   unic eval tshirt.unic captures/tshirt             the model beside the baselines
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
///   unic bench                                        how fast this machine is
#[derive(Debug, Parser)]
#[command(name = "unic", version, verbatim_doc_comment, max_term_width = 100)]
pub(crate) struct Args {
    /// Threads to work with [default: one a core].
    #[arg(long, global = true, value_name = "N", value_parser = parse::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Demo(DemoArgs),
    Simulate(SimulateArgs),
    Train(TrainArgs),
    Eval(EvalArgs),
    Animate(AnimateArgs),
    Inspect(InspectArgs),
    Bench(BenchArgs),
    /// Print a completion script, e.g. `unic completions bash > ~/.local/share/bash-completion/completions/unic`.
    Completions {
        /// The shell.
        shell: Shell,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::time::Duration;

    #[test]
    fn the_definition_is_consistent() {
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
    fn budgets_and_frames() {
        assert_eq!(parse::budget("1h 30m"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse::budget("45m"), Ok(Duration::from_secs(2700)));
        assert!(parse::budget("45").is_err() && parse::budget("0s").is_err());
        assert_eq!(parse::frames("60..240"), Ok(60..240));
        for wrong in ["60", "60..60", "9..2", "a..b", "-1..4"] {
            assert!(parse::frames(wrong).is_err(), "{wrong}");
        }
    }
}
