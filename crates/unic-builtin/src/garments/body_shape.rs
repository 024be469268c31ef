//! Slices of a character's body, and measurements on them.

use super::{GarmentError, ring::Ring};
use crate::side::Side;
use glam::{Vec2, Vec3};
use std::ops::Range;
use unic_core::{character::Character, skeleton::SMPL_JOINT_NAMES};

/// Joints of the arms in SMPL's order: shoulders, elbows, wrists, hands, each left before right.
const ARMS: Range<usize> = 16..24;
const PELVIS: usize = 0;
const SPINE2: usize = 6;
const NECK: usize = 12;
const HEAD: usize = 15;

/// Left shoulder, elbow and wrist in SMPL's order; the right ones follow.
const ARM_CHAIN: [usize; 3] = [16, 18, 20];

/// Distance between the slices that [`Measurements`] compares, metres.
const SLICE_M: f32 = 0.005;

/// Most slices within a range of heights, whatever the size of the body.
const MOST_SLICES: f32 = 1000.0;

/// A character's bind-pose body, prepared for slicing with planes.
#[derive(Clone, Debug)]
pub struct BodyShape<'a> {
    /// Positions of the body's vertices in the bind pose, metres.
    vertices: &'a [Vec3],
    /// Positions of the joints in the bind pose, metres.
    joints: &'a [Vec3],
    /// Faces whose largest weights belong neither to an arm nor to the head.
    trunk: Vec<[u32; 3]>,
    /// Faces whose largest weights belong to the left and to the right arm.
    arms: [Vec<[u32; 3]>; 2],
}

/// Point on the bones of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmPoint {
    /// Position in the bind pose, metres.
    pub position: Vec3,
    /// Unit direction of the arm towards the hand, which turns smoothly around the elbow.
    pub axis: Vec3,
}

/// Heights of a body in the bind pose, metres (world y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurements {
    /// Height of the lowest point of the body.
    pub floor: f32,
    /// Height of the lowest point of the trunk between the legs.
    pub crotch: f32,
    /// Height of the widest girth between crotch and waist.
    pub hip: f32,
    /// Height of the narrowest girth between hips and chest.
    pub waist: f32,
    /// Height of the widest girth between waist and armpits.
    pub chest: f32,
    /// Mean height of the shoulder joints.
    pub shoulder: f32,
    /// Height of the narrowest girth between shoulders and head.
    pub neck: f32,
}

impl<'a> BodyShape<'a> {
    /// Sorts the faces of a body by trunk and arms.
    ///
    /// # Errors
    /// [`GarmentError::Joints`] without SMPL's 24 joints, [`GarmentError::Weights`] if the skinning
    /// weights do not fit the body, [`GarmentError::Mesh`] for an invalid mesh.
    pub fn new(character: &'a Character) -> Result<Self, GarmentError> {
        let joints = character.skeleton.joints();
        if joints.len() != SMPL_JOINT_NAMES.len() {
            return Err(GarmentError::Joints { found: joints.len() });
        }
        let vertices = &character.body.vertices;
        if character.weights.len() != vertices.len() {
            return Err(GarmentError::Weights {
                expected: vertices.len(),
                found: character.weights.len(),
            });
        }
        character.body.check()?;
        // Rows of skinning weights begin with the largest weight.
        let leading = |v: u32| {
            character
                .weights
                .row(v as usize)
                .next()
                .map_or(PELVIS, |(j, _)| j)
        };
        let faces = |of: &dyn Fn(usize) -> bool| {
            let faces = character.body.faces.iter().copied();
            faces.filter(|f| f.iter().all(|&v| of(leading(v)))).collect()
        };
        // From the shoulders on, left joints have even numbers and right ones odd numbers.
        let arm = |side: usize| faces(&|j| ARMS.contains(&j) && j % 2 == side);
        Ok(Self {
            vertices,
            joints,
            trunk: faces(&|j| !ARMS.contains(&j) && j != HEAD),
            arms: [arm(0), arm(1)],
        })
    }

    /// Bind position of a joint in SMPL's order, metres.
    ///
    /// # Panics
    /// Panics for an index of 24 or more.
    pub fn joint(&self, joint: usize) -> Vec3 {
        self.joints[joint]
    }

    /// Symmetric outline of the trunk at a height (world y, metres), without arms and head.
    ///
    /// It begins at the front (+Z) with u = 0 and has the left (+X) at u = 0.25. Below the crotch
    /// it encloses both legs together.
    ///
    /// # Errors
    /// [`GarmentError::NoSection`] without a trunk at this height.
    pub fn trunk_ring(&self, height: f32) -> Result<Ring, GarmentError> {
        self.hull(&self.trunk, Vec3::Y * height, [Vec3::Z, Vec3::X])
            .map(|ring| ring.symmetric())
            .ok_or(GarmentError::NoSection {
                what: "trunk",
                at_m: height,
            })
    }

    /// Outline of an arm's cross-section, `along` metres from the shoulder joint towards the hand.
    ///
    /// It begins at the top with u = 0. With the arm's direction as axis, u grows towards the front
    /// on the left arm and towards the back on the right one.
    ///
    /// # Errors
    /// [`GarmentError::NoSection`] without an arm there.
    pub fn arm_ring(&self, side: Side, along: f32) -> Result<Ring, GarmentError> {
        let ArmPoint { position, axis } = self.on_arm(side, along);
        let front = Vec3::Y.reject_from(axis).normalize_or(Vec3::Z);
        let ring = self.hull(&self.arms[side.index()], position, [front, axis.cross(front)]);
        ring.ok_or(GarmentError::NoSection {
            what: "arm",
            at_m: along,
        })
    }

    /// Point on the bones of an arm, `along` metres from the shoulder joint.
    pub fn on_arm(&self, side: Side, along: f32) -> ArmPoint {
        let [shoulder, elbow, wrist] = ARM_CHAIN.map(|j| self.joints[j + side.index()]);
        let upper = shoulder.distance(elbow);
        let (d0, d1) = (
            (elbow - shoulder).normalize_or(Vec3::X),
            (wrist - elbow).normalize_or(Vec3::X),
        );
        let position = if along < upper {
            shoulder + d0 * along
        } else {
            elbow + d1 * (along - upper)
        };
        // The direction turns over half the upper arm's length, centred on the elbow.
        let bend = ((along - upper) / (0.5 * upper) + 0.5).clamp(0.0, 1.0);
        ArmPoint {
            position,
            axis: d0.lerp(d1, bend).normalize_or(d0),
        }
    }

    /// Lengths of the upper arm and the forearm, metres.
    pub fn arm_lengths(&self, side: Side) -> [f32; 2] {
        let [shoulder, elbow, wrist] = ARM_CHAIN.map(|j| self.joints[j + side.index()]);
        [shoulder.distance(elbow), elbow.distance(wrist)]
    }

    /// Heights at which clothes are measured.
    ///
    /// # Errors
    /// [`GarmentError::NoSection`] for a body without a trunk.
    pub fn measurements(&self) -> Result<Measurements, GarmentError> {
        let y = |joint: usize| self.joints[joint].y;
        let crotch = self.crotch();
        let shoulder = 0.5 * (y(16) + y(17));
        let hip_top = y(PELVIS) + 0.4 * (y(SPINE2) - y(PELVIS)).max(0.05);
        let chest_base = y(SPINE2) + 0.5 * (shoulder - y(SPINE2));
        let hip = self.extreme(crotch..hip_top, |girth| -girth)?;
        // Higher slices would cut the shoulders.
        let chest = self.extreme(chest_base..shoulder - 0.08, |girth| -girth)?;
        Ok(Measurements {
            floor: self.vertices.iter().map(|v| v.y).fold(f32::MAX, f32::min),
            crotch,
            hip,
            waist: self.extreme(hip..chest, |girth| girth)?,
            chest,
            shoulder,
            neck: self.extreme(y(NECK)..0.5 * (y(NECK) + y(HEAD)) + SLICE_M, |girth| girth)?,
        })
    }

    /// Height of the lowest trunk face on the midplane, metres.
    fn crotch(&self) -> f32 {
        let pelvis = self.joints[PELVIS];
        let across = |face: &[u32; 3]| {
            let corners = face.map(|v| self.vertices[v as usize]);
            let sides = corners.map(|c| c.x - pelvis.x);
            let crosses = sides.iter().any(|s| *s >= 0.0) && sides.iter().any(|s| *s <= 0.0);
            let height = corners.iter().map(|c| c.y).sum::<f32>() / 3.0;
            // Knees and feet may touch at the midplane; they are not the end of the trunk.
            (crosses && height > pelvis.y - 0.3).then_some(height)
        };
        self.trunk.iter().filter_map(across).fold(pelvis.y, f32::min)
    }

    /// Height within a range at which a function of the trunk's girth is least.
    ///
    /// Heights without a trunk are passed over; of equal girths, the lowest height counts.
    fn extreme(&self, heights: Range<f32>, cost: impl Fn(f32) -> f32) -> Result<f32, GarmentError> {
        let count = ((heights.end - heights.start) / SLICE_M)
            .ceil()
            .clamp(1.0, MOST_SLICES) as usize;
        let mut best: Option<(f32, f32)> = None;
        for i in 0..=count {
            let height = heights.start + (heights.end - heights.start) * i as f32 / count as f32;
            let Ok(ring) = self.trunk_ring(height) else {
                continue;
            };
            let found = cost(ring.circumference());
            if best.is_none_or(|(least, _)| found < least) {
                best = Some((found, height));
            }
        }
        best.map(|(_, height)| height).ok_or(GarmentError::NoSection {
            what: "trunk",
            at_m: heights.start,
        })
    }

    /// Convex outline of the section of faces with a plane; none where they do not meet it.
    fn hull(&self, faces: &[[u32; 3]], origin: Vec3, [front, side]: [Vec3; 2]) -> Option<Ring> {
        let normal = front.cross(side);
        let mut points = Vec::new();
        for face in faces {
            let corners = face.map(|v| self.vertices[v as usize] - origin);
            let heights = corners.map(|c| c.dot(normal));
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                if (heights[a] < 0.0) != (heights[b] < 0.0) {
                    let t = heights[a] / (heights[a] - heights[b]);
                    let cut = corners[a].lerp(corners[b], t);
                    points.push(Vec2::new(cut.dot(front), cut.dot(side)));
                }
            }
        }
        let middle = centre(&points)?;
        // A support function about a point near the middle stays positive. The trunk's rings stay
        // centred on the midplane, so that they are symmetric about it.
        let shift = front * middle.x + side * if side == Vec3::X { 0.0 } else { middle.y };
        let plane_shift = Vec2::new(shift.dot(front), shift.dot(side));
        points.iter_mut().for_each(|p| *p -= plane_shift);
        Ring::around(origin + shift, [front, side], &points)
    }
}

/// Centre of the bounding box of points; none without points.
fn centre(points: &[Vec2]) -> Option<Vec2> {
    let first = *points.first()?;
    let (low, high) = (points.iter()).fold((first, first), |(l, h), p| (l.min(*p), h.max(*p)));
    Some(low.midpoint(high))
}
