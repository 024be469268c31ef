//! Projection of points onto a surface and onto the cuts through it.

use super::Field;
use glam::Vec3;

/// Step of the central differences, metres: small against any feature, large against rounding.
const DIFFERENCE_M: f32 = 5e-4;

/// Length of a step below which Newton's method has converged, metres.
///
/// Convergence is quadratic: the remaining error is about the square of the last step.
const SETTLED_M: f32 = 1e-4;

/// Longest step of the projection, metres: fields are distances only near their zero set.
const LONGEST_STEP_M: f32 = 0.02;

/// A surface, and further surfaces that cut curves out of it.
pub(crate) struct Surfaces<'a> {
    /// The surface that all vertices lie on.
    pub(crate) surface: &'a Field<'a>,
    /// Surfaces of the cuts, by the bit that a vertex on them carries.
    pub(crate) cuts: Vec<&'a Field<'a>>,
}

impl Surfaces<'_> {
    /// Unit normal of the surface, outward; zero where the field is flat.
    pub(crate) fn normal(&self, p: Vec3) -> Vec3 {
        gradient(self.surface, p).normalize_or_zero()
    }

    /// Projects a point onto the surface and the cut of `bits` by Newton's method with shortest
    /// steps.
    ///
    /// A point on two cuts or more is a corner and is returned unchanged.
    pub(crate) fn projected(&self, mut p: Vec3, bits: u8) -> Vec3 {
        let cuts = bits.count_ones();
        if cuts > 1 {
            return p;
        }
        for _ in 0..4 {
            let step = if cuts == 0 {
                newton(self.surface, p)
            } else {
                newton_2(self.surface, self.cuts[bits.trailing_zeros() as usize], p)
            };
            p -= step;
            if step.length_squared() < SETTLED_M * SETTLED_M {
                break;
            }
        }
        p
    }

    /// Projects a point onto the curve where one cut crosses the surface, by Newton's method with
    /// shortest steps.
    pub(crate) fn onto_cut(&self, mut p: Vec3, cut: usize) -> Vec3 {
        for _ in 0..6 {
            p -= newton_2(self.surface, self.cuts[cut], p);
        }
        p
    }
}

/// Gradient by central differences.
fn gradient(field: &Field, p: Vec3) -> Vec3 {
    let along = |axis: Vec3| field(p + axis * DIFFERENCE_M) - field(p - axis * DIFFERENCE_M);
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)) / (2.0 * DIFFERENCE_M)
}

/// The step to the zero of the linearised field.
fn newton(field: &Field, p: Vec3) -> Vec3 {
    let g = gradient(field, p);
    // The lower bound keeps the step finite where the gradient vanishes, on a ridge of the field.
    limited(g * (field(p) / g.length_squared().max(0.05)))
}

/// The shortest step to the zeros of two linearised fields.
fn newton_2(one: &Field, two: &Field, p: Vec3) -> Vec3 {
    let (g, h) = (gradient(one, p), gradient(two, p));
    let (f, e) = (one(p), two(p));
    let (gg, gh, hh) = (g.dot(g), g.dot(h), h.dot(h));
    // Gram determinant: gg · hh · sin² of the angle between the gradients.
    let det = gg * hh - gh * gh;
    // Where the surfaces touch rather than cross, the system is nearly singular: the mean of the
    // two separate steps replaces its solution.
    if det < 0.02 * gg * hh {
        return limited((g * (f / gg.max(0.05)) + h * (e / hh.max(0.05))) * 0.5);
    }
    limited(g * ((f * hh - e * gh) / det) + h * ((e * gg - f * gh) / det))
}

/// Shortens a step to [`LONGEST_STEP_M`].
fn limited(step: Vec3) -> Vec3 {
    step.clamp_length_max(LONGEST_STEP_M)
}
