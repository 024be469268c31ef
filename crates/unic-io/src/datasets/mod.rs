//! The published data sets that methods of this field are compared on, made into captures where a user has them.
//!
//! Both hold motion of the SMPL family and a garment's vertices, and no body: the user brings the character, since
//! SMPL's licence forbids to pass it on. Sequences are read one at a time.
//!
//! - [`Dataset::Vto`]: Santesteban et al. 2019 and 2021, one pickle a sequence: `vertices` (T, V, 3) and `faces` (F, 3) of the
//!   garment, `poses` (T, 75: SMPL's 72 numbers and the translation) or `pose` (T, 72) with `translation` (T, 3),
//!   `shapes` or `shape` (T, 10). Metres, Y up, 30 fps. File names begin with garment and body shape
//!   (`tshirt_shape00_01_01.pkl`); sequences of other shapes than the first file's are left out.
//! - [`Dataset::VirtualBones`]: Pan et al. 2022, one npz a sequence: `pose` (T, 52, 3) of SMPL-H, `trans` (T, 3), `sim_res`
//!   (T, V, 3), and `template.obj` in units of 0.1 m, Z up, whose body has its pelvis at (0, −0.0215, 0.9048) m.
//!   Whether `sim_res` is counted from the world or from the root joint, and in which unit, the data do not say: of
//!   both frames and both units the one is taken that lies nearest to the skinned template.

mod convert;
mod fit;
mod sequence;
mod virtual_bones;
mod vto;

pub use convert::{Converted, convert};

/// Frames a second of both.
const FPS: f32 = 30.0;

/// A published data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dataset {
    /// Simulated T-shirts and dresses for virtual try-on.
    Vto,
    /// Loose dresses of "Predicting Loose-Fitting Garment Deformations Using Bone-Driven Motion Networks".
    VirtualBones,
}

impl Dataset {
    /// What captures made of it say of their source.
    fn provenance(self) -> &'static str {
        match self {
            Self::Vto => "VTO data set (Santesteban et al. 2019, 2021); see its licence",
            Self::VirtualBones => "VirtualBones data set (Pan et al. 2022); see its licence",
        }
    }

    /// Of a sequence's file.
    fn extension(self) -> &'static str {
        match self {
            Self::Vto => "pkl",
            Self::VirtualBones => "npz",
        }
    }
}
