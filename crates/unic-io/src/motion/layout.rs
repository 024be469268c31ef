//! Joint layouts of motion files.

use unic_core::skeleton::SMPL_JOINT_NAMES;

/// Number of body joints in the SMPL family. The further joints are hands, jaw and eyes.
const BODY_JOINTS: usize = 22;

/// Joints in a frame of a motion file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseLayout {
    /// The character's own joints.
    Native,
    /// SMPL's 24 joints (72 numbers), then the translation (3 numbers).
    SmplWithTranslation,
    /// SMPL-H's 52 joints: the 22 body joints of SMPL, then 30 finger joints.
    SmplH,
    /// SMPL-X's 55 joints: the 22 body joints of SMPL, then jaw, eyes and fingers.
    SmplX,
}

impl PoseLayout {
    /// Returns the layout of frames of `numbers` values for a character of `joints` joints.
    pub(super) fn of(numbers: usize, joints: usize) -> Option<Self> {
        let smpl = joints == SMPL_JOINT_NAMES.len();
        match numbers {
            // The character's own layout has precedence; the product of a damaged count may
            // overflow.
            n if n > 0 && Some(n) == joints.checked_mul(3) => Some(Self::Native),
            75 if smpl => Some(Self::SmplWithTranslation),
            156 if smpl => Some(Self::SmplH),
            165 if smpl => Some(Self::SmplX),
            _ => None,
        }
    }

    /// Number of leading joints taken from a frame. Further joints of the character do not rotate.
    pub(super) fn joints_taken(self, joints: usize) -> usize {
        match self {
            Self::Native | Self::SmplWithTranslation => joints,
            Self::SmplH | Self::SmplX => BODY_JOINTS,
        }
    }

    /// Note about joints that are left out.
    pub(super) fn note(self) -> Option<String> {
        let text = match self {
            Self::Native | Self::SmplWithTranslation => return None,
            Self::SmplH => "SMPL-H layout: 22 body joints taken, fingers left out, hands rigid",
            Self::SmplX => "SMPL-X layout: 22 body joints taken, jaw, eyes and fingers left out, hands rigid",
        };
        Some(text.into())
    }
}
