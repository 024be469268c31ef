//! The implicit surface of a shirt and the surfaces that cut it.

use crate::{
    garments::{BodyShape, GarmentError, Measurements, Ring, Side, ring::DIRECTIONS},
    implicit::smooth_min,
};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use unic_core::{character::Character, surface::Surface};

/// SMPL's indices of neck and head.
const NECK: usize = 12;
const HEAD: usize = 15;

/// Roundness of the opening where its cylinder meets its upper end, metres.
const OPENING_M: f32 = 0.03;

/// How much wider than its narrowest a neck counts as neck, on either side, metres.
const NECK_FLARE_M: f32 = 0.015;

/// Distance between the outlines of the trunk, and of an arm, metres.
const SLICE_M: f32 = 0.01;

/// Roundness of the armpit, metres.
const ARMPIT_M: f32 = 0.05;

/// Roundness where hulls and skin meet, metres.
const HULL_M: f32 = 0.02;

/// How far along the arm its outlines reach, metres.
const ARM_M: f32 = 0.34;

/// Distance from the body at the neck, metres: a collar lies close.
const COLLAR_M: f32 = 0.008;

/// The body's offset, filled to be convex around the trunk and around each arm.
pub(super) struct ShirtSurface {
    skin: Surface,
    trunk: Hulls,
    arm: Hulls,
    ease: f32,
    shoulder: f32,
}

/// Convex outlines along a direction.
struct Hulls {
    origin: Vec3,
    axis: Vec3,
    front: Vec3,
    side: Vec3,
    start: f32,
    /// Support functions about `origin + axis · along`, [`DIRECTIONS`] each.
    supports: Vec<Vec<f32>>,
    directions: Vec<Vec2>,
}

impl ShirtSurface {
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

    /// Near to the signed distance from the shirt, metres; for both sides, as the left has it.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        let left = Vec3::new(p.x.abs(), p.y, p.z);
        let hulls = smooth_min(self.trunk.distance(left), self.arm.distance(left), ARMPIT_M);
        let skin = self
            .skin
            .closest(left)
            .map_or(f32::MAX, |hit| hit.signed_distance);
        let towards_neck = ((p.y - self.shoulder) / 0.06).clamp(0.0, 1.0);
        let ease = self.ease + (COLLAR_M.min(self.ease) - self.ease) * towards_neck;
        smooth_min(skin, hulls, HULL_M) - ease
    }
}

/// Outlines from below the hem up to the armpits: higher up a horizontal slice cuts the shoulders,
/// where the skin itself is what cloth lies on.
fn trunk_hulls(body: &BodyShape, hem: f32, shoulder: f32) -> Result<Hulls, GarmentError> {
    let start = hem - 0.06;
    let end = shoulder - 0.05;
    let origin = Vec3::new(0.0, 0.0, body.joint(6).z);
    let count = ((end - start) / SLICE_M).ceil().max(1.0) as usize;
    let rings = (0..=count)
        .map(|i| body.trunk_ring(start + i as f32 * SLICE_M))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Hulls::new(origin, [Vec3::Z, Vec3::X], start, &rings))
}

fn arm_hulls(body: &BodyShape) -> Result<Hulls, GarmentError> {
    let (origin, axis) = body.on_arm(Side::Left, 0.0);
    let front = Vec3::Y.reject_from(axis).normalize_or(Vec3::Z);
    let start = 0.06;
    let end = ARM_M.min(body.arm_lengths(Side::Left)[0] + 0.05);
    let count = ((end - start) / SLICE_M) as usize;
    let rings = (0..=count)
        .map(|i| body.arm_ring(Side::Left, start + i as f32 * SLICE_M))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Hulls::new(origin, [front, axis.cross(front)], start, &rings))
}

impl Hulls {
    fn new(origin: Vec3, [front, side]: [Vec3; 2], start: f32, rings: &[Ring]) -> Self {
        let direction = |k: usize| Vec2::from_angle(TAU * k as f32 / DIRECTIONS as f32);
        let directions: Vec<Vec2> = (0..DIRECTIONS).map(direction).collect();
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

    /// How far a place is outside the outline at its height, and beyond the last outline.
    fn distance(&self, p: Vec3) -> f32 {
        let q = p - self.origin;
        let last = (self.supports.len() - 1) as f32;
        let wanted = (q.dot(self.axis) - self.start) / SLICE_M;
        let at = wanted.clamp(0.0, last);
        let (low, t) = (at.floor() as usize, at.fract());
        let (a, b) = (&self.supports[low], &self.supports[(low + 1).min(last as usize)]);
        let plane = Vec2::new(q.dot(self.front), q.dot(self.side));
        let mut distance = f32::MIN;
        for k in 0..DIRECTIONS {
            distance = distance.max(plane.dot(self.directions[k]) - (a[k] + (b[k] - a[k]) * t));
        }
        let beyond = (wanted - at).abs() * SLICE_M;
        distance.max(0.0).hypot(beyond) + distance.min(0.0) * f32::from(beyond == 0.0)
    }
}

/// Blurs outlines along the axis, over some centimetres: cloth spans what is narrower.
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

/// Where the left sleeve begins and how it runs.
pub(super) struct Shoulder {
    pub(super) joint: Vec3,
    /// Unit direction of the upper arm.
    pub(super) arm: Vec3,
    /// The armpit of the shirt, in the frontal plane.
    armpit: Vec2,
    /// Normals, towards the arm, of the armhole's plane and of the plane between arm and trunk.
    normals: [Vec2; 2],
}

impl Shoulder {
    pub(super) fn new(body: &BodyShape, ease: f32) -> Result<Self, GarmentError> {
        let (joint, arm) = body.on_arm(Side::Left, 0.0);
        let chest = body.trunk_ring(joint.y - 0.13)?;
        let chest_side = chest.origin().x + chest.support(FRAC_PI_2) + ease;
        // The line under the sleeve meets the trunk's side in the armpit.
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
            normals: [-upward.perp(), between.perp()],
        })
    }

    /// Positive on the sleeve's side of the armhole, metres.
    pub(super) fn beyond_armhole(&self, p: Vec3) -> f32 {
        let from_armpit = p.truncate() - self.armpit;
        let [hole, between] = self.normals.map(|n| n.dot(from_armpit));
        smooth_min(hole, between, 0.03)
    }

    /// Distance along the upper arm from the shoulder joint, metres.
    pub(super) fn along(&self, p: Vec3) -> f32 {
        (p - self.joint).dot(self.arm)
    }
}

/// The round opening for the neck: an upright cylinder whose outline is an ellipse, deeper in front.
pub(super) struct NeckOpening {
    centre: Vec2,
    half_width: f32,
    front: f32,
    back: f32,
    /// Below this the cylinder does not cut, above `top` all goes.
    bottom: f32,
    pub(super) top: f32,
}

impl NeckOpening {
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

    /// Positive inside the opening, metres.
    pub(super) fn inside(&self, p: Vec3) -> f32 {
        let q = Vec2::new(p.x, p.z) - self.centre;
        let half = Vec2::new(self.half_width, if q.y > 0.0 { self.front } else { self.back });
        let level = (q / half).length();
        let slope = (q / (half * half)).length().max(1e-3);
        let within = if level > 1e-3 {
            level * (1.0 - level) / slope
        } else {
            half.min_element()
        };
        -smooth_min(-within.min(p.y - self.bottom), self.top - p.y, OPENING_M)
    }
}
