//! Bringing points back onto a surface and the cuts through it.

use super::Field;
use glam::Vec3;

/// Step of the central differences, metres: small against any feature, large against rounding.
const DIFFERENCE_M: f32 = 5e-4;

/// A last step of this length leaves less than its square: Newton's method has converged.
const SETTLED_M: f32 = 1e-4;

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

    /// The point near `p` on the surface and on the cuts of `bits`: Newton's method with the step of
    /// least length. With two cuts or more the point is a corner and stays.
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

    /// As [`Surfaces::projected`] for the curve of one cut, whatever other bits the vertex has.
    pub(crate) fn onto_cut(&self, mut p: Vec3, cut: usize) -> Vec3 {
        for _ in 0..6 {
            p -= newton_2(self.surface, self.cuts[cut], p);
        }
        p
    }
}

fn gradient(field: &Field, p: Vec3) -> Vec3 {
    let along = |axis: Vec3| field(p + axis * DIFFERENCE_M) - field(p - axis * DIFFERENCE_M);
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)) / (2.0 * DIFFERENCE_M)
}

/// The step to the zero of the linearised field.
fn newton(field: &Field, p: Vec3) -> Vec3 {
    let g = gradient(field, p);
    limited(g * (field(p) / g.length_squared().max(0.05)))
}

/// The shortest step to the zeros of two linearised fields.
fn newton_2(one: &Field, two: &Field, p: Vec3) -> Vec3 {
    let (g, h) = (gradient(one, p), gradient(two, p));
    let (f, e) = (one(p), two(p));
    let (gg, gh, hh) = (g.dot(g), g.dot(h), h.dot(h));
    let det = gg * hh - gh * gh;
    // Where the surfaces touch rather than cross, each step alone.
    if det < 0.02 * gg * hh {
        return limited((g * (f / gg.max(0.05)) + h * (e / hh.max(0.05))) * 0.5);
    }
    limited(g * ((f * hh - e * gh) / det) + h * ((e * gg - f * gh) / det))
}

/// A step of at most 2 cm: the fields are only near to distances.
fn limited(step: Vec3) -> Vec3 {
    step.clamp_length_max(0.02)
}
