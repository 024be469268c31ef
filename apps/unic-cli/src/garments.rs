//! Trained garments that come with the program, on the built-in human.
//!
//! `apps/unic-cli/garments/make.sh` makes them again. They are trained on the motion of a steered
//! character: stands, walks of up to 2 m/s, curves, starts, stops and sharp turns.

use unic_core::{Model, ModelFileError};

/// Trained garment that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shipped {
    /// T-shirt of cotton.
    Tshirt,
    /// Flared skirt.
    Skirt,
}

impl Shipped {
    /// All garments.
    pub const ALL: [Self; 2] = [Self::Tshirt, Self::Skirt];

    /// Name of the built-in garment that it is trained on.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tshirt => "tshirt",
            Self::Skirt => "skirt",
        }
    }

    /// Bytes of the model file.
    pub fn bytes(self) -> &'static [u8] {
        match self {
            Self::Tshirt => include_bytes!("../garments/tshirt.unic"),
            Self::Skirt => include_bytes!("../garments/skirt.unic"),
        }
    }

    /// Reads the model.
    ///
    /// # Errors
    /// Never, as a test reads all garments.
    pub fn model(self) -> Result<Model, ModelFileError> {
        Model::from_bytes(self.bytes())
    }
}
