//! Resistance of two triangles that share an edge to bending there.

use super::{Block, Points, corners_of, lanes_of, multiplier};
use crate::lanes::{Lanes, Lanes3, WIDTH};
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Twice a triangle's area, relative to the rest one, below which the angle at its edge is not
/// trusted: gradients grow without bound as it collapses.
const LEAST_AREA: f32 = 0.05;

/// A hinge: an edge and the corners opposite to it.
///
/// The energy is ½ k (θ − θ₀)² with k = B |e|² / (A₁ + A₂), the shape of Grinspun et al. 2003
/// ("Discrete shells", §2) with the factor that makes B Kawabata's. Vertices of equilateral
/// triangles of side a on a cylinder of curvature κ whose axis is along edges: those hinges have
/// θ = √3/2 κ a, the others none, and there are 2/(√3 a²) of them an area, each with
/// k = 2 B/√3: the energy per area is ½ B κ². It is the same for every direction of the axis, and for
/// squares cut in two that bend about their sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    /// The edge's ends, then the third corners of the triangle on its left and on its right.
    pub(crate) particles: [u32; 4],
    /// θ₀, radians.
    pub(crate) rest_angle: f32,
    /// 1/k, 1/(N·m).
    pub(crate) compliance: f32,
    /// Time constant of the friction inside, seconds.
    pub(crate) damping: f32,
    /// Least squared length of an area normal to divide by, m⁴.
    least_squared: f32,
}

impl Bend {
    /// From rest corners in the order of `particles`, a share of the rest angle to keep, Kawabata's
    /// B in N·m and the damping time in seconds. None where a rest triangle has no area.
    pub(crate) fn new(
        particles: [u32; 4],
        corners: [Vec3; 4],
        rest_angle_share: f32,
        stiffness: f32,
        damping: f32,
    ) -> Option<Self> {
        let [a, b, left, right] = corners;
        let e = b - a;
        let doubled = [e.cross(left - a).length(), (right - a).cross(e).length()];
        let smaller = doubled[0].min(doubled[1]);
        // A sliver's plane is noise; what bends there is carried by the triangles around.
        if smaller <= 1e-3 * e.length_squared() {
            return None;
        }
        let k = 2.0 * stiffness * e.length_squared() / (doubled[0] + doubled[1]);
        Some(Self {
            particles,
            rest_angle: rest_angle_share * angle(corners),
            compliance: k.recip(),
            damping,
            least_squared: (LEAST_AREA * smaller).powi(2),
        })
    }
}

/// Signed angle between the triangles (0, 1, 2) and (1, 0, 3), radians in −π..=π: zero when flat,
/// positive when they fold away from the side that their normals point to.
pub(crate) fn angle(corners: [Vec3; 4]) -> f32 {
    let [a, b, left, right] = corners.map(|c| Lanes3::gather(&[0; WIDTH], |_| c));
    Hinge::new(a, b, left, right).angle().0[0]
}

/// What angle and gradients share.
struct Hinge {
    edge: Lanes3,
    /// |edge|, metres.
    length: Lanes,
    /// Area normals.
    left: Lanes3,
    right: Lanes3,
}

impl Hinge {
    #[inline(always)]
    fn new(a: Lanes3, b: Lanes3, left: Lanes3, right: Lanes3) -> Self {
        let edge = b - a;
        let length = edge.dot(edge).sqrt().max(Lanes::splat(1e-12));
        Self {
            edge,
            length,
            left: edge.cross(left - a),
            right: (right - a).cross(edge),
        }
    }

    #[inline(always)]
    fn angle(&self) -> Lanes {
        let sine = self.left.cross(self.right).dot(self.edge);
        let cosine = self.left.dot(self.right) * self.length;
        Lanes::atan2(sine, cosine)
    }
}

/// [`WIDTH`] hinges.
#[derive(Debug, Clone)]
pub(crate) struct BendBlock {
    particles: [[u32; WIDTH]; 4],
    inverse_masses: [Lanes; 4],
    rest_angle: Lanes,
    compliance: Lanes,
    damping: Lanes,
    least_squared: Lanes,
}

impl Block<4> for BendBlock {
    type One = Bend;

    fn particles(one: &Bend) -> [u32; 4] {
        one.particles
    }

    fn pack(constraints: &[Bend], inverse_masses: &[f32]) -> Self {
        let corners: Vec<[u32; 4]> = constraints.iter().map(|c| c.particles).collect();
        let (particles, inverse_masses) = corners_of(&corners, inverse_masses);
        Self {
            particles,
            inverse_masses,
            rest_angle: lanes_of(constraints, |c| c.rest_angle),
            compliance: lanes_of(constraints, |c| c.compliance),
            damping: lanes_of(constraints, |c| c.damping),
            least_squared: lanes_of(constraints, |c| c.least_squared),
        }
    }

    /// First the friction, −τ/α · dC/dt, as an impulse of its own: with γ = τ/Δt it is
    /// −γ ∇C · (x − x_start) / (γ Σ w |∇C|² + α/Δt²). Then the angle, from where that leaves it. Solved as
    /// one (Macklin et al. 2016, eq. 26), friction would divide the stiffness of a hinge that is at rest by
    /// up to 1 + γ, as there is one sweep a substep.
    #[inline(always)]
    unsafe fn solve(&self, points: &Points<'_>, seconds: f32) {
        // SAFETY: the caller's.
        let x = self.particles.each_ref().map(|p| unsafe { points.gather(p) });
        let [x0, x1, x2, x3] = x;
        let hinge = Hinge::new(x0, x1, x2, x3);
        let gradients = self.gradients(&hinge, x0, x2, x3);
        let violation = wrapped(hinge.angle() - self.rest_angle);

        let gamma = self.damping * Lanes::splat(seconds.recip());
        let mut mobility = Lanes::ZERO;
        let mut change = Lanes::ZERO;
        for (corner, gradient) in gradients.into_iter().enumerate() {
            mobility += self.inverse_masses[corner] * gradient.dot(gradient);
            // SAFETY: the caller's.
            let start = unsafe { points.gather_previous(&self.particles[corner]) };
            change += gradient.dot(x[corner] - start);
        }
        let compliance = self.compliance * Lanes::splat((seconds * seconds).recip());
        let friction = multiplier(gamma * change, gamma * mobility, compliance);
        let lambda = friction + multiplier(violation + mobility * friction, mobility, compliance);
        for (corner, gradient) in gradients.into_iter().enumerate() {
            let by = gradient * (self.inverse_masses[corner] * lambda);
            // SAFETY: the caller's.
            unsafe { points.shift(&self.particles[corner], by) };
        }
    }
}

impl BendBlock {
    /// ∇θ at the four corners, 1/m (Bridson et al. 2003, "Simulation of clothing with folds and
    /// wrinkles", §4, as derivatives).
    #[inline(always)]
    fn gradients(&self, hinge: &Hinge, x0: Lanes3, x2: Lanes3, x3: Lanes3) -> [Lanes3; 4] {
        let squared = |normal: Lanes3| normal.dot(normal).max(self.least_squared);
        let left = hinge.left * (hinge.length / squared(hinge.left));
        let right = hinge.right * (hinge.length / squared(hinge.right));
        // How far along the edge the third corners lie, as shares of it.
        let per_square = Lanes::splat(1.0) / (hinge.length * hinge.length);
        let along = |from: Lanes3, to: Lanes3| (to - from).dot(hinge.edge) * per_square;
        let (s, t) = (along(x0, x2), along(x0, x3));
        let one = Lanes::splat(1.0);
        [
            left * (one - s) + right * (one - t),
            left * s + right * t,
            left * -one,
            right * -one,
        ]
    }
}

/// The same angle in −π..=π.
#[inline(always)]
fn wrapped(angle: Lanes) -> Lanes {
    let (turn, half) = (Lanes::splat(TAU), Lanes::splat(PI));
    let angle = half.choose_less(angle, angle - turn, angle);
    angle.choose_less(-half, angle + turn, angle)
}

#[cfg(test)]
mod tests;
