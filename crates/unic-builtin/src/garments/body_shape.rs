//! Slices of a character's body.

use super::{GarmentError, ring::Ring};
use glam::{Vec2, Vec3};
use std::ops::Range;
use unic_core::{character::Character, skeleton::SMPL_JOINT_NAMES};

/// First joint of the arms in SMPL's order: shoulders, elbows, wrists, hands, left before right.
const ARMS: Range<usize> = 16..24;
const PELVIS: usize = 0;
const SPINE2: usize = 6;
const NECK: usize = 12;
const HEAD: usize = 15;

/// Distance between the slices that [`Measurements`] compares, metres.
const SLICE_M: f32 = 0.005;

/// Left (+X in the bind pose) or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The character's left.
    Left,
    /// The character's right.
    Right,
}

impl Side {
    /// +1 for left, −1 for right: the sign of x.
    pub fn sign(self) -> f32 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A character's bind-pose body, ready to be sliced.
#[derive(Clone, Debug)]
pub struct BodyShape<'a> {
    vertices: &'a [Vec3],
    joints: &'a [Vec3],
    /// Faces that no arm joint nor the head dominates.
    trunk: Vec<[u32; 3]>,
    /// Faces dominated by the left and the right arm's joints.
    arms: [Vec<[u32; 3]>; 2],
}

/// Heights of a body in the bind pose, metres (world y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurements {
    /// Lowest point of the body.
    pub floor: f32,
    /// Between the legs.
    pub crotch: f32,
    /// Widest girth between crotch and waist.
    pub hip: f32,
    /// Narrowest girth between hips and chest.
    pub waist: f32,
    /// Widest girth between waist and armpits.
    pub chest: f32,
    /// The shoulder joints.
    pub shoulder: f32,
    /// Narrowest girth between shoulders and head.
    pub neck: f32,
}

impl<'a> BodyShape<'a> {
    /// # Errors
    /// A character without SMPL's 24 joints, weights that do not fit the body.
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
        // SMPL numbers left joints before right ones in turn: even ones of the arms are left.
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
    /// For an index of 24 or more.
    pub fn joint(&self, joint: usize) -> Vec3 {
        self.joints[joint]
    }

    /// The outline of the trunk, below the crotch of both legs together, at a height (world y,
    /// metres): symmetric, u = 0 at the front (+Z), 0.25 at the left (+X). Arms and head are left out.
    ///
    /// # Errors
    /// No trunk at this height.
    pub fn trunk_ring(&self, height: f32) -> Result<Ring, GarmentError> {
        self.hull(&self.trunk, Vec3::Y * height, [Vec3::Z, Vec3::X])
            .map(|ring| ring.symmetric())
            .ok_or(GarmentError::NoSection {
                what: "trunk",
                at_m: height,
            })
    }

    /// The outline of an arm across it, `along` metres from the shoulder joint towards the hand.
    /// u = 0 is at the top, u grows so that it turns outward with the arm's direction as axis: towards
    /// the front on the left arm, towards the back on the right.
    ///
    /// # Errors
    /// No arm there.
    pub fn arm_ring(&self, side: Side, along: f32) -> Result<Ring, GarmentError> {
        let (point, axis) = self.on_arm(side, along);
        let front = Vec3::Y.reject_from(axis).normalize_or(Vec3::Z);
        let ring = self.hull(&self.arms[index(side)], point, [front, axis.cross(front)]);
        ring.ok_or(GarmentError::NoSection {
            what: "arm",
            at_m: along,
        })
    }

    /// Point on the bones of an arm, `along` metres from the shoulder joint, and the unit direction
    /// towards the hand there, which turns smoothly around the elbow.
    pub fn on_arm(&self, side: Side, along: f32) -> (Vec3, Vec3) {
        let [shoulder, elbow, wrist] = [16, 18, 20].map(|j| self.joints[j + index(side)]);
        let upper = shoulder.distance(elbow);
        let (d0, d1) = (
            (elbow - shoulder).normalize_or(Vec3::X),
            (wrist - elbow).normalize_or(Vec3::X),
        );
        let point = if along < upper {
            shoulder + d0 * along
        } else {
            elbow + d1 * (along - upper)
        };
        let bend = ((along - upper) / (0.5 * upper) + 0.5).clamp(0.0, 1.0);
        (point, d0.lerp(d1, bend).normalize_or(d0))
    }

    /// Lengths of the upper arm and the forearm, metres.
    pub fn arm_lengths(&self, side: Side) -> [f32; 2] {
        let [shoulder, elbow, wrist] = [16, 18, 20].map(|j| self.joints[j + index(side)]);
        [shoulder.distance(elbow), elbow.distance(wrist)]
    }

    /// The heights at which clothes are measured.
    ///
    /// # Errors
    /// A body without a trunk.
    pub fn measurements(&self) -> Result<Measurements, GarmentError> {
        let y = |joint: usize| self.joints[joint].y;
        let crotch = self.crotch();
        let shoulder = 0.5 * (y(16) + y(17));
        let hip_top = y(PELVIS) + 0.4 * (y(SPINE2) - y(PELVIS)).max(0.05);
        let chest_base = y(SPINE2) + 0.5 * (shoulder - y(SPINE2));
        let hip = self.extreme(crotch..hip_top, |girth| -girth)?;
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

    /// Lowest point of the trunk on the midplane: where the body between the legs ends.
    fn crotch(&self) -> f32 {
        let pelvis = self.joints[PELVIS];
        let across = |face: &[u32; 3]| {
            let corners = face.map(|v| self.vertices[v as usize]);
            let sides = corners.map(|c| c.x - pelvis.x);
            let crosses = sides.iter().any(|s| *s >= 0.0) && sides.iter().any(|s| *s <= 0.0);
            let height = corners.iter().map(|c| c.y).sum::<f32>() / 3.0;
            // Feet may touch; they are not the trunk's end.
            (crosses && height > pelvis.y - 0.3).then_some(height)
        };
        self.trunk.iter().filter_map(across).fold(pelvis.y, f32::min)
    }

    /// Height of the trunk ring of least cost, a function of the circumference.
    fn extreme(&self, heights: Range<f32>, cost: impl Fn(f32) -> f32) -> Result<f32, GarmentError> {
        let count = ((heights.end - heights.start) / SLICE_M)
            .ceil()
            .clamp(1.0, 1000.0) as usize;
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
        // The trunk's rings stay centred on the midplane, so that mirrored ones are its own.
        let shift = front * middle.x + side * if side == Vec3::X { 0.0 } else { middle.y };
        let plane_shift = Vec2::new(shift.dot(front), shift.dot(side));
        points.iter_mut().for_each(|p| *p -= plane_shift);
        Ring::around(origin + shift, [front, side], &points)
    }
}

fn index(side: Side) -> usize {
    match side {
        Side::Left => 0,
        Side::Right => 1,
    }
}

/// Centre of the bounding box.
fn centre(points: &[Vec2]) -> Option<Vec2> {
    let first = *points.first()?;
    let (low, high) = (points.iter()).fold((first, first), |(l, h), p| (l.min(*p), h.max(*p)));
    Some(low.midpoint(high))
}
