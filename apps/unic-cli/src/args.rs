//! The command line.

use clap::{Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use std::{
    num::{NonZeroU32, NonZeroUsize},
    ops::Range,
    path::PathBuf,
    time::Duration,
};
use unic_io::{LowPass, Split, UpAxis, capture::JointReference};

/// Learns how one garment moves on one character, and animates it on any motion in real time.
///
/// A capture (a folder with capture.toml) goes in, a model (.unic) comes out:
///
///   unic simulate --out captures/tshirt               makes one: no files are needed
///   unic inspect captures/tshirt                      what is there, and what is wrong with it
///   unic eval --baselines captures/tshirt             the numbers to beat
///   unic train captures/tshirt --budget 45m           writes tshirt.unic
///   unic eval tshirt.unic captures/tshirt             the model beside the baselines
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
#[derive(Debug, Parser)]
#[command(name = "unic", version, verbatim_doc_comment, max_term_width = 100)]
pub(crate) struct Args {
    /// Threads to work with [default: one a core].
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Simulate(SimulateArgs),
    Train(TrainArgs),
    Eval(EvalArgs),
    Animate(AnimateArgs),
    Inspect(InspectArgs),
    /// Print a completion script, e.g. `unic completions bash > ~/.local/share/bash-completion/completions/unic`.
    Completions {
        /// The shell.
        shell: Shell,
    },
}

/// Simulate a garment on a character: make a capture to train on.
///
/// Each motion becomes a clip. The garment's rest shape lies in the character's rest pose and may
/// cut into the body; every clip begins with a settling phase in which it leaves the body and the
/// character goes over to the clip's first pose. Ctrl-C keeps the clips that are finished; --resume
/// makes the others.
///
/// Examples:
///   unic simulate --out captures/human_tshirt
///   unic simulate --garment skirt --motion walk.npz run.bvh --test run --out captures/skirt
///   unic simulate --character rig.npz --garment coat.obj --material denim --motion *.npz --out captures/coat
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct SimulateArgs {
    /// The character: character.npz, a folder that holds one, or the built-in `human`.
    #[arg(long, value_name = "FILE.npz|FOLDER|human", default_value = "human")]
    pub(crate) character: PathBuf,
    /// The garment: an .obj, a folder with garment.obj and perhaps garment.npz (`pinned` vertices are
    /// held on the body), or built in: tshirt, skirt, pleated_dress, tulle_skirt, robe.
    #[arg(long, value_name = "FILE.obj|FOLDER|NAME", default_value = "tshirt")]
    pub(crate) garment: PathBuf,
    /// Motions: npz or bvh [default: built-in idle, walks, runs, turns, jumps and dances].
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) motion: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// What the whole garment is made of [default: what its maker says, else cotton].
    #[arg(long, value_enum)]
    pub(crate) material: Option<MaterialName>,
    /// Clips held out for evaluation, by name [default: the last one].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) test: Vec<String>,
    /// Clips that training watches, by name.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) validation: Vec<String>,
    /// Joints that touch the ground, left ankle and foot, right ankle and foot, by name or by number
    /// [default: those of SMPL's names, or of its order for 24 joints].
    #[arg(long, value_name = "L,L,R,R", value_parser = parse_contacts)]
    pub(crate) contacts: Option<[JointReference; 4]>,
    /// Frames a second of the capture.
    #[arg(long, value_name = "FPS", default_value_t = 30.0)]
    pub(crate) fps: f32,
    /// Only the first seconds of each motion.
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub(crate) seconds: Option<f32>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Steady wind, m/s.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) wind: Option<glam::Vec3>,
    /// Solver steps a frame [default: 20].
    #[arg(long, value_name = "N")]
    pub(crate) substeps: Option<NonZeroU32>,
    /// Distance between cloth and body, mm [default: the material's].
    #[arg(long, value_name = "MM")]
    pub(crate) thickness: Option<f32>,
    /// Does the cloth touch itself?
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub(crate) self_collision: Switch,
    /// Draw each clip: one PNG strip a clip in this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,
    /// Go on with an interrupted simulation in the folder.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replace the capture in the folder.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// [`unic_sim::Material`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MaterialName {
    /// Shirting.
    Cotton,
    /// Trouser twill.
    Denim,
    /// Light and limp.
    Silk,
    /// Net, stiff for its weight.
    Tulle,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    /// Yes.
    On,
    /// No.
    Off,
}

/// Train a model on a capture.
///
/// Beside the model lies the run's folder (tshirt.run for tshirt.unic): settings in config.toml,
/// curves in metrics.jsonl, checkpoints, log.txt. Ctrl-C saves a checkpoint; --resume goes on from
/// it to the same result as if nothing had happened.
///
/// Without validation clips in the capture, one training clip is held out to measure the error on
/// unseen motion; then the model is trained once more on all clips (validation.refit).
///
/// Examples:
///   unic train captures/tshirt --preset tiny
///   unic train captures/tshirt --budget 45m --seed 2 --out models/tshirt.unic
///   unic train captures/tshirt --set batch.windows=64 --set optimiser.learning_rate=5e-4
///   unic train captures/tshirt --out models/tshirt.unic --resume
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct TrainArgs {
    /// Folder of the capture.
    pub(crate) capture: PathBuf,
    /// Settings to start from [default: standard].
    #[arg(long, value_enum)]
    pub(crate) preset: Option<PresetName>,
    /// Settings in TOML. Those that the file leaves out are the preset's; config.toml of any run will do.
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) config: Option<PathBuf>,
    /// One setting by its dotted key; repeat at will.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Seed of everything random.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Optimiser steps of the whole run.
    #[arg(long, value_name = "N")]
    pub(crate) steps: Option<u64>,
    /// Wall-clock time to fill instead: as many steps as this machine makes in e.g. 90s, 45m or 1h 30m.
    #[arg(long, value_name = "TIME", value_parser = parse_budget, conflicts_with = "steps")]
    pub(crate) budget: Option<Duration>,
    /// The model to write [default: the capture's name, in the working folder].
    #[arg(long, value_name = "FILE.unic")]
    pub(crate) out: Option<PathBuf>,
    /// Go on with the run beside the model.
    #[arg(long, conflicts_with_all = ["overwrite", "budget"])]
    pub(crate) resume: bool,
    /// Throw away the run that is beside the model.
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measure a model beside all baselines.
///
/// Every row is measured one-step (each frame from the true one before it) and free-running (from
/// frame 0 alone), which is the one that counts. Lengths are in millimetres. The row `prior` is what
/// the model's linear part says on its own, without the network's field.
///
/// Examples:
///   unic eval --baselines captures/tshirt
///   unic eval tshirt.unic captures/tshirt
///   unic eval tshirt.unic captures/tshirt --pictures worst --json > numbers.json
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment, allow_missing_positional = true)]
pub(crate) struct EvalArgs {
    /// The model (.unic).
    #[arg(required_unless_present = "baselines", conflicts_with = "baselines")]
    pub(crate) model: Option<PathBuf>,
    /// Folder of the capture.
    #[arg(required = true)]
    pub(crate) capture: PathBuf,
    /// The baselines alone, without a model.
    #[arg(long)]
    pub(crate) baselines: bool,
    /// Clips to measure on.
    #[arg(long, value_enum, default_value_t = SplitName::Test)]
    pub(crate) split: SplitName,
    /// Clips to measure on by name, whatever their split.
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        conflicts_with = "split"
    )]
    pub(crate) clips: Vec<String>,
    /// What becomes of vertices inside the body [default: as the model was trained for].
    #[arg(long, value_enum, conflicts_with = "baselines")]
    pub(crate) intersection: Option<IntersectionName>,
    /// Keep every predicted position: one npz a clip in this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) dump: Option<PathBuf>,
    /// Draw the model's worst free-running frames: one PNG a clip in this folder.
    #[arg(long, value_name = "DIR", conflicts_with = "baselines")]
    pub(crate) pictures: Option<PathBuf>,
    /// Print the numbers as one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Animate a garment on a motion.
///
/// The motion is an npz file with poses and trans, as AMASS and captures have it, or a BVH file of
/// any skeleton; it is resampled to the model's frame rate. The body goes beside the garment
/// (walk.body.pc2 for walk.pc2), and so does a picture (walk.png). For .pc2, walk.obj and
/// walk.body.obj are the meshes that the caches belong to.
///
/// Examples:
///   unic animate tshirt.unic --motion walk.npz --out walk.pc2
///   unic animate tshirt.unic --motion amass/run.npz --up z --frames 60..240 --out frames
///   unic animate tshirt.unic --motion walk.npz --mesh tshirt_fine.obj --out walk_fine.npz
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct AnimateArgs {
    /// The model (.unic).
    pub(crate) model: PathBuf,
    /// The motion: npz with poses (T, 3J), trans (T, 3) and a frame rate, or BVH of any skeleton.
    #[arg(long, value_name = "FILE.npz|FILE.bvh")]
    pub(crate) motion: PathBuf,
    /// The animation: .pc2, .npz, or a folder of OBJ files.
    #[arg(long, value_name = "FILE.pc2|FILE.npz|FOLDER")]
    pub(crate) out: PathBuf,
    /// Another mesh of the same garment, in the same rest space.
    #[arg(long, value_name = "OTHER.obj")]
    pub(crate) mesh: Option<PathBuf>,
    /// Where the picture goes [default: beside the animation].
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// What becomes of vertices inside the body [default: as the model was trained for].
    #[arg(long, value_enum)]
    pub(crate) intersection: Option<IntersectionName>,
    /// The garment at the first frame, in world space: .obj, or the first frame of a .pc2, a .npy or
    /// an npz (a capture's clip) [default: the mean shape of training].
    #[arg(long, value_name = "FILE")]
    pub(crate) start: Option<PathBuf>,
    /// Only these frames of the motion, counted from 0 at the model's frame rate, the last one
    /// excluded; the garment starts at the first of them.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    pub(crate) frames: Option<Range<usize>>,
    /// Print one JSON object about the result on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Say what a file or folder holds, and what is wrong with it.
///
/// Knows captures, characters, motions, meshes, vertex animations, numpy arrays and models. The
/// exit code is 1 where something is wrong.
///
/// With --coverage it says how much of a motion lies within what a capture has seen, and what the
/// capture lacks.
///
/// Examples:
///   unic inspect captures/tshirt
///   unic inspect walk.bvh --json
///   unic inspect --coverage captures/tshirt cartwheel.bvh
///   unic inspect --coverage captures/tshirt            its test clips by its training clips
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct InspectArgs {
    /// The file or folder; with --coverage any number of motions [default: the capture's test clips].
    #[arg(required_unless_present = "coverage")]
    pub(crate) path: Vec<PathBuf>,
    /// Compare motions with the training clips of this capture.
    #[arg(long, value_name = "CAPTURE")]
    pub(crate) coverage: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How motion files are read.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Motion files")]
pub(crate) struct MotionArgs {
    /// Which axis points up in the motion file.
    #[arg(long, value_enum, default_value_t = UpName::Auto)]
    pub(crate) up: UpName,
    /// Joints of a BVH file whose names do not tell what they are (TOML).
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) bone_map: Option<PathBuf>,
    /// Take out what is faster than this many Hz; 0 takes out nothing [default: 10 for BVH].
    #[arg(long, value_name = "HZ", value_parser = parse_low_pass)]
    pub(crate) low_pass: Option<LowPass>,
    /// Repeat the best cycle of a short motion this often, ends blended.
    #[arg(long, value_name = "TIMES")]
    pub(crate) repeat: Option<NonZeroUsize>,
}

/// [`unic_train::Preset`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PresetName {
    /// The published method with its sizes, for comparison.
    Paper,
    /// The best that we know.
    Standard,
    /// Small, for slow machines and first tries.
    Tiny,
}

/// [`Split`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SplitName {
    /// What nothing was fitted on.
    Test,
    /// What training watches.
    Validation,
    /// What training fits.
    Train,
}

/// [`unic_core::config::IntersectionMode`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum IntersectionName {
    /// They stay there.
    Off,
    /// They are dragged out over the tangent plane of the nearest body vertex, as in the paper.
    Paper,
}

/// [`UpAxis`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpName {
    /// Whichever the body's up direction follows on average.
    Auto,
    /// As here.
    Y,
    /// As in AMASS.
    Z,
}

impl From<PresetName> for unic_train::Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Paper => Self::Paper,
            PresetName::Standard => Self::Standard,
            PresetName::Tiny => Self::Tiny,
        }
    }
}

impl From<MaterialName> for unic_sim::Material {
    fn from(name: MaterialName) -> Self {
        match name {
            MaterialName::Cotton => Self::COTTON,
            MaterialName::Denim => Self::DENIM,
            MaterialName::Silk => Self::SILK,
            MaterialName::Tulle => Self::TULLE,
        }
    }
}

impl From<SplitName> for Split {
    fn from(name: SplitName) -> Self {
        match name {
            SplitName::Test => Self::Test,
            SplitName::Validation => Self::Validation,
            SplitName::Train => Self::Train,
        }
    }
}

impl From<UpName> for UpAxis {
    fn from(name: UpName) -> Self {
        match name {
            UpName::Auto => Self::Auto,
            UpName::Y => Self::Y,
            UpName::Z => Self::Z,
        }
    }
}

fn parse_budget(text: &str) -> Result<Duration, String> {
    let budget = humantime::parse_duration(text).map_err(|e| format!("{e}; write 90s, 45m or 1h 30m"))?;
    match budget.is_zero() {
        true => Err("a time above zero, such as 45m, is needed".into()),
        false => Ok(budget),
    }
}

fn parse_low_pass(text: &str) -> Result<LowPass, String> {
    match text.parse::<f32>() {
        Ok(0.0) => Ok(LowPass::Off),
        Ok(hertz) if hertz.is_finite() && hertz > 0.0 => Ok(LowPass::Hertz(hertz)),
        _ => Err("a frequency in Hz is needed, such as 8, or 0 for none".into()),
    }
}

fn parse_seconds(text: &str) -> Result<f32, String> {
    let seconds: Option<f32> = text.parse().ok().filter(|s: &f32| s.is_finite() && *s > 0.0);
    seconds.ok_or_else(|| "a number of seconds above zero is needed, such as 10".into())
}

fn parse_contacts(text: &str) -> Result<[JointReference; 4], String> {
    let joint = |name: &str| match name.parse() {
        Ok(index) => JointReference::Index(index),
        Err(_) => JointReference::Name(name.to_owned()),
    };
    let joints: Vec<JointReference> = text.split(',').map(|name| joint(name.trim())).collect();
    <[JointReference; 4]>::try_from(joints)
        .map_err(|found| format!("four joints are needed, such as 7,10,8,11; found {}", found.len()))
}

fn parse_vector(text: &str) -> Result<glam::Vec3, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map_while(|part| part.trim().parse().ok())
        .collect();
    let vector = <[f32; 3]>::try_from(numbers).ok().map(glam::Vec3::from);
    vector
        .filter(|v| v.is_finite())
        .ok_or_else(|| "three numbers X,Y,Z are needed, such as 0,0,-3".into())
}

fn parse_frames(text: &str) -> Result<Range<usize>, String> {
    let parsed = text
        .split_once("..")
        .and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    let range: Option<Range<usize>> = parsed.filter(|r: &Range<usize>| r.start < r.end);
    range.ok_or_else(|| "two whole numbers A..B with A below B are needed, such as 60..240".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

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
        assert_eq!(parse_budget("1h 30m"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse_budget("45m"), Ok(Duration::from_secs(2700)));
        assert!(parse_budget("45").is_err() && parse_budget("0s").is_err());
        assert_eq!(parse_frames("60..240"), Ok(60..240));
        for wrong in ["60", "60..60", "9..2", "a..b", "-1..4"] {
            assert!(parse_frames(wrong).is_err(), "{wrong}");
        }
    }
}
