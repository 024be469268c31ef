//! Options for the looks of bodies and garments.

use super::parse;
use clap::ValueEnum;
use unic_viewer::{Fabric, Material, Print};

const HEADING: &str = "Looks";

/// Options for the looks of bodies and garments.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct LooksArgs {
    /// Fabric of the garments [default: that of each garment].
    #[arg(long, help_heading = HEADING, value_enum)]
    fabric: Option<FabricName>,
    /// Print on the garments [default: that of each garment].
    #[arg(long, help_heading = HEADING, value_enum)]
    print: Option<PrintName>,
    /// Colour of the garments, sRGB, such as 2a4073 [default: that of each garment].
    #[arg(long, help_heading = HEADING, value_name = "RRGGBB", value_parser = parse::colour)]
    colour: Option<[f32; 3]>,
    /// Colour of the print, sRGB.
    #[arg(long, help_heading = HEADING, value_name = "RRGGBB", value_parser = parse::colour)]
    print_colour: Option<[f32; 3]>,
    /// Colour of the bodies, sRGB.
    #[arg(long, help_heading = HEADING, value_name = "RRGGBB", value_parser = parse::colour)]
    body_colour: Option<[f32; 3]>,
}

impl LooksArgs {
    /// Cloth with the looks that the options ask for.
    pub(crate) fn cloth(&self, cloth: Material) -> Material {
        Material {
            colour: self.colour.unwrap_or(cloth.colour),
            accent: self.print_colour.unwrap_or(cloth.accent),
            fabric: self.fabric.map_or(cloth.fabric, Fabric::from),
            print: self.print.map_or(cloth.print, Print::from),
        }
    }

    /// Skin with the colour that the options ask for.
    pub(crate) fn skin(&self) -> Material {
        Material {
            colour: self.body_colour.unwrap_or(Material::SKIN.colour),
            ..Material::SKIN
        }
    }
}

/// [`Fabric`] of a garment by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FabricName {
    /// Cloth without visible threads.
    Plain,
    /// Fine knit.
    Jersey,
    /// Diagonal weave, as of jeans.
    Twill,
    /// Plain weave of threads that differ.
    Linen,
    /// Shining weave.
    Satin,
}

impl From<FabricName> for Fabric {
    fn from(name: FabricName) -> Self {
        match name {
            FabricName::Plain => Self::Plain,
            FabricName::Jersey => Self::Jersey,
            FabricName::Twill => Self::Twill,
            FabricName::Linen => Self::Linen,
            FabricName::Satin => Self::Satin,
        }
    }
}

/// [`Print`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PrintName {
    /// One colour.
    None,
    /// Stripes every 3.2 cm.
    Stripes,
    /// Checks of 6 cm.
    Checks,
    /// Dots every 3 cm.
    Dots,
}

impl From<PrintName> for Print {
    fn from(name: PrintName) -> Self {
        match name {
            PrintName::None => Self::None,
            PrintName::Stripes => Self::Stripes,
            PrintName::Checks => Self::Checks,
            PrintName::Dots => Self::Dots,
        }
    }
}
