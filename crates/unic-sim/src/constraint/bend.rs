//! Bending constraints: the dihedral angle between two triangles that share an edge.

use super::{ConstraintBlock, SharedPositions, multiplier, pack_corners, pack_lanes};
use crate::simd::{F32x8, LANES, Vec3x8};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Smallest triangle area, relative to the rest area, that the gradients are computed with. The
/// gradients of the angle grow without bound as a triangle collapses.
const LEAST_AREA: f32 = 0.05;

/// The bending constraint of a hinge: an edge and the corners opposite to it.
///
/// The energy is ½ k (θ − θ₀)² with k = B |e|² / (A₁ + A₂). That is the form of Grinspun et al.
/// 2003 ("Discrete shells", §2), with a factor that makes B the bending rigidity of Kawabata:
///
/// - Let equilateral triangles of side a lie on a cylinder of curvature κ whose axis is parallel to
///   one direction of edges.
/// - Hinges at these edges have θ = √3/2 κ a, all others have θ = 0.
/// - There are 2/(√3 a²) such hinges per area, each with k = 2 B/√3.
/// - The energy per area is therefore ½ B κ².
///
/// The energy is the same for every direction of the axis. It is also ½ B κ² for squares that are
/// cut into two triangles and bend about their sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BendConstraint {
    /// The edge's two ends, then the third corners of the triangles on its left and on its right.
    pub(crate) particles: [u32; 4],
    /// Rest angle θ₀, radians.
    pub(crate) rest_angle: f32,
    /// Compliance 1/k, 1/(N·m).
    pub(crate) compliance: f32,
    /// Time constant of internal damping, seconds.
    pub(crate) damping: f32,
    /// Lower limit of the squared length of an area normal in a divisor, m⁴.
    least_squared: f32,
}

impl BendConstraint {
    /// Makes the constraint of a hinge with these rest corners, in the order of `particles`.
    ///
    /// `rest_angle_share` is the share of the rest shape's angle that is the rest angle,
    /// `stiffness` Kawabata's B in N·m, `damping` a time constant in seconds. Returns `None` for a
    /// hinge whose rest triangles include a sliver.
    pub(crate) fn new(
        particles: [u32; 4],
        corners: [Vec3; 4],
        rest_angle_share: f32,
        stiffness: f32,
        damping: f32,
    ) -> Option<Self> {
        let [a, b, left, right] = corners;
        let e = b - a;
        let doubled_areas = [e.cross(left - a).length(), (right - a).cross(e).length()];
        let smaller = doubled_areas[0].min(doubled_areas[1]);
        // The normal of a triangle lower than a thousandth of the edge is rounding noise, and so
        // is the angle. The hinges around carry the bending there.
        if smaller <= 1e-3 * e.length_squared() {
            return None;
        }
        let k = 2.0 * stiffness * e.length_squared() / (doubled_areas[0] + doubled_areas[1]);
        Some(Self {
            particles,
            rest_angle: rest_angle_share * angle(corners),
            compliance: k.recip(),
            damping,
            least_squared: (LEAST_AREA * smaller).powi(2),
        })
    }
}

/// Returns the signed dihedral angle between the triangles (0, 1, 2) and (1, 0, 3), radians in
/// −π..=π. It is zero when flat and positive when the triangles fold away from their normals' side.
pub(crate) fn angle(corners: [Vec3; 4]) -> f32 {
    // The solver's own arithmetic, approximate arc tangent included: a rest shape then has a
    // violation of exactly zero.
    let [a, b, left, right] = corners.map(|c| Vec3x8::gather(&[0; LANES], |_| c));
    Hinge::new(a, b, left, right).angle().0[0]
}

/// Current shape of [`LANES`] hinges, from which angles and gradients are computed.
struct Hinge {
    /// Edge vector, metres.
    edge: Vec3x8,
    /// Length of the edge, metres.
    length: F32x8,
    /// Normal of the left triangle, of twice its area as length, m².
    left: Vec3x8,
    /// Normal of the right triangle, likewise.
    right: Vec3x8,
}

impl Hinge {
    #[inline(always)]
    fn new(a: Vec3x8, b: Vec3x8, left: Vec3x8, right: Vec3x8) -> Self {
        let edge = b - a;
        let length = edge.dot(edge).sqrt().max(F32x8::splat(1e-12));
        Self {
            edge,
            length,
            left: edge.cross(left - a),
            right: (right - a).cross(edge),
        }
    }

    #[inline(always)]
    fn angle(&self) -> F32x8 {
        // Both are scaled by the same positive factor |left| |right| |edge|, which `atan2` ignores.
        // An arc cosine would lose all precision near zero, where cloth spends most of its time.
        let sine = self.left.cross(self.right).dot(self.edge);
        let cosine = self.left.dot(self.right) * self.length;
        F32x8::atan2(sine, cosine)
    }
}

/// [`LANES`] bending constraints, solved together.
#[derive(Debug, Clone)]
pub(crate) struct BendBlock {
    particles: [[u32; LANES]; 4],
    inverse_masses: [F32x8; 4],
    rest_angle: F32x8,
    compliance: F32x8,
    damping: F32x8,
    least_squared: F32x8,
}

impl ConstraintBlock<4> for BendBlock {
    type Constraint = BendConstraint;

    fn particles(constraint: &BendConstraint) -> [u32; 4] {
        constraint.particles
    }

    fn pack(constraints: &[BendConstraint], inverse_masses: &[f32]) -> Self {
        let corners: Vec<[u32; 4]> = constraints.iter().map(|c| c.particles).collect();
        let corners = pack_corners(&corners, inverse_masses);
        Self {
            particles: corners.particles,
            inverse_masses: corners.inverse_masses,
            rest_angle: pack_lanes(constraints, |c| c.rest_angle),
            compliance: pack_lanes(constraints, |c| c.compliance),
            damping: pack_lanes(constraints, |c| c.damping),
            least_squared: pack_lanes(constraints, |c| c.least_squared),
        }
    }

    /// Projects damping first and the angle second.
    ///
    /// The damping moment −τ/α · dC/dt is a projection of its own: with γ = τ/Δt it is
    /// λ = −γ ∇C · (x − x_start) / (γ Σ w |∇C|² + α/Δt²). The angle is then projected from the
    /// position that damping leaves. Solving both at once (Macklin et al. 2016, eq. 26) would
    /// divide the stiffness of a hinge at rest by up to 1 + γ, because there is one sweep per
    /// substep.
    #[inline(always)]
    unsafe fn solve(&self, positions: &SharedPositions<'_>, seconds: f32) {
        // SAFETY: guaranteed by the caller.
        let x = self.particles.each_ref().map(|p| unsafe { positions.gather(p) });
        let [x0, x1, x2, x3] = x;
        let hinge = Hinge::new(x0, x1, x2, x3);
        let gradients = self.gradients(&hinge, x0, x2, x3);
        let violation = wrapped(hinge.angle() - self.rest_angle);

        let gamma = self.damping * F32x8::splat(seconds.recip());
        let mut mobility = F32x8::ZERO;
        let mut change = F32x8::ZERO;
        for (corner, gradient) in gradients.into_iter().enumerate() {
            mobility += self.inverse_masses[corner] * gradient.dot(gradient);
            // SAFETY: guaranteed by the caller.
            let start = unsafe { positions.gather_previous(&self.particles[corner]) };
            change += gradient.dot(x[corner] - start);
        }
        let compliance = self.compliance * F32x8::splat((seconds * seconds).recip());
        let damping = multiplier(gamma * change, gamma * mobility, compliance);
        // The angle after damping, to first order: moving by w ∇C λ changes C by Σ w |∇C|² λ. One
        // set of gradients serves both projections.
        let lambda = damping + multiplier(violation + mobility * damping, mobility, compliance);
        for (corner, gradient) in gradients.into_iter().enumerate() {
            let by = gradient * (self.inverse_masses[corner] * lambda);
            // SAFETY: guaranteed by the caller.
            unsafe { positions.shift(&self.particles[corner], by) };
        }
    }
}

impl BendBlock {
    /// Computes the gradients of the angle at the four corners, 1/m (Bridson et al. 2003,
    /// "Simulation of clothing with folds and wrinkles", §4).
    #[inline(always)]
    fn gradients(&self, hinge: &Hinge, x0: Vec3x8, x2: Vec3x8, x3: Vec3x8) -> [Vec3x8; 4] {
        let squared = |normal: Vec3x8| normal.dot(normal).max(self.least_squared);
        let left = hinge.left * (hinge.length / squared(hinge.left));
        let right = hinge.right * (hinge.length / squared(hinge.right));
        // Position of the third corners along the edge: 0 at its first end, 1 at the second.
        let per_square = F32x8::splat(1.0) / (hinge.length * hinge.length);
        let along = |from: Vec3x8, to: Vec3x8| (to - from).dot(hinge.edge) * per_square;
        let (s, t) = (along(x0, x2), along(x0, x3));
        let one = F32x8::splat(1.0);
        [
            left * (one - s) + right * (one - t),
            left * s + right * t,
            left * -one,
            right * -one,
        ]
    }
}

/// Maps an angle in −2π..=2π to the equivalent one in −π..=π. A hinge that folds beyond π would
/// otherwise be driven around the long way.
#[inline(always)]
fn wrapped(angle: F32x8) -> F32x8 {
    let (turn, half) = (F32x8::splat(TAU), F32x8::splat(PI));
    let angle = half.choose_less(angle, angle - turn, angle);
    angle.choose_less(-half, angle + turn, angle)
}

#[cfg(test)]
mod tests;
