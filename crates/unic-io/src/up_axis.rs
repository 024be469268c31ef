//! Up axes of files, and the conversion from Z up to Y up.

use glam::{Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use unic_core::{clip::Clip, skeleton::Skeleton};
use unic_scene::Up;

/// Axis that points up in a motion file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// The one of Y and Z that the body's up direction follows on average: files do not state it.
    #[default]
    Auto,
    /// +Y, the convention of this crate.
    Y,
    /// +Z, the convention of AMASS.
    Z,
}

impl UpAxis {
    /// Returns the axis that is asked for; none for a guess.
    pub fn stated(self) -> Option<Up> {
        match self {
            Self::Auto => None,
            Self::Y => Some(Up::Y),
            Self::Z => Some(Up::Z),
        }
    }
}

/// Returns the rotation from Z up to Y up: −90° about x.
pub(crate) fn y_up_from_z_up() -> Quat {
    Quat::from_rotation_x(-FRAC_PI_2)
}

/// Rotates a vector from Z up to Y up: (x, y, z) ↦ (x, z, −y).
///
/// Components are exchanged instead of multiplied with [`y_up_from_z_up`], whose rounded sine and
/// cosine would tilt long walks.
pub(crate) fn to_y_up(v: Vec3) -> Vec3 {
    Vec3::new(v.x, v.z, -v.y)
}

/// Rotates a clip from Z up to Y up: the root joint's position and orientation, and the wind.
///
/// `trans` is the displacement of the root joint from its bind position J₀ (SMPL's convention), and
/// so R · (trans + J₀) − J₀ replaces it.
pub(crate) fn turn_to_y_up(clip: &mut Clip, skeleton: &Skeleton) {
    let root = skeleton.root();
    // Rotating `trans` alone would leave the bind position in the old axes.
    let origin = skeleton.joints()[root];
    for pose in &mut clip.poses {
        pose.trans = to_y_up(pose.trans + origin) - origin;
        pose.local[root] = (y_up_from_z_up() * pose.local[root]).normalize();
    }
    clip.wind.iter_mut().for_each(|wind| *wind = to_y_up(*wind));
}

/// Note for a clip whose up axis is guessed and uncertain; `is_z` is the guess.
pub(crate) fn uncertain_note(is_z: bool) -> String {
    let (axis, other) = if is_z { ("Z", "Y") } else { ("Y", "Z") };
    format!(
        "the up axis is uncertain, because the body does not stand for most of the clip: \
         {axis} is assumed, ask for {other} up if the character lies on the ground"
    )
}
