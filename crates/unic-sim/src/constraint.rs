//! Constraints in extended position-based dynamics, solved colour by colour.
//!
//! Each constraint function C(x) with compliance α moves its particles by Δx_i = w_i ∇_i C · λ with
//! λ = −C / (Σ w_i |∇_i C|² + α/Δt²), once a substep (Macklin et al. 2019, "Small steps in physics
//! simulation"; Macklin et al. 2016, "XPBD", eq. 18, with λ starting at zero).

pub(crate) mod bend;
pub(crate) mod stretch;

use crate::{
    Particles,
    colouring::colours,
    lanes::{Lanes, Lanes3, WIDTH},
};
use glam::Vec3;
use rayon::prelude::*;
use std::marker::PhantomData;

/// Blocks that one thread solves at a stretch: enough work to pay for handing it over.
const CHUNK: usize = 64;

/// Positions that several threads move, each its own particles.
pub(crate) struct Points<'a> {
    positions: *mut Vec3,
    previous: *const Vec3,
    count: usize,
    borrowed: PhantomData<&'a mut [Vec3]>,
}

// SAFETY: `Points` is read and written through unsafe methods alone, whose contract is that no two
// threads name one particle at a time.
unsafe impl Sync for Points<'_> {}

impl<'a> Points<'a> {
    pub(crate) fn new(particles: &'a mut Particles) -> Self {
        assert_eq!(particles.positions.len(), particles.previous.len());
        Self {
            positions: particles.positions.as_mut_ptr(),
            previous: particles.previous.as_ptr(),
            count: particles.positions.len(),
            borrowed: PhantomData,
        }
    }

    /// Positions of a particle for each lane.
    ///
    /// # Safety
    /// The indices are of particles, and no other thread moves them meanwhile.
    #[inline(always)]
    pub(crate) unsafe fn gather(&self, indices: &[u32; WIDTH]) -> Lanes3 {
        debug_assert!(indices.iter().all(|&i| (i as usize) < self.count));
        // SAFETY: the caller's.
        Lanes3::gather(indices, |i| unsafe { *self.positions.add(i as usize) })
    }

    /// Positions at the start of the substep.
    ///
    /// # Safety
    /// The indices are of particles.
    #[inline(always)]
    pub(crate) unsafe fn gather_previous(&self, indices: &[u32; WIDTH]) -> Lanes3 {
        debug_assert!(indices.iter().all(|&i| (i as usize) < self.count));
        // SAFETY: the caller's.
        Lanes3::gather(indices, |i| unsafe { *self.previous.add(i as usize) })
    }

    /// Moves a particle for each lane by `scale · direction`. Lanes that move nothing may repeat
    /// the particles of others.
    ///
    /// # Safety
    /// The indices are of particles that no other thread touches meanwhile.
    #[inline(always)]
    pub(crate) unsafe fn shift(&self, indices: &[u32; WIDTH], by: Lanes3) {
        for (lane, &index) in indices.iter().enumerate() {
            // SAFETY: the caller's.
            unsafe { *self.positions.add(index as usize) += by.lane(lane) };
        }
    }
}

/// [`WIDTH`] constraints of one kind over N particles each.
pub(crate) trait Block<const N: usize>: Send + Sync + Sized {
    /// One constraint, as it is built.
    type One: Copy;

    /// Its particles.
    fn particles(one: &Self::One) -> [u32; N];

    /// Packs at least one and at most [`WIDTH`] constraints; lanes beyond repeat the first one
    /// with unmovable particles.
    fn pack(constraints: &[Self::One], inverse_masses: &[f32]) -> Self;

    /// Projects all lanes. `seconds` is the substep's length.
    ///
    /// # Safety
    /// The block was packed for particles of `points`, and no other thread touches them meanwhile.
    unsafe fn solve(&self, points: &Points<'_>, seconds: f32);
}

/// All constraints of one kind.
#[derive(Debug, Clone)]
pub(crate) struct Coloured<B, const N: usize> {
    colours: Vec<Vec<B>>,
    particle_count: usize,
    len: usize,
}

impl<B: Block<N>, const N: usize> Coloured<B, N> {
    /// Colours and packs.
    ///
    /// # Panics
    /// When a constraint names a particle without a mass.
    pub(crate) fn new(constraints: &[B::One], inverse_masses: &[f32]) -> Self {
        let particles: Vec<[u32; N]> = constraints.iter().map(B::particles).collect();
        let count = inverse_masses.len();
        assert!(particles.iter().flatten().all(|&p| (p as usize) < count));
        let pack = |colour: Vec<u32>| {
            let ones: Vec<B::One> = colour.iter().map(|&c| constraints[c as usize]).collect();
            (ones.chunks(WIDTH))
                .map(|ones| B::pack(ones, inverse_masses))
                .collect()
        };
        Self {
            colours: colours(&particles, count).into_iter().map(pack).collect(),
            particle_count: count,
            len: constraints.len(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// One Gauss-Seidel sweep over all constraints.
    pub(crate) fn solve(&self, particles: &mut Particles, seconds: f32) {
        assert_eq!(
            particles.positions.len(),
            self.particle_count,
            "particles to move"
        );
        let points = Points::new(particles);
        for colour in &self.colours {
            // SAFETY: indices were checked against the particle count when the colours were
            // packed, and no two constraints of a colour share a particle.
            let solve = |blocks: &[B]| unsafe { solve_blocks(blocks, &points, seconds) };
            if colour.len() < 2 * CHUNK {
                solve(colour);
            } else {
                colour.par_chunks(CHUNK).for_each(solve);
            }
        }
    }
}

/// Solves blocks in order with the widest registers at hand; the bits do not depend on them.
///
/// # Safety
/// As for [`Block::solve`], for every block.
unsafe fn solve_blocks<B: Block<N>, const N: usize>(blocks: &[B], points: &Points<'_>, seconds: f32) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        unsafe fn with_avx2<B: Block<N>, const N: usize>(blocks: &[B], points: &Points<'_>, seconds: f32) {
            for block in blocks {
                // SAFETY: the caller's.
                unsafe { block.solve(points, seconds) };
            }
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the instructions are there, the rest is the caller's.
            return unsafe { with_avx2(blocks, points, seconds) };
        }
    }
    for block in blocks {
        // SAFETY: the caller's.
        unsafe { block.solve(points, seconds) };
    }
}

/// One quantity of up to [`WIDTH`] constraints; lanes beyond repeat the first.
pub(crate) fn lanes_of<T>(constraints: &[T], quantity: impl Fn(&T) -> f32) -> Lanes {
    Lanes(std::array::from_fn(|lane| {
        quantity(constraints.get(lane).unwrap_or(&constraints[0]))
    }))
}

/// Indices by corner and lane, and inverse masses likewise; zero in lanes beyond the constraints.
pub(crate) fn corners_of<const N: usize>(
    corners: &[[u32; N]],
    inverse_masses: &[f32],
) -> ([[u32; WIDTH]; N], [Lanes; N]) {
    let index = |corner: usize, lane: usize| corners.get(lane).unwrap_or(&corners[0])[corner];
    let mass = |corner: usize, lane: usize| match corners.get(lane) {
        Some(c) => inverse_masses[c[corner] as usize],
        None => 0.0,
    };
    (
        std::array::from_fn(|corner| std::array::from_fn(|lane| index(corner, lane))),
        std::array::from_fn(|corner| Lanes(std::array::from_fn(|lane| mass(corner, lane)))),
    )
}

/// `−violation / (mobility + compliance)`, zero where nothing can move.
#[inline(always)]
pub(crate) fn multiplier(violation: Lanes, mobility: Lanes, compliance: Lanes) -> Lanes {
    -violation / (mobility + compliance).max(Lanes::splat(f32::MIN_POSITIVE))
}
