//! Implicit surface of a shirt, and the surfaces that cut it.

use crate::{
    garments::{ArmPoint, BodyShape, GarmentError, Measurements, Ring, Side, ring::DIRECTIONS},
    implicit::smooth_min,
};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use unic_core::{character::Character, surface::Surface};

/// SMPL's indices of neck and head.
const NECK: usize = 12;
const HEAD: usize = 15;

/// Reach of the smooth transition between the opening's cylinder and its upper end, metres.
const OPENING_M: f32 = 0.03;

/// Largest excess of the neck's half width at its root over the narrowest half width, metres.
const NECK_FLARE_M: f32 = 0.015;

/// Distance between the outlines of the trunk, and of an arm, metres.
const SLICE_M: f32 = 0.01;

/// Reach of the smooth union of trunk and arm at the armpit, metres.
const ARMPIT_M: f32 = 0.05;

/// Reach of the smooth union of hulls and skin, metres.
const HULL_M: f32 = 0.02;

/// Distance from the shoulder joint up to which the outlines of an arm reach, metres.
const ARM_M: f32 = 0.34;

/// Distance from the body at the neck, metres: a collar lies close.
const COLLAR_M: f32 = 0.008;

/// Height above the shoulder joints over which the ease falls to [`COLLAR_M`], metres.
const COLLAR_BLEND_M: f32 = 0.06;

/// Offset surface of the body, filled to be convex around the trunk and around each arm.
pub(super) struct ShirtSurface {
    skin: Surface,
    trunk: ConvexHulls,
    arm: ConvexHulls,
    /// Distance from the body, metres.
    ease: f32,
    /// Height of the left shoulder joint, metres.
    shoulder: f32,
}

/// Convex outlines along an axis.
struct ConvexHulls {
    origin: Vec3,
    axis: Vec3,
    front: Vec3,
    side: Vec3,
    /// Distance of the first outline along the axis, metres; the others follow every [`SLICE_M`].
    start: f32,
    /// Support function of each outline about the axis, at [`DIRECTIONS`] angles, metres.
    supports: Vec<Vec<f32>>,
    /// Unit vectors at these angles.
    directions: Vec<Vec2>,
}

impl ShirtSurface {
    /// Surface of a shirt with the given height of the hem and distance from the body, metres.
    pub(super) fn new(
        character: &Character,
        body: &BodyShape,
        hem: f32,
        ease: f32,
    ) -> Result<Self, GarmentError> {
        let shoulder = body.joint(16).y;
        Ok(Self {
            skin: Surface::build(&character.body),
            trunk: trunk_hulls(body, hem, shoulder)?,
            arm: arm_hulls(body)?,
            ease,
            shoulder,
        })
    }

    /// Approximate signed distance from the shirt, metres, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        // The right side mirrors the left one, whatever the symmetry of the body.
        let left = Vec3::new(p.x.abs(), p.y, p.z);
        let hulls = smooth_min(self.trunk.distance(left), self.arm.distance(left), ARMPIT_M);
        let skin = self
            .skin
            .closest(left)
            .map_or(f32::MAX, |hit| hit.signed_distance);
        let towards_neck = ((p.y - self.shoulder) / COLLAR_BLEND_M).clamp(0.0, 1.0);
        let ease = self.ease + (COLLAR_M.min(self.ease) - self.ease) * towards_neck;
        smooth_min(skin, hulls, HULL_M) - ease
    }
}

/// Outlines of the trunk from below the hem up to the armpits.
///
/// Higher slices would cut the shoulders. There, cloth lies on the skin itself.
fn trunk_hulls(body: &BodyShape, hem: f32, shoulder: f32) -> Result<ConvexHulls, GarmentError> {
    let start = hem - 0.06;
    let end = shoulder - 0.05;
    let origin = Vec3::new(0.0, 0.0, body.joint(6).z);
    let count = ((end - start) / SLICE_M).ceil().max(1.0) as usize;
    let rings = (0..=count)
        .map(|i| body.trunk_ring(start + i as f32 * SLICE_M))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(ConvexHulls::new(origin, [Vec3::Z, Vec3::X], start, &rings))
}

/// Outlines of the left arm from the armpit to below the sleeve's end.
fn arm_hulls(body: &BodyShape) -> Result<ConvexHulls, GarmentError> {
    let ArmPoint {
        position: origin,
        axis,
    } = body.on_arm(Side::Left, 0.0);
    let front = Vec3::Y.reject_from(axis).normalize_or(Vec3::Z);
    // Nearer to the joint a slice would cut the trunk. The straight axis fits the arm to a little
    // beyond the elbow.
    let start = 0.06;
    let end = ARM_M.min(body.arm_lengths(Side::Left)[0] + 0.05);
    let count = ((end - start) / SLICE_M) as usize;
    let rings = (0..=count)
        .map(|i| body.arm_ring(Side::Left, start + i as f32 * SLICE_M))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(ConvexHulls::new(
        origin,
        [front, axis.cross(front)],
        start,
        &rings,
    ))
}

impl ConvexHulls {
    fn new(origin: Vec3, [front, side]: [Vec3; 2], start: f32, rings: &[Ring]) -> Self {
        let direction = |k: usize| Vec2::from_angle(TAU * k as f32 / DIRECTIONS as f32);
        let directions: Vec<Vec2> = (0..DIRECTIONS).map(direction).collect();
        // Every ring has an origin of its own: its support function is moved to the common axis.
        let support = |ring: &Ring| {
            let shift = ring.origin() - origin;
            let shift = Vec2::new(shift.dot(front), shift.dot(side));
            let about =
                |k: usize| ring.support(TAU * k as f32 / DIRECTIONS as f32) + directions[k].dot(shift);
            (0..DIRECTIONS).map(about).collect::<Vec<_>>()
        };
        let mut supports: Vec<Vec<f32>> = rings.iter().map(support).collect();
        smooth_along(&mut supports);
        Self {
            origin,
            axis: front.cross(side),
            front,
            side,
            start,
            supports,
            directions,
        }
    }

    /// Distance from the outline at the same place along the axis, metres, negative inside. Beyond
    /// the last outlines, the distance along the axis counts too.
    fn distance(&self, p: Vec3) -> f32 {
        let q = p - self.origin;
        let last = (self.supports.len() - 1) as f32;
        let wanted = (q.dot(self.axis) - self.start) / SLICE_M;
        let at = wanted.clamp(0.0, last);
        let (low, t) = (at.floor() as usize, at.fract());
        let (a, b) = (&self.supports[low], &self.supports[(low + 1).min(last as usize)]);
        let plane = Vec2::new(q.dot(self.front), q.dot(self.side));
        // Largest distance from a tangent line: exact along the sides of the outline, less at
        // corners.
        let mut distance = f32::MIN;
        for k in 0..DIRECTIONS {
            distance = distance.max(plane.dot(self.directions[k]) - (a[k] + (b[k] - a[k]) * t));
        }
        let beyond = (wanted - at).abs() * SLICE_M;
        distance.max(0.0).hypot(beyond) + distance.min(0.0) * f32::from(beyond == 0.0)
    }
}

/// Smooths outlines along the axis over some centimetres: cloth spans narrower hollows.
fn smooth_along(supports: &mut [Vec<f32>]) {
    for _ in 0..6 {
        for k in 0..DIRECTIONS {
            let column: Vec<f32> = supports.iter().map(|s| s[k]).collect();
            for i in 1..column.len().saturating_sub(1) {
                supports[i][k] = 0.25 * (column[i - 1] + column[i + 1]) + 0.5 * column[i];
            }
        }
    }
}

/// Position of the left armhole and direction of the left sleeve.
pub(super) struct Shoulder {
    /// Position of the shoulder joint, metres.
    pub(super) joint: Vec3,
    /// Unit direction of the upper arm.
    pub(super) arm: Vec3,
    /// Armpit of the shirt in the frontal plane (x, y), metres.
    armpit: Vec2,
    /// Unit normal of the armhole's plane in the frontal plane, towards the arm.
    armhole_normal: Vec2,
    /// Unit normal of the plane between arm and trunk in the frontal plane, towards the arm.
    between_normal: Vec2,
}

impl Shoulder {
    /// Locates the armhole of a shirt at the distance `ease` from the body, metres.
    pub(super) fn new(body: &BodyShape, ease: f32) -> Result<Self, GarmentError> {
        let ArmPoint {
            position: joint,
            axis: arm,
        } = body.on_arm(Side::Left, 0.0);
        let chest = body.trunk_ring(joint.y - 0.13)?;
        let chest_side = chest.origin().x + chest.support(FRAC_PI_2) + ease;
        // The line along the lower edge of the sleeve, extended from two points of the arm, meets
        // the side of the trunk in the armpit.
        let under = |along: f32| {
            let ring = body.arm_ring(Side::Left, along).map(|ring| ring.offset(ease));
            ring.map(|ring| ring.point_at_angle(PI).truncate())
        };
        let (near, far) = (under(0.09)?, under(0.16)?);
        let line = (far - near) / (far.x - near.x).max(0.02);
        let armpit = near + line * (chest_side - near.x).clamp(-0.12, 0.12);
        let top = joint.truncate() + Vec2::new(-0.004, 0.06);
        let upward = (top - armpit).normalize_or(Vec2::Y);
        let between = (arm.truncate() + Vec2::NEG_Y).normalize_or(Vec2::NEG_Y);
        Ok(Self {
            joint,
            arm,
            armpit,
            armhole_normal: -upward.perp(),
            between_normal: between.perp(),
        })
    }

    /// Field of the armhole, metres: positive on the side of the sleeve.
    pub(super) fn beyond_armhole(&self, p: Vec3) -> f32 {
        let from_armpit = p.truncate() - self.armpit;
        // Below the armpit, the far side of the armhole's plane may contain the hips. The second
        // plane separates arm and trunk there.
        let hole = self.armhole_normal.dot(from_armpit);
        let between = self.between_normal.dot(from_armpit);
        smooth_min(hole, between, 0.03)
    }

    /// Distance along the upper arm from the shoulder joint, metres.
    pub(super) fn along(&self, p: Vec3) -> f32 {
        (p - self.joint).dot(self.arm)
    }
}

/// Round opening for the neck: an upright cylinder with an elliptic outline, deeper in front.
pub(super) struct NeckOpening {
    /// Centre of the outline (x, z), metres.
    centre: Vec2,
    /// Half axis to the sides, metres.
    half_width: f32,
    /// Half axis to the front, metres.
    front: f32,
    /// Half axis to the back, metres.
    back: f32,
    /// Height of the cylinder's lower end, metres.
    bottom: f32,
    /// Height above which everything is cut away, metres.
    pub(super) top: f32,
}

impl NeckOpening {
    /// Opening that is `wider` metres wider than the neck on either side.
    pub(super) fn new(body: &BodyShape, measures: &Measurements, wider: f32) -> Result<Self, GarmentError> {
        let (root, head) = (body.joint(NECK).y, body.joint(HEAD).y);
        let (base, narrow) = (body.trunk_ring(root)?, body.trunk_ring(measures.neck)?);
        // At its root a neck may already widen into the shoulders.
        let half_width = base
            .support(FRAC_PI_2)
            .min(narrow.support(FRAC_PI_2) + NECK_FLARE_M);
        Ok(Self {
            centre: Vec2::new(0.0, base.origin().z),
            half_width: half_width + wider,
            front: base.support(0.0) + 1.3 * wider,
            back: base.support(PI) + 0.6 * wider,
            bottom: measures.shoulder - 0.14,
            // Above the root of the neck, below any chin.
            top: root + 0.15 * (head - root),
        })
    }

    /// Field of the opening, metres: positive where cloth is cut away.
    pub(super) fn inside(&self, p: Vec3) -> f32 {
        let q = Vec2::new(p.x, p.z) - self.centre;
        let half = Vec2::new(self.half_width, if q.y > 0.0 { self.front } else { self.back });
        let level = (q / half).length();
        let slope = (q / (half * half)).length().max(1e-3);
        // First-order distance from the ellipse; on its axis the quotient would be 0/0.
        let within = if level > 1e-3 {
            level * (1.0 - level) / slope
        } else {
            half.min_element()
        };
        -smooth_min(-within.min(p.y - self.bottom), self.top - p.y, OPENING_M)
    }
}
