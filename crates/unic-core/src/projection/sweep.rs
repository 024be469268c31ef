//! Gauss-Seidel sweeps over constraints of one colour.

use super::{StrainLimit, freedom::Freedom, stencil::BendingStencil};
use crate::parallel::for_each_stage;
use glam::{Vec3A, Vec4};
use std::marker::PhantomData;

/// Number of constraints or vertices in one part of the work.
pub(super) const PART: usize = 512;

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
// Small, because sweeps over a fine mesh wait for the memory that holds the constraints.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Vertices at the ends.
    pub ends: [u32; 2],
    /// Limits of the length.
    pub limit: StrainLimit,
}

impl Edge {
    /// Returns the share of a correction that each end takes, given the freedom of both. They sum to
    /// 1, or are 0 where both are fixed.
    pub fn shares([a, b]: [f32; 2]) -> [f32; 2] {
        let scale = if a + b > 0.0 { (a + b).recip() } else { 0.0 };
        [a * scale, b * scale]
    }
}

/// Number of edges that are projected together. Their lengths share vector instructions.
const TOGETHER: usize = 4;

/// Moves the ends of some edges, [`TOGETHER`] at most, so that the lengths are within their limits.
///
/// The edges share no end: all ends are read before any is moved.
///
/// # Safety
/// The ends must exist, and no other thread may access them during the call.
#[inline(always)]
unsafe fn project_together(edges: &[Edge], freedom: impl Fn(u32) -> f32, positions: &SharedPositions) {
    let mut along = [Vec3A::ZERO; TOGETHER];
    let (mut shortest, mut longest) = ([0.0; TOGETHER], [0.0; TOGETHER]);
    for (lane, edge) in edges.iter().enumerate() {
        // SAFETY: the caller's.
        let [a, b] = edge.ends.map(|v| unsafe { positions.get(v) });
        along[lane] = b - a;
        (shortest[lane], longest[lane]) = (edge.limit.shortest, edge.limit.longest);
    }
    let length = Vec4::from_array(along.map(|along| along.length_squared())).sqrt();
    let wanted = length
        .max(Vec4::from_array(shortest))
        .min(Vec4::from_array(longest));
    let excess = ((length - wanted) / length).to_array();
    let lanes = along.into_iter().zip(length.to_array()).zip(excess);
    for (edge, ((along, length), excess)) in edges.iter().zip(lanes) {
        // An edge without a length has no direction to grow in; its neighbours move it. False for NaN,
        // too, which would spread along the edges.
        let has_direction = length > LEAST_LENGTH;
        if !has_direction {
            continue;
        }
        let correction = along * excess;
        let shares = Edge::shares(edge.ends.map(&freedom));
        // SAFETY: the caller's.
        unsafe {
            positions.shift(edge.ends[0], correction * shares[0]);
            positions.shift(edge.ends[1], -correction * shares[1]);
        }
    }
}

/// Bending stencil.
// Small, as an edge is.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// Distinct vertices.
    pub vertices: [u32; 4],
    /// Coefficients of the first three offsets in the stencil's sum. All four sum to zero.
    first_coefficients: [f32; 3],
    /// Factor of the stencil's sum in the moves.
    scale: f32,
}

impl Stencil {
    /// Packs a stencil.
    pub(super) fn new(stencil: &BendingStencil, freedom: &Freedom) -> Self {
        let BendingStencil {
            vertices,
            coefficients,
            share,
        } = *stencil;
        let weights = vertices.map(|v| freedom.of(v));
        let squares: f32 = coefficients.iter().zip(weights).map(|(k, w)| k * k * w).sum();
        let [first, second, third, _] = coefficients;
        Self {
            vertices,
            first_coefficients: [first, second, third],
            scale: if squares > 0.0 { share / squares } else { 0.0 },
        }
    }

    /// Returns the coefficients of the offsets in the stencil's sum.
    pub fn coefficients(&self) -> [f32; 4] {
        let [first, second, third] = self.first_coefficients;
        [first, second, third, -(first + second + third)]
    }

    /// Factor of the stencil's sum: each vertex moves by minus the sum times this factor, times the
    /// vertex's coefficient, times its freedom.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Reduces the bending of the moves from reference positions: the predicted ones, the shown ones
    /// before intersection handling, or those of the samples at the start of a level.
    ///
    /// # Safety
    /// The vertices must exist, and no other thread may access them during the call.
    unsafe fn smooth(&self, freedom: impl Fn(u32) -> f32, reference: &[Vec3A], positions: &SharedPositions) {
        let coefficients = self.coefficients();
        let mut sum = Vec3A::ZERO;
        for (&vertex, k) in self.vertices.iter().zip(coefficients) {
            // SAFETY: the caller's.
            sum += (unsafe { positions.get(vertex) } - reference[vertex as usize]) * k;
        }
        let pull = sum * -self.scale;
        for (&vertex, k) in self.vertices.iter().zip(coefficients) {
            // SAFETY: the caller's.
            unsafe { positions.shift(vertex, pull * (k * freedom(vertex))) }
        }
    }
}

/// Constraints of one colour.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage<'a> {
    Edges(&'a [Edge]),
    Bending(&'a [Stencil]),
}

impl Stage<'_> {
    fn parts(&self) -> usize {
        let constraints = match self {
            Stage::Edges(edges) => edges.len(),
            Stage::Bending(stencils) => stencils.len(),
        };
        constraints.div_ceil(PART)
    }

    /// Solves the constraints of one part.
    ///
    /// # Safety
    /// The vertices of the part must exist, and no other thread may access them during the call.
    unsafe fn solve(
        &self,
        part: usize,
        freedom: impl Fn(u32) -> f32,
        reference: &[Vec3A],
        positions: &SharedPositions,
    ) {
        match self {
            Stage::Edges(edges) => {
                let (together, others) = of_part(edges, part).as_chunks::<TOGETHER>();
                for edges in together {
                    // SAFETY: the caller's.
                    unsafe { project_together(edges, &freedom, positions) }
                }
                // SAFETY: the caller's.
                unsafe { project_together(others, &freedom, positions) }
            }
            Stage::Bending(stencils) => {
                for stencil in of_part(stencils, part) {
                    // SAFETY: the caller's.
                    unsafe { stencil.smooth(&freedom, reference, positions) }
                }
            }
        }
    }
}

fn of_part<T>(constraints: &[T], part: usize) -> &[T] {
    let first = part * PART;
    &constraints[first..constraints.len().min(first + PART)]
}

/// Solves stages one after another, on all threads. `stage_at` gives the stage with an index.
///
/// # Safety
/// The vertices of all constraints must exist, and those of one stage must share none.
pub(super) unsafe fn solve<'a>(
    stages: usize,
    stage_at: impl Fn(usize) -> Stage<'a> + Sync,
    freedom: &Freedom,
    reference: &[Vec3A],
    positions: &mut [Vec3A],
) {
    let positions = SharedPositions::new(positions);
    let parts_of = |stage| stage_at(stage).parts();
    match freedom.shares() {
        Some(shares) => for_each_stage(stages, parts_of, |stage, part| {
            let freedom = |vertex: u32| shares[vertex as usize];
            // SAFETY: the caller's. Stages do not overlap in time, and the parts of a stage share no
            // vertex.
            unsafe { stage_at(stage).solve(part, freedom, reference, &positions) }
        }),
        None => for_each_stage(stages, parts_of, |stage, part| {
            // SAFETY: as above.
            unsafe { stage_at(stage).solve(part, |_| 1.0, reference, &positions) }
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::point;
    use proptest::{collection::vec, prelude::*};

    /// Positions with the ends of an edge brought within its limit, without lanes.
    fn projected_alone(edge: &Edge, freedom: &Freedom, mut positions: Vec<Vec3A>) -> Vec<Vec3A> {
        let [a, b] = edge.ends.map(|v| v as usize);
        let along = positions[b] - positions[a];
        let length = along.length();
        if length > LEAST_LENGTH {
            let wanted = length.max(edge.limit.shortest).min(edge.limit.longest);
            let correction = along * ((length - wanted) / length);
            let shares = Edge::shares(edge.ends.map(|v| freedom.of(v)));
            positions[a] += correction * shares[0];
            positions[b] -= correction * shares[1];
        }
        positions
    }

    proptest! {
        #[test]
        fn edges_that_are_projected_together_end_as_edges_alone_do(
            ends in vec(point(1.0), 2..40), lengths in vec(0.0f32..2.0, 40), masked in any::<bool>(),
            pointlike in 0usize..20, broken in 0usize..40,
        ) {
            let count = ends.len() as u32 / 2;
            let mut positions: Vec<Vec3A> = ends.iter().map(|p| Vec3A::from(*p)).collect();
            let edge = |k: u32| Edge {
                ends: [2 * k, 2 * k + 1],
                limit: StrainLimit {
                    shortest: lengths[2 * k as usize],
                    longest: lengths[2 * k as usize] + lengths[2 * k as usize + 1],
                },
            };
            let edges: Vec<Edge> = (0..count).map(edge).collect();
            let firsts: Vec<u32> = (0..ends.len() as u32).collect();
            let mask: Vec<f32> = (0..ends.len()).map(|v| [0.0, 1.0, 0.3][v % 3]).collect();
            let freedom = Freedom::of_mask(masked.then_some(&mask[..]), &firsts);
            // An edge without a length keeps the sign of its zeros, and NaN stays where it is.
            if let Some([a, b]) = positions.as_chunks_mut::<2>().0.get_mut(pointlike) {
                (*a, *b) = (Vec3A::splat(-0.0), Vec3A::splat(-0.0));
            }
            if let Some(position) = positions.get_mut(broken) {
                *position = Vec3A::NAN;
            }
            let alone = edges.iter().fold(positions.clone(), |p, edge| projected_alone(edge, &freedom, p));
            // SAFETY: no two edges share a vertex, and all vertices exist.
            unsafe { solve(1, |_| Stage::Edges(&edges), &freedom, &[], &mut positions) }
            let bits = |positions: &[Vec3A]| positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>();
            prop_assert_eq!(bits(&positions), bits(&alone));
            let is_nan = |v: &usize| positions[*v].is_nan();
            prop_assert!((0..positions.len()).filter(is_nan).all(|v| v == broken));
        }
    }
}
