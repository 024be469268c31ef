//! Conversion of published data sets, on which methods of this field are compared, to captures.
//!
//! Both data sets hold motion of the SMPL family and a garment's vertices, but no body. The user
//! supplies the character, because SMPL's licence forbids its distribution. Sequences are read one
//! at a time.
//!
//! [`Dataset::Vto`] (Santesteban et al. 2019 and 2021) has one pickle for each sequence, in metres,
//! Y up, 30 fps:
//!
//! | array | shape | content |
//! |---|---|---|
//! | `vertices` | (T, V, 3) | positions of the garment |
//! | `faces` | (F, 3) | triangles of the garment |
//! | `poses` | (T, 75) | SMPL's 72 rotation values and the translation |
//! | `pose`, `translation` | (T, 72), (T, 3) | the same in two arrays, in other releases |
//! | `shapes` or `shape` | (T, 10) | body shape, not read |
//!
//! File names begin with garment and body shape (`tshirt_shape00_01_01.pkl`). Sequences of other
//! body shapes than the first file's are left out.
//!
//! [`Dataset::VirtualBones`] (Pan et al. 2022) has one npz for each sequence, Z up, 30 fps:
//!
//! | array | shape | content |
//! |---|---|---|
//! | `pose` | (T, 52, 3) | rotations of SMPL-H |
//! | `trans` | (T, 3) | translation |
//! | `sim_res` | (T, V, 3) | positions of the garment |
//!
//! Its `template.obj` is in units of 0.1 m, Z up, on a body whose pelvis is at (0, −0.0215, 0.9048)
//! m. The data set states neither the unit nor the coordinate frame (world or root joint) of
//! `sim_res`. The converter takes the combination whose positions are nearest to the skinned
//! template.

mod convert;
mod fit;
mod read;
mod sequence;
mod virtual_bones;
mod vto;

pub use convert::{Converted, convert};

/// Frame rate of both data sets, Hz.
const FPS: f32 = 30.0;

/// A published data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dataset {
    /// Simulated T-shirts and dresses for virtual try-on.
    Vto,
    /// Loose dresses of "Predicting Loose-Fitting Garment Deformations Using Bone-Driven Motion
    /// Networks".
    VirtualBones,
}

impl Dataset {
    /// Provenance in the manifest of converted captures.
    fn provenance(self) -> &'static str {
        match self {
            Self::Vto => "VTO data set (Santesteban et al. 2019, 2021); see its licence",
            Self::VirtualBones => "VirtualBones data set (Pan et al. 2022); see its licence",
        }
    }

    /// File name extension of sequences, without the dot.
    fn extension(self) -> &'static str {
        match self {
            Self::Vto => "pkl",
            Self::VirtualBones => "npz",
        }
    }
}
