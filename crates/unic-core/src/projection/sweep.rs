//! Gauss-Seidel sweeps over constraints of one colour.

use super::{StrainLimit, stencil::BendingStencil};
use crate::parallel::for_each;
use glam::Vec3A;
use std::marker::PhantomData;

/// Number of constraints in one part of the work. The parts of a small garment are so few that
/// waking threads would cost more than it saves.
pub(super) const PART: usize = 1024;

/// Length below which an edge has no direction, metres.
pub const LEAST_LENGTH: f32 = 1e-9;

/// Positions that several threads modify at once, each those of other vertices.
///
/// They are aligned, so that a position is one load and one store of four lanes.
pub(super) struct SharedPositions<'a> {
    first: *mut Vec3A,
    count: usize,
    borrowed: PhantomData<&'a mut [Vec3A]>,
}

// SAFETY: positions are read and written through unsafe methods alone, whose contract is that no
// two threads access one vertex at a time.
unsafe impl Sync for SharedPositions<'_> {}

impl<'a> SharedPositions<'a> {
    pub(super) fn new(positions: &'a mut [Vec3A]) -> Self {
        Self {
            first: positions.as_mut_ptr(),
            count: positions.len(),
            borrowed: PhantomData,
        }
    }

    /// Returns the position of a vertex.
    ///
    /// # Safety
    /// The vertex must exist, and no other thread may write it during the call.
    unsafe fn get(&self, vertex: u32) -> Vec3A {
        debug_assert!((vertex as usize) < self.count);
        // SAFETY: the caller's.
        unsafe { *self.first.add(vertex as usize) }
    }

    /// Moves a vertex.
    ///
    /// # Safety
    /// The vertex must exist, and no other thread may access it during the call.
    unsafe fn shift(&self, vertex: u32, by: Vec3A) {
        debug_assert!((vertex as usize) < self.count);
        // SAFETY: the caller's.
        unsafe { *self.first.add(vertex as usize) += by }
    }
}

/// Edge with the limits of its length.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Vertices at the ends.
    pub ends: [u32; 2],
    /// Limits of the length.
    pub limit: StrainLimit,
    /// Share of a correction that each end takes. They sum to 1, or are 0 where both are fixed.
    pub shares: [f32; 2],
}

impl Edge {
    pub(super) fn new(ends: [u32; 2], limit: StrainLimit, weights: &[f32]) -> Self {
        let [a, b] = ends.map(|v| weights[v as usize]);
        let scale = if a + b > 0.0 { (a + b).recip() } else { 0.0 };
        Self {
            ends,
            limit,
            shares: [a * scale, b * scale],
        }
    }

    /// Moves both ends so that the length is within its limits.
    ///
    /// # Safety
    /// The ends must exist, and no other thread may access them during the call.
    pub(super) unsafe fn project(&self, positions: &SharedPositions) {
        // SAFETY: the caller's.
        let [a, b] = self.ends.map(|v| unsafe { positions.get(v) });
        let along = b - a;
        let length = along.length();
        // An edge without a length has no direction to grow in; its neighbours move it. False for
        // NaN, too.
        if length > LEAST_LENGTH {
            let wanted = length.max(self.limit.shortest).min(self.limit.longest);
            let correction = along * ((length - wanted) / length);
            // SAFETY: the caller's.
            unsafe {
                positions.shift(self.ends[0], correction * self.shares[0]);
                positions.shift(self.ends[1], -correction * self.shares[1]);
            }
        }
    }
}

/// Bending stencil with the moves of its vertices.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// Vertices. One that repeats another has a coefficient and a move of zero.
    pub vertices: [u32; 4],
    /// Coefficients of the offsets in the stencil's sum.
    pub coefficients: [f32; 4],
    /// Factors of the stencil's sum in the move of each vertex.
    pub moves: [f32; 4],
}

impl Stencil {
    /// Packs a stencil whose sum one pass reduces by `strength`, 0 to 1.
    pub(super) fn new(stencil: &BendingStencil, strength: f32, weights: &[f32]) -> Self {
        let BendingStencil {
            vertices,
            coefficients,
            strength: factor,
        } = *stencil;
        let strength = (strength * factor).min(1.0);
        let weights = vertices.map(|v| weights[v as usize]);
        let squares: f32 = coefficients.iter().zip(weights).map(|(k, w)| k * k * w).sum();
        let scale = if squares > 0.0 { strength / squares } else { 0.0 };
        Self {
            vertices,
            coefficients,
            moves: [0, 1, 2, 3].map(|i| -scale * coefficients[i] * weights[i]),
        }
    }

    /// Reduces the bending of the offset from the predicted positions.
    ///
    /// # Safety
    /// The vertices must exist, and no other thread may access them during the call.
    pub(super) unsafe fn smooth(&self, predicted: &[Vec3A], positions: &SharedPositions) {
        let mut sum = Vec3A::ZERO;
        for (&vertex, &k) in self.vertices.iter().zip(&self.coefficients) {
            // SAFETY: the caller's.
            sum += (unsafe { positions.get(vertex) } - predicted[vertex as usize]) * k;
        }
        for (&vertex, &factor) in self.vertices.iter().zip(&self.moves) {
            // SAFETY: the caller's.
            unsafe { positions.shift(vertex, sum * factor) }
        }
    }
}

/// Calls `project` for every constraint of a colour, on all threads where there are many.
pub(super) fn sweep<T: Sync>(colour: &[T], project: impl Fn(&T) + Sync) {
    if colour.len() < 2 * PART {
        return colour.iter().for_each(project);
    }
    for_each(colour.chunks(PART), |part: &[T]| part.iter().for_each(&project));
}
