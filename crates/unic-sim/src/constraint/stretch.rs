//! Stretch constraints: the in-plane strains of a triangle.

use super::{ConstraintBlock, SharedPositions, multiplier, pack_corners, pack_lanes};
use crate::simd::{F32x8, LANES};
use glam::{Mat2, Vec2, Vec3};

/// Smallest height of a rest triangle, relative to its longest edge. The strains of thinner
/// triangles are rounding errors, so that their rest shape is widened to this height.
const LEAST_HEIGHT: f32 = 1e-3;

/// A quantity for each of the three strains of a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InPlane<T> {
    /// Value for strain along the weft.
    pub(crate) weft: T,
    /// Value for strain along the warp.
    pub(crate) warp: T,
    /// Value for shear between the two.
    pub(crate) shear: T,
}

impl<T> InPlane<T> {
    fn map<U>(self, mut f: impl FnMut(T) -> U) -> InPlane<U> {
        InPlane {
            weft: f(self.weft),
            warp: f(self.warp),
            shear: f(self.shear),
        }
    }
}

/// The three strain constraints of an orthotropic triangle.
///
/// Let F = [F_weft F_warp] be the deformation gradient from the rest triangle's plane. The energy
/// per area is ½ k_weft E_weft² + ½ k_warp E_warp² + ½ k_shear γ², with the Green strains E_i = ½
/// (|F_i|² − 1) and γ = F_weft · F_warp. Compliances are 1/(k · area), so that the behaviour does
/// not depend on the mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StretchConstraint {
    pub(crate) particles: [u32; 3],
    /// Rows of the inverse rest shape, 1/m, for corners 1 and 2. With the current edges d₁ and d₂
    /// from corner 0, F_weft = d₁ · shape\[0\].x + d₂ · shape\[1\].x, and F_warp likewise with y.
    pub(crate) shape: [Vec2; 2],
    /// Rest area, m².
    pub(crate) area: f32,
    /// Compliances 1/(k · area), 1/(N·m).
    pub(crate) compliances: InPlane<f32>,
}

impl StretchConstraint {
    /// Makes the constraints of a triangle with these rest corners.
    ///
    /// `warp` is the direction of the warp in rest space, `stiffness` is in N/m. The triangle may
    /// be degenerate to a line, but not to a point.
    pub(crate) fn new(particles: [u32; 3], corners: [Vec3; 3], warp: Vec3, stiffness: InPlane<f32>) -> Self {
        let flat = Self::flatten(corners, warp);
        let area = 0.5 * flat.determinant().abs();
        // Columns are the edges; F = current edges · flat⁻¹.
        let inverse = flat.inverse();
        Self {
            particles,
            shape: [inverse.row(0), inverse.row(1)],
            area,
            compliances: stiffness.map(|k| (k * area).recip()),
        }
    }

    /// Returns the edges from corner 0 in the triangle's plane, as columns: x along the weft, y
    /// along the warp.
    fn flatten([a, b, c]: [Vec3; 3], warp: Vec3) -> Mat2 {
        let (ab, ac) = (b - a, c - a);
        // The frame is built on the longest edge, which is well defined even for a sliver. The
        // sliver's normal may be arbitrary.
        let longest = [ab, ac, c - b].into_iter().fold(Vec3::ZERO, |l, e| {
            if e.length_squared() > l.length_squared() {
                e
            } else {
                l
            }
        });
        let along = longest.normalize_or(Vec3::X);
        let normal = ab.cross(ac).normalize_or(along.any_orthonormal_vector());
        let across = normal.cross(along);
        let flat = |v: Vec3| Vec2::new(v.dot(along), v.dot(across));
        let mut edges = Mat2::from_cols(flat(ab), flat(ac));
        widen(&mut edges, LEAST_HEIGHT * longest.length_squared());
        let warp = flat(warp).normalize_or(Vec2::Y);
        let weft = Vec2::new(warp.y, -warp.x);
        Mat2::from_cols(weft, warp).transpose() * edges
    }
}

/// Widens a thin triangle until its doubled area is at least `least`, m². The columns are two of
/// its edges in a frame whose x axis is along the longest edge.
fn widen(edges: &mut Mat2, least: f32) {
    let doubled = edges.determinant();
    if doubled.abs() >= least || least == 0.0 {
        return;
    }
    let missing = if doubled < 0.0 { -least } else { least } - doubled;
    // det = b.x c.y − b.y c.x is linear in each y. The y that is changed is the one whose factor x
    // is larger, so that the change is as small as possible and never divides by zero.
    if edges.x_axis.x.abs() >= edges.y_axis.x.abs() {
        edges.y_axis.y += missing / edges.x_axis.x;
    } else {
        edges.x_axis.y -= missing / edges.y_axis.x;
    }
}

/// The stretch constraints of [`LANES`] triangles, solved together.
#[derive(Debug, Clone)]
pub(crate) struct StretchBlock {
    particles: [[u32; LANES]; 3],
    inverse_masses: [F32x8; 3],
    /// Weights of corners 1 and 2 in F_weft, 1/m.
    weft: [F32x8; 2],
    /// Weights of corners 1 and 2 in F_warp, 1/m.
    warp: [F32x8; 2],
    compliances: InPlane<F32x8>,
}

impl ConstraintBlock<3> for StretchBlock {
    type Constraint = StretchConstraint;

    fn particles(constraint: &StretchConstraint) -> [u32; 3] {
        constraint.particles
    }

    fn pack(constraints: &[StretchConstraint], inverse_masses: &[f32]) -> Self {
        let corners: Vec<[u32; 3]> = constraints.iter().map(|c| c.particles).collect();
        let corners = pack_corners(&corners, inverse_masses);
        Self {
            particles: corners.particles,
            inverse_masses: corners.inverse_masses,
            weft: [0, 1].map(|corner| pack_lanes(constraints, |c| c.shape[corner].x)),
            warp: [0, 1].map(|corner| pack_lanes(constraints, |c| c.shape[corner].y)),
            compliances: InPlane {
                weft: pack_lanes(constraints, |c| c.compliances.weft),
                warp: pack_lanes(constraints, |c| c.compliances.warp),
                shear: pack_lanes(constraints, |c| c.compliances.shear),
            },
        }
    }

    /// Projects weft, warp and shear one after the other, each from where the last one ended.
    ///
    /// All three displace corner i by w_i (p_i A + q_i B), where p_i and q_i are its weights in
    /// F_weft and F_warp. F therefore follows from the vectors A and B, and positions are written
    /// once.
    #[inline(always)]
    unsafe fn solve(&self, positions: &SharedPositions<'_>, seconds: f32) {
        // SAFETY: guaranteed by the caller.
        let [x0, x1, x2] = self.particles.each_ref().map(|p| unsafe { positions.gather(p) });
        let half = F32x8::splat(0.5);
        let (one, zero) = (F32x8::splat(1.0), F32x8::ZERO);
        let per_square_second = F32x8::splat((seconds * seconds).recip());
        let (d1, d2) = (x1 - x0, x2 - x0);
        let mut f_weft = d1 * self.weft[0] + d2 * self.weft[1];
        let mut f_warp = d1 * self.warp[0] + d2 * self.warp[1];

        let [w0, w1, w2] = self.inverse_masses;
        let (p0, p1, p2) = (zero - self.weft[0] - self.weft[1], self.weft[0], self.weft[1]);
        let (q0, q1, q2) = (zero - self.warp[0] - self.warp[1], self.warp[0], self.warp[1]);
        // Adding λ w_i p_i d to every corner changes F_weft by pp · λ d and F_warp by pq · λ d.
        let pp = w0 * p0 * p0 + w1 * p1 * p1 + w2 * p2 * p2;
        let qq = w0 * q0 * q0 + w1 * q1 * q1 + w2 * q2 * q2;
        let pq = w0 * p0 * q0 + w1 * p1 * q1 + w2 * p2 * q2;

        // Weft: C = ½ (|F_weft|² − 1), ∇_i C = p_i F_weft.
        let squared = f_weft.dot(f_weft);
        let compliance = self.compliances.weft * per_square_second;
        let lambda = multiplier(half * (squared - one), squared * pp, compliance);
        let mut a = f_weft * lambda;
        f_warp = f_warp + a * pq;
        f_weft = f_weft + a * pp;

        // Warp, likewise.
        let squared = f_warp.dot(f_warp);
        let compliance = self.compliances.warp * per_square_second;
        let lambda = multiplier(half * (squared - one), squared * qq, compliance);
        let mut b = f_warp * lambda;
        f_weft = f_weft + b * pq;
        f_warp = f_warp + b * qq;

        // Shear: C = F_weft · F_warp, ∇_i C = p_i F_warp + q_i F_weft.
        let shear = f_weft.dot(f_warp);
        let mobility = pp * f_warp.dot(f_warp) + (pq + pq) * shear + qq * f_weft.dot(f_weft);
        let compliance = self.compliances.shear * per_square_second;
        let lambda = multiplier(shear, mobility, compliance);
        a = a + f_warp * lambda;
        b = b + f_weft * lambda;

        // SAFETY: guaranteed by the caller.
        unsafe {
            positions.shift(&self.particles[0], (a * p0 + b * q0) * w0);
            positions.shift(&self.particles[1], (a * p1 + b * q1) * w1);
            positions.shift(&self.particles[2], (a * p2 + b * q2) * w2);
        }
    }
}

#[cfg(test)]
mod tests;
