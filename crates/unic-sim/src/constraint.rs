//! Constraints of extended position-based dynamics (XPBD), solved colour by colour.
//!
//! A constraint function C(x) with compliance α moves its particles by Δx_i = w_i ∇_i C · λ, where
//! w_i are inverse masses and λ = −C / (Σ w_i |∇_i C|² + α/Δt²). Each constraint is projected once
//! per substep, so that λ starts at zero every time (Macklin et al. 2019, "Small steps in physics
//! simulation"; Macklin et al. 2016, "XPBD", eq. 18).

pub(crate) mod bend;
pub(crate) mod stretch;

use crate::{
    Particles,
    simd::{F32x8, LANES, Vec3x8},
};
use glam::Vec3;
use rayon::prelude::*;
use std::marker::PhantomData;
use unic_core::colouring::colour_constraints;

/// Number of blocks in a rayon task: large enough to outweigh the cost of scheduling.
const CHUNK: usize = 64;

/// Positions that several threads modify at once, each those of other particles.
///
/// Constraints of one colour touch scattered particles, so that the slice cannot be split into
/// disjoint parts that the borrow checker would accept.
pub(crate) struct SharedPositions<'a> {
    positions: *mut Vec3,
    previous: *const Vec3,
    count: usize,
    borrowed: PhantomData<&'a mut [Vec3]>,
}

// SAFETY: `SharedPositions` is read and written through unsafe methods alone, whose contract is
// that no two threads access one particle at a time.
unsafe impl Sync for SharedPositions<'_> {}

impl<'a> SharedPositions<'a> {
    pub(crate) fn new(particles: &'a mut Particles) -> Self {
        assert_eq!(particles.positions.len(), particles.previous.len());
        Self {
            positions: particles.positions.as_mut_ptr(),
            previous: particles.previous.as_ptr(),
            count: particles.positions.len(),
            borrowed: PhantomData,
        }
    }

    /// Loads the positions of one particle per lane.
    ///
    /// # Safety
    /// The indices must be below the particle count, and no other thread may modify these particles
    /// during the call.
    #[inline(always)]
    pub(crate) unsafe fn gather(&self, indices: &[u32; LANES]) -> Vec3x8 {
        debug_assert!(indices.iter().all(|&i| (i as usize) < self.count));
        // SAFETY: guaranteed by the caller.
        Vec3x8::gather(indices, |i| unsafe { *self.positions.add(i as usize) })
    }

    /// Loads the positions of one particle per lane at the start of the substep.
    ///
    /// # Safety
    /// The indices must be below the particle count.
    #[inline(always)]
    pub(crate) unsafe fn gather_previous(&self, indices: &[u32; LANES]) -> Vec3x8 {
        debug_assert!(indices.iter().all(|&i| (i as usize) < self.count));
        // SAFETY: guaranteed by the caller.
        Vec3x8::gather(indices, |i| unsafe { *self.previous.add(i as usize) })
    }

    /// Adds a displacement to the position of one particle per lane.
    ///
    /// A particle may occur in several lanes if all but one of them add zero.
    ///
    /// # Safety
    /// The indices must be below the particle count, and no other thread may access these particles
    /// during the call.
    #[inline(always)]
    pub(crate) unsafe fn shift(&self, indices: &[u32; LANES], by: Vec3x8) {
        // Lane by lane, each a read and a write: a vector scatter would lose updates where padding
        // lanes repeat a particle.
        for (lane, &index) in indices.iter().enumerate() {
            // SAFETY: guaranteed by the caller.
            unsafe { *self.positions.add(index as usize) += by.lane(lane) };
        }
    }
}

/// A block of [`LANES`] constraints of one kind over N particles each, solved together.
pub(crate) trait ConstraintBlock<const N: usize>: Send + Sync + Sized {
    /// Type of a single constraint, before packing.
    type Constraint: Copy;

    /// Returns the particles of a constraint.
    fn particles(constraint: &Self::Constraint) -> [u32; N];

    /// Packs 1 to [`LANES`] constraints. Unused lanes repeat the first constraint with inverse
    /// masses of zero, so that they move nothing.
    fn pack(constraints: &[Self::Constraint], inverse_masses: &[f32]) -> Self;

    /// Projects the constraints of all lanes in a substep of `seconds`.
    ///
    /// # Safety
    /// The block must have been packed for the particles of `positions`, and no other thread may
    /// access its particles during the call.
    unsafe fn solve(&self, positions: &SharedPositions<'_>, seconds: f32);
}

/// All constraints of one kind, partitioned into colours and packed into blocks.
#[derive(Debug, Clone)]
pub(crate) struct ColouredConstraints<B, const N: usize> {
    /// Blocks of each colour. No two constraints of a colour share a particle.
    colours: Vec<Vec<B>>,
    particle_count: usize,
    len: usize,
}

impl<B: ConstraintBlock<N>, const N: usize> ColouredConstraints<B, N> {
    /// Partitions constraints into colours and packs them. `inverse_masses` are those of all
    /// particles.
    ///
    /// # Panics
    /// Panics when a constraint names a particle that has no mass in the list.
    pub(crate) fn new(constraints: &[B::Constraint], inverse_masses: &[f32]) -> Self {
        let particles: Vec<[u32; N]> = constraints.iter().map(B::particles).collect();
        let count = inverse_masses.len();
        assert!(particles.iter().flatten().all(|&p| (p as usize) < count));
        let pack = |colour: Vec<u32>| {
            let members: Vec<B::Constraint> = colour.iter().map(|&c| constraints[c as usize]).collect();
            (members.chunks(LANES))
                .map(|lanes| B::pack(lanes, inverse_masses))
                .collect()
        };
        Self {
            colours: (colour_constraints(&particles, count).into_iter())
                .map(pack)
                .collect(),
            particle_count: count,
            len: constraints.len(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Projects all constraints once: one Gauss-Seidel sweep, colour by colour.
    pub(crate) fn solve(&self, particles: &mut Particles, seconds: f32) {
        assert_eq!(particles.positions.len(), self.particle_count, "particles");
        let positions = SharedPositions::new(particles);
        for colour in &self.colours {
            // SAFETY: indices were checked against the particle count when the colours were
            // packed, and no two constraints of a colour share a particle.
            let solve = |blocks: &[B]| unsafe { solve_blocks(blocks, &positions, seconds) };
            // Within a colour the order does not change the result, so that threads may take the
            // blocks in any order. Small colours are not worth a fork and a join.
            if colour.len() < 2 * CHUNK {
                solve(colour);
            } else {
                colour.par_chunks(CHUNK).for_each(solve);
            }
        }
    }
}

/// Solves blocks in order, with AVX2 where the processor has it. The result has the same bits with
/// and without.
///
/// # Safety
/// The contract of [`ConstraintBlock::solve`] must hold for every block.
unsafe fn solve_blocks<B: ConstraintBlock<N>, const N: usize>(
    blocks: &[B],
    positions: &SharedPositions<'_>,
    seconds: f32,
) {
    #[cfg(target_arch = "x86_64")]
    {
        // The same code, compiled once more for 256-bit registers. FMA is not enabled: fused
        // operations round differently.
        #[target_feature(enable = "avx2")]
        unsafe fn with_avx2<B: ConstraintBlock<N>, const N: usize>(
            blocks: &[B],
            positions: &SharedPositions<'_>,
            seconds: f32,
        ) {
            for block in blocks {
                // SAFETY: guaranteed by the caller.
                unsafe { block.solve(positions, seconds) };
            }
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the feature was detected; the caller guarantees the rest.
            return unsafe { with_avx2(blocks, positions, seconds) };
        }
    }
    for block in blocks {
        // SAFETY: guaranteed by the caller.
        unsafe { block.solve(positions, seconds) };
    }
}

/// Packs one quantity of up to [`LANES`] constraints; unused lanes repeat the first constraint.
pub(crate) fn pack_lanes<T>(constraints: &[T], quantity: impl Fn(&T) -> f32) -> F32x8 {
    F32x8(std::array::from_fn(|lane| {
        quantity(constraints.get(lane).unwrap_or(&constraints[0]))
    }))
}

/// The particles of up to [`LANES`] constraints, by corner and lane.
pub(crate) struct PackedCorners<const N: usize> {
    /// Particle indices; unused lanes repeat those of the first constraint.
    pub(crate) particles: [[u32; LANES]; N],
    /// Inverse masses, 1/kg; zero in unused lanes.
    pub(crate) inverse_masses: [F32x8; N],
}

/// Packs the particles of up to [`LANES`] constraints and their inverse masses.
pub(crate) fn pack_corners<const N: usize>(corners: &[[u32; N]], inverse_masses: &[f32]) -> PackedCorners<N> {
    let index = |corner: usize, lane: usize| corners.get(lane).unwrap_or(&corners[0])[corner];
    let mass = |corner: usize, lane: usize| match corners.get(lane) {
        Some(c) => inverse_masses[c[corner] as usize],
        None => 0.0,
    };
    PackedCorners {
        particles: std::array::from_fn(|corner| std::array::from_fn(|lane| index(corner, lane))),
        inverse_masses: std::array::from_fn(|corner| F32x8(std::array::from_fn(|lane| mass(corner, lane)))),
    }
}

/// Computes the Lagrange multiplier λ = −C / (Σ w |∇C|² + α/Δt²). `violation` is C, `mobility` is
/// Σ w |∇C|², `compliance` is α/Δt².
#[inline(always)]
pub(crate) fn multiplier(violation: F32x8, mobility: F32x8, compliance: F32x8) -> F32x8 {
    // The limit avoids 0/0 where nothing can move and the compliance is zero.
    -violation / (mobility + compliance).max(F32x8::splat(f32::MIN_POSITIVE))
}
