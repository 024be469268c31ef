//! Resistance of a triangle to stretching and shearing in its plane.

use super::{Block, Points, corners_of, lanes_of, multiplier};
use crate::lanes::{Lanes, WIDTH};
use glam::{Mat2, Vec2, Vec3};

/// Height over longest edge that a rest triangle has at least: a thinner one has strains that are
/// rounding errors. Its rest shape is widened to this.
const LEAST_HEIGHT: f32 = 1e-3;

/// One triangle, orthotropic.
///
/// With the deformation gradient F = [F_weft F_warp] from the rest triangle's plane, the energy per
/// area is ½ k_weft E_weft² + ½ k_warp E_warp² + ½ k_shear γ², with the Green strains
/// E = ½ (|F_i|² − 1) and γ = F_weft · F_warp. Compliances are 1/(k · area), so that the behaviour
/// does not depend on the mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    pub(crate) particles: [u32; 3],
    /// F_weft and F_warp are the sums of corners 1 and 2 minus corner 0 times these.
    pub(crate) shape: [Vec2; 2],
    /// Rest area, m².
    pub(crate) area: f32,
    /// 1/(k · area) of weft, warp and shear, 1/(N·m).
    pub(crate) compliances: [f32; 3],
}

impl Stretch {
    /// From rest corners, the direction of the warp in space and stiffnesses of weft, warp and
    /// shear in N/m. The triangle may be degenerate, not a point.
    pub(crate) fn new(particles: [u32; 3], corners: [Vec3; 3], warp: Vec3, stiffness: [f32; 3]) -> Self {
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

    /// The edges from corner 0 in the plane: x across the warp, y along it.
    fn flatten([a, b, c]: [Vec3; 3], warp: Vec3) -> Mat2 {
        let (ab, ac) = (b - a, c - a);
        // The longest edge makes the frame, so that a sliver's plane is as good as any.
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

/// Moves the corner that lies between the ends of the longest edge (along x) off it until the
/// parallelogram's area is at least `least`.
fn widen(edges: &mut Mat2, least: f32) {
    let doubled = edges.determinant();
    if doubled.abs() >= least || least == 0.0 {
        return;
    }
    let missing = if doubled < 0.0 { -least } else { least } - doubled;
    // det = b.x c.y − b.y c.x: the column with the larger x carries the other's y.
    if edges.x_axis.x.abs() >= edges.y_axis.x.abs() {
        edges.y_axis.y += missing / edges.x_axis.x;
    } else {
        edges.x_axis.y -= missing / edges.y_axis.x;
    }
}

/// [`WIDTH`] triangles.
#[derive(Debug, Clone)]
pub(crate) struct StretchBlock {
    particles: [[u32; WIDTH]; 3],
    inverse_masses: [Lanes; 3],
    /// Of corners 1 and 2: weights in F_weft and F_warp.
    weft: [Lanes; 2],
    warp: [Lanes; 2],
    compliances: [Lanes; 3],
}

impl Block<3> for StretchBlock {
    type One = Stretch;

    fn particles(one: &Stretch) -> [u32; 3] {
        one.particles
    }

    fn pack(constraints: &[Stretch], inverse_masses: &[f32]) -> Self {
        let corners: Vec<[u32; 3]> = constraints.iter().map(|c| c.particles).collect();
        let (particles, inverse_masses) = corners_of(&corners, inverse_masses);
        Self {
            particles,
            inverse_masses,
            weft: [0, 1].map(|corner| lanes_of(constraints, |c| c.shape[corner].x)),
            warp: [0, 1].map(|corner| lanes_of(constraints, |c| c.shape[corner].y)),
            compliances: [0, 1, 2].map(|kind| lanes_of(constraints, |c| c.compliances[kind])),
        }
    }

    /// Weft, warp and shear one after the other, each seeing what the one before did. All three
    /// move a corner by w_i (weft_i A + warp_i B), so that F can follow without the positions.
    #[inline(always)]
    unsafe fn solve(&self, points: &Points<'_>, seconds: f32) {
        // SAFETY: the caller's.
        let [x0, x1, x2] = self.particles.each_ref().map(|p| unsafe { points.gather(p) });
        let half = Lanes::splat(0.5);
        let (one, zero) = (Lanes::splat(1.0), Lanes::ZERO);
        let per_square_second = Lanes::splat((seconds * seconds).recip());
        let (d1, d2) = (x1 - x0, x2 - x0);
        let mut f_weft = d1 * self.weft[0] + d2 * self.weft[1];
        let mut f_warp = d1 * self.warp[0] + d2 * self.warp[1];

        let [w0, w1, w2] = self.inverse_masses;
        let (p0, p1, p2) = (zero - self.weft[0] - self.weft[1], self.weft[0], self.weft[1]);
        let (q0, q1, q2) = (zero - self.warp[0] - self.warp[1], self.warp[0], self.warp[1]);
        let pp = w0 * p0 * p0 + w1 * p1 * p1 + w2 * p2 * p2;
        let qq = w0 * q0 * q0 + w1 * q1 * q1 + w2 * q2 * q2;
        let pq = w0 * p0 * q0 + w1 * p1 * q1 + w2 * p2 * q2;

        let squared = f_weft.dot(f_weft);
        let compliance = self.compliances[0] * per_square_second;
        let lambda = multiplier(half * (squared - one), squared * pp, compliance);
        let mut a = f_weft * lambda;
        f_warp = f_warp + a * pq;
        f_weft = f_weft + a * pp;

        let squared = f_warp.dot(f_warp);
        let compliance = self.compliances[1] * per_square_second;
        let lambda = multiplier(half * (squared - one), squared * qq, compliance);
        let mut b = f_warp * lambda;
        f_weft = f_weft + b * pq;
        f_warp = f_warp + b * qq;

        let shear = f_weft.dot(f_warp);
        let mobility = pp * f_warp.dot(f_warp) + (pq + pq) * shear + qq * f_weft.dot(f_weft);
        let compliance = self.compliances[2] * per_square_second;
        let lambda = multiplier(shear, mobility, compliance);
        a = a + f_warp * lambda;
        b = b + f_weft * lambda;

        // SAFETY: the caller's.
        unsafe {
            points.shift(&self.particles[0], (a * p0 + b * q0) * w0);
            points.shift(&self.particles[1], (a * p1 + b * q1) * w1);
            points.shift(&self.particles[2], (a * p2 + b * q2) * w2);
        }
    }
}

#[cfg(test)]
mod tests;
