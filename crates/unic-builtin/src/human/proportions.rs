//! Positions of the joints, and widths of the body, for given measures.

use super::{HumanError, HumanParameters};
use glam::Vec3;
use unic_core::skeleton::ADULT_JOINTS;

/// Height of the standard body, metres. All constants of the anatomy refer to it.
const STANDARD_HEIGHT_M: f32 = 1.70;

/// Girths of the unscaled lofts of the trunk, metres.
const STANDARD_CHEST_M: f32 = 0.975;
const STANDARD_WAIST_M: f32 = 0.72;
const STANDARD_HIP_M: f32 = 0.965;

/// Skeleton and widths of one body.
///
/// Segment lengths follow the fractions of the stature of Drillis & Contini 1966, "Body segment
/// parameters", as tabulated in Winter, "Biomechanics and Motor Control of Human Movement": knee
/// 0.285, hip 0.530, shoulder 0.818, upper arm 0.172 (between joint centres), forearm 0.146.
#[derive(Clone, Debug)]
pub(super) struct Proportions {
    /// Height over the standard height; everything is first made at the standard height.
    pub(super) scale: f32,
    /// Positions of the joints, metres.
    pub(super) joints: [Vec3; 24],
    /// x of the left fingertips at the standard height, metres.
    pub(super) fingertip: f32,
    /// Outward distance of the shoulder joints from their standard position, metres at the standard
    /// height.
    pub(super) shoulder_shift: f32,
    /// Girths over the standard girths.
    pub(super) girths: Girths,
}

/// Girths of the trunk as multiples of the standard girths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Girths {
    pub(super) chest: f32,
    pub(super) waist: f32,
    pub(super) hip: f32,
}

/// Distance from the wrist to the knuckles, metres at the standard height.
const PALM_M: f32 = 0.086;

/// Standard half distance between the shoulder joints, metres.
const SHOULDER_M: f32 = 0.165;

impl Proportions {
    /// Checks the measures and derives joints and widths from them.
    pub(super) fn new(parameters: &HumanParameters) -> Result<Self, HumanError> {
        let scale = parameters.height_m / STANDARD_HEIGHT_M;
        check("height_m", parameters.height_m, 1.2, 2.2)?;
        check(
            "shoulder_width_m",
            parameters.shoulder_width_m,
            0.26 * scale,
            0.44 * scale,
        )?;
        check("chest_m", parameters.chest_m, 0.75 * scale, 1.2 * scale)?;
        check("waist_m", parameters.waist_m, 0.6 * scale, 1.1 * scale)?;
        check("hip_m", parameters.hip_m, 0.85 * scale, 1.15 * scale)?;
        let shoulder_shift = 0.5 * parameters.shoulder_width_m / scale - SHOULDER_M;
        Ok(Self {
            scale,
            joints: joints(shoulder_shift).map(|joint| joint * scale),
            fingertip: 0.892 + shoulder_shift,
            shoulder_shift,
            girths: Girths {
                chest: parameters.chest_m / STANDARD_CHEST_M / scale,
                waist: parameters.waist_m / STANDARD_WAIST_M / scale,
                hip: parameters.hip_m / STANDARD_HIP_M / scale,
            },
        })
    }

    /// Point of the standard body that corresponds to `p`: scaled to the standard height, with the
    /// shoulders and arms moved to their standard position. Metres.
    pub(super) fn standard(&self, p: Vec3) -> Vec3 {
        let p = p / self.scale;
        let rise = |x: f32| x.clamp(0.0, 1.0) * x.clamp(0.0, 1.0) * (3.0 - 2.0 * x.clamp(0.0, 1.0));
        // The shift grows along the collar bones; below them the chest keeps its girth, and the arm
        // is moved as a rigid whole. The slope of the shift stays below one, so that no two points
        // have the same image.
        let (out, up) = (p.x.abs() / SHOULDER_M, rise((p.y - 1.25) / 0.11));
        let share = out.min(1.0) * (up + (1.0 - up) * rise((p.x.abs() - SHOULDER_M) / 0.12));
        p - Vec3::X * (self.shoulder_shift * share * p.x.signum())
    }

    /// Wanted edge length of the mesh, metres: finer on hands, face and feet.
    pub(super) fn wanted_edge(&self, p: Vec3) -> f32 {
        let q = self.standard(p);
        let towards = |from: f32, to: f32, t: f32| from + (to - from) * t.clamp(0.0, 1.0);
        let trunk = 0.0235;
        let arm = towards(trunk, 0.0195, (q.x - 0.15) / 0.1);
        let hand = towards(arm, 0.0085, (q.x - 0.62) / 0.09);
        let head = towards(trunk, 0.0114, (q.y - 1.41) / 0.07);
        let foot = towards(trunk, 0.013, (0.2 - q.y) / 0.1);
        self.scale * hand.min(head).min(foot)
    }
}

fn check(name: &'static str, found: f32, least: f32, most: f32) -> Result<(), HumanError> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    Err(HumanError::Measure {
        name,
        found,
        least,
        most,
    })
}

/// All joints at the standard height.
fn joints(shoulder_shift: f32) -> [Vec3; 24] {
    let mut joints = [Vec3::ZERO; 24];
    for (index, place) in ADULT_JOINTS {
        let mut place = Vec3::from(place);
        if index >= 16 {
            place.x += shoulder_shift;
        }
        joints[index] = place;
    }
    joints[22] = joints[20] + Vec3::new(PALM_M, -0.002, 0.0);
    for left in [1, 4, 7, 10, 13, 16, 18, 20, 22] {
        joints[left + 1] = joints[left] * Vec3::new(-1.0, 1.0, 1.0);
    }
    joints
}
