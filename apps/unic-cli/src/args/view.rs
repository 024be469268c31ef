//! Options of `unic view`.

use super::{LooksArgs, MotionArgs, PrecisionArgs, RendererName, parse};
use crate::checks::ForceArgs;
use clap::ValueEnum;
use std::path::PathBuf;
use unic_viewer::{Quantity, Side};

/// Look at models, captures and animations side by side.
///
/// The window has a timeline and one camera for all panes; H shows the keys. With a capture and
/// models it shows the ground truth, the prediction of each model in free running, and skinning.
/// The timeline shows the error of each over time. Files dropped on the window are added.
///
/// A model moves as the clip of the capture does, or as --motion. Without both, a model of the
/// built-in human walks. An animation is what `unic animate` writes, except .glb: Alembic, USD, .pc2,
/// .mdd, .npz or a folder of OBJ files.
///
/// --record writes a movie instead, and --screenshot a picture; both need no window, and without a
/// graphics adapter the software rasteriser draws them.
///
/// Examples:
///   unic view captures/tshirt
///   unic view captures/tshirt tshirt.unic tshirt_new.unic --clip dance
///   unic view tshirt.unic --motion walk.npz
///   unic view walk.pc2
///   unic view captures/tshirt tshirt.unic --show error --record dance.gif --seconds 5
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ViewArgs {
    /// Models (.unic), one capture (a folder), and animations (.abc, .usdc, .usda, .pc2, .mdd,
    /// .npz or folders of OBJ files).
    #[arg(required = true, value_name = "MODEL|CAPTURE|ANIMATION")]
    pub(crate) paths: Vec<PathBuf>,
    /// Clip of the capture [default: the first test clip, else the first clip].
    #[arg(long, value_name = "NAME")]
    pub(crate) clip: Option<String>,
    /// Motion of models whose skeleton no clip fits: npz, BVH, glTF, FBX or USD, or a built-in one by
    /// its name, such as dance.
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) motion: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: MotionArgs,
    /// Quantity that is shown first.
    #[arg(long, value_enum, default_value_t = QuantityName::Lit)]
    pub(crate) show: QuantityName,
    /// Error at the light end of the heat map, millimetres.
    #[arg(long, value_name = "MM", value_parser = parse::millimetres, default_value_t = 50.0)]
    pub(crate) heat_max: f32,
    #[command(flatten)]
    pub(crate) precision: PrecisionArgs,
    #[command(flatten)]
    pub(crate) looks: LooksArgs,
    #[command(flatten)]
    pub(crate) record: PictureArgs,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
}

const HEADING: &str = "Pictures instead of a window";

/// Options for pictures instead of a window.
#[derive(Debug, clap::Args)]
pub(crate) struct PictureArgs {
    /// Movie to write: a .gif, an .mp4 (in builds with the feature mp4) or a folder of PNG files.
    #[arg(long, help_heading = HEADING, value_name = "FILE.gif|FILE.mp4|FOLDER")]
    pub(crate) record: Option<PathBuf>,
    /// Picture to write.
    #[arg(long, help_heading = HEADING, value_name = "FILE.png")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Time of the picture and start of the movie, seconds [default: the start; for a picture alone,
    /// the middle].
    #[arg(long, help_heading = HEADING, value_name = "SECONDS", value_parser = parse::time)]
    pub(crate) at: Option<f32>,
    /// Duration of the movie, seconds [default: to the end of the motion].
    #[arg(long, help_heading = HEADING, value_name = "SECONDS", value_parser = parse::seconds, requires = "record")]
    pub(crate) seconds: Option<f32>,
    /// Pictures a second [default: the frame rate of the motion].
    #[arg(long, help_heading = HEADING, value_name = "FPS", value_parser = parse::frame_rate, requires = "record")]
    pub(crate) fps: Option<f32>,
    /// Side of the character that the camera sees, at the time of the picture or at the start
    /// [default: three quarters from the front].
    #[arg(long, help_heading = "Looks", value_enum, value_name = "SIDE")]
    pub(crate) from: Option<SideName>,
    /// Show the garment from near, and not the whole character.
    #[arg(long, help_heading = "Looks")]
    pub(crate) close: bool,
    /// Width and height of the pictures, pixels.
    #[arg(long, help_heading = HEADING, value_name = "WIDTHxHEIGHT", value_parser = parse::size,
        default_value = "1280x720")]
    pub(crate) size: [u32; 2],
    /// Program part that draws the pictures.
    #[arg(long, help_heading = HEADING, value_enum, default_value_t = RendererName::Auto)]
    pub(crate) renderer: RendererName,
    /// Replace existing files.
    #[arg(long, help_heading = HEADING)]
    pub(crate) overwrite: bool,
    /// Print one JSON object about the pictures to stdout.
    #[arg(long, help_heading = HEADING)]
    pub(crate) json: bool,
}

/// [`Side`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SideName {
    /// Chest.
    Front,
    /// Back.
    Back,
    /// Left arm.
    Left,
    /// Right arm.
    Right,
}

impl From<SideName> for Side {
    fn from(name: SideName) -> Self {
        match name {
            SideName::Front => Self::Front,
            SideName::Back => Self::Back,
            SideName::Left => Self::Left,
            SideName::Right => Self::Right,
        }
    }
}

/// [`Quantity`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum QuantityName {
    /// Materials in light and shadow.
    Lit,
    /// Materials with the edges of the meshes.
    Wireframe,
    /// Normals as colours.
    Normals,
    /// Distance from the ground truth as a heat map.
    Error,
    /// Skinning weights as blends of the joints' colours.
    Weights,
    /// Garment vertices inside the body, in red.
    Intersections,
}

impl From<QuantityName> for Quantity {
    fn from(name: QuantityName) -> Self {
        match name {
            QuantityName::Lit => Self::Lit,
            QuantityName::Wireframe => Self::Wireframe,
            QuantityName::Normals => Self::Normals,
            QuantityName::Error => Self::Error,
            QuantityName::Weights => Self::Weights,
            QuantityName::Intersections => Self::Intersections,
        }
    }
}
