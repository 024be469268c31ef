//! Stretches of motion with the coefficients of the garment.

use crate::{
    dataset::MotionVectors,
    mirror::{View, mirrored},
};
use glam::Vec3;
use std::ops::Range;
use unic_core::{
    mesh::TriMesh,
    recurrence::{Recurrence, RecurrenceScratch},
    surface_map::SurfaceMap,
};

/// Consecutive frames of one clip in one view.
#[derive(Clone)]
pub(crate) struct Sequence<'a> {
    pub(crate) motion: &'a MotionVectors,
    pub(crate) view: View,
    pub(crate) frames: Range<usize>,
    /// To learn, metres: frames × K.
    pub(crate) coefficients: Vec<f32>,
    /// By the linear map that has not seen the motion: frames × K.
    pub(crate) linear: Vec<f32>,
    /// A sequence, its mirror image and the same motion in another wind have the same number.
    pub(crate) motion_number: usize,
}

impl Sequence<'_> {
    pub(crate) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Coefficients K.
    pub(crate) fn outputs(&self) -> usize {
        self.coefficients.len() / self.len().max(1)
    }

    /// The normalised motion pair of the sequence's frame `t`; the first frame of a clip is paired
    /// with itself.
    pub(crate) fn write_pair(&self, t: usize, out: &mut Vec<f32>) {
        let frame = self.frames.start + t;
        out.extend_from_slice(self.motion.frame(frame.saturating_sub(1), self.view));
        out.extend_from_slice(self.motion.frame(frame, self.view));
    }

    /// What a recurrence says of the coefficients, as the animator has it: frames × K.
    pub(crate) fn said_by(&self, recurrence: &Recurrence) -> Vec<f32> {
        let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
        let mut coefficients = vec![0.0; self.coefficients.len()];
        let mut pair = Vec::new();
        for (t, out) in coefficients.chunks_exact_mut(self.outputs().max(1)).enumerate() {
            pair.clear();
            self.write_pair(t, &mut pair);
            recurrence.read(&pair, &mut scratch);
            match t {
                0 => recurrence.start(&mut scratch, &mut state),
                _ => recurrence.advance(&mut scratch, &mut state),
            }
            recurrence.add_to(&state, &mut scratch, out);
        }
        coefficients
    }
}

/// How far a garment may be from its mirror image on average to be taken as symmetric, metres.
const SYMMETRIC_M: f32 = 0.005;

/// Where the vertices of a mirrored garment are on the garment itself; none for one whose sides
/// differ.
pub(crate) fn mirrored_surface(rest: &TriMesh) -> Option<SurfaceMap> {
    let points: Vec<Vec3> = rest.vertices.iter().map(|v| mirrored(*v)).collect();
    let map = SurfaceMap::new(rest, &points).ok()?;
    let total: f32 = map.distances().sum();
    (total <= SYMMETRIC_M * points.len() as f32).then_some(map)
}
