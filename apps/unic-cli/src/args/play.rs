//! Options of `unic play`.

use super::{LooksArgs, MotionSourceArgs, PrecisionArgs, RendererName, ScriptName, Switch, parse};
use crate::checks::ForceArgs;
use std::path::PathBuf;

/// Steer a dressed character in a window.
///
/// Motion matching makes the character's motion from clips, and the garment follows without
/// simulation. Without a model the character wears the garments that come with the program.
///
/// --record writes a movie of a scripted walk instead, without a window. The format follows from
/// the name: .gif, .mp4 (in builds with the feature mp4), or a folder of PNG files.
///
/// Examples:
///   unic play
///   unic play skirt
///   unic play shirt.unic coat.unic --characters 16
///   unic play shirt.unic --motion walks/*.npz --exclude jump
///   unic play --record figure8.gif --seconds 8
///   unic play skirt --fabric satin --print none --colour 7a1f2b
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct PlayArgs {
    /// Models, between which a key switches. `tshirt` and `skirt` come with the program, and are the
    /// default.
    #[arg(value_name = "MODEL.unic|tshirt|skirt")]
    pub(crate) models: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) source: MotionSourceArgs,
    /// Number of characters; the others follow the first one.
    #[arg(long, value_name = "N", value_parser = parse::characters, default_value_t = 1)]
    pub(crate) characters: usize,
    /// Setting from quality (0: motion as captured) to responsiveness (1: commands at once).
    #[arg(long, value_name = "SHARE", value_parser = parse::share, default_value_t = 0.5)]
    pub(crate) responsiveness: f32,
    /// Garments on the graphics device [default: on hardware, and not on a driver that computes on
    /// the processor].
    #[arg(long, value_name = "on|off", value_enum)]
    pub(crate) gpu_garments: Option<Switch>,
    #[command(flatten)]
    pub(crate) precision: PrecisionArgs,
    #[command(flatten)]
    pub(crate) looks: LooksArgs,
    #[command(flatten)]
    pub(crate) record: RecordArgs,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
}

const HEADING: &str = "Movie";

/// Options for a movie instead of a window.
#[derive(Debug, clap::Args)]
pub(crate) struct RecordArgs {
    /// Movie to write: a .gif, an .mp4 or a folder of PNG files.
    #[arg(long, help_heading = HEADING, value_name = "FILE.gif|FILE.mp4|FOLDER")]
    pub(crate) record: Option<PathBuf>,
    /// Duration of the movie, seconds.
    #[arg(long, help_heading = HEADING, value_name = "SECONDS", value_parser = parse::seconds, default_value_t = 8.0,
        requires = "record")]
    pub(crate) seconds: f32,
    /// Script that steers the character.
    #[arg(long, help_heading = HEADING, value_enum, default_value_t = ScriptName::Figure8, requires = "record")]
    pub(crate) script: ScriptName,
    /// Pictures a second.
    #[arg(long, help_heading = HEADING, value_name = "FPS", value_parser = parse::frame_rate, default_value_t = 25.0,
        requires = "record")]
    pub(crate) fps: f32,
    /// Width and height of the pictures, pixels.
    #[arg(long, help_heading = HEADING, value_name = "WIDTHxHEIGHT", value_parser = parse::size,
        default_value = "640x360", requires = "record")]
    pub(crate) size: [u32; 2],
    /// Program part that draws the pictures.
    #[arg(long, help_heading = HEADING, value_enum, default_value_t = RendererName::Auto, requires = "record")]
    pub(crate) renderer: RendererName,
    /// Replace an existing movie.
    #[arg(long, help_heading = HEADING, requires = "record")]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the movie on stdout: frames, times and what drew it.
    #[arg(long, help_heading = HEADING, requires = "record")]
    pub(crate) json: bool,
}
