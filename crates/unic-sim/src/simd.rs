//! SIMD vectors of eight f32, written as plain loops that the compiler turns into vector
//! instructions.
//!
//! Nothing is fused: a fused multiply-add rounds once instead of twice, and its result would depend
//! on the instruction set. All sets give the same bits this way.

use glam::Vec3;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Number of lanes in a vector: an AVX2 register of f32, two SSE or NEON registers.
pub(crate) const LANES: usize = 8;

/// Eight f32 values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct F32x8(pub(crate) [f32; LANES]);

macro_rules! lane_by_lane {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for F32x8 {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for lane in 0..LANES {
                    self.0[lane] $op other.0[lane];
                }
                self
            }
        }
    };
}
lane_by_lane!(Add, add, +=);
lane_by_lane!(Sub, sub, -=);
lane_by_lane!(Mul, mul, *=);
lane_by_lane!(Div, div, /=);

impl AddAssign for F32x8 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in 0..LANES {
            self.0[lane] = -self.0[lane];
        }
        self
    }
}

impl F32x8 {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);

    #[inline(always)]
    pub(crate) fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    /// Returns the larger value of each lane; `other` where either is NaN.
    #[inline(always)]
    pub(crate) fn max(mut self, other: Self) -> Self {
        // A comparison instead of `f32::max`: it compiles to one `maxps`, which treats NaN the same
        // way. `f32::max` needs more instructions to return the operand that is not NaN.
        for lane in 0..LANES {
            let (a, b) = (self.0[lane], other.0[lane]);
            self.0[lane] = if a > b { a } else { b };
        }
        self
    }

    /// Returns the smaller value of each lane; `other` where either is NaN.
    #[inline(always)]
    pub(crate) fn min(mut self, other: Self) -> Self {
        for lane in 0..LANES {
            let (a, b) = (self.0[lane], other.0[lane]);
            self.0[lane] = if a < b { a } else { b };
        }
        self
    }

    #[inline(always)]
    pub(crate) fn sqrt(mut self) -> Self {
        for lane in 0..LANES {
            self.0[lane] = self.0[lane].sqrt();
        }
        self
    }

    #[inline(always)]
    pub(crate) fn abs(mut self) -> Self {
        for lane in 0..LANES {
            self.0[lane] = self.0[lane].abs();
        }
        self
    }

    /// Returns a bit mask of the lanes that are zero or less, the first lane in the lowest bit. NaN
    /// sets no bit.
    #[inline(always)]
    pub(crate) fn not_above_zero(self) -> u32 {
        let mut bits = 0;
        for lane in 0..LANES {
            bits |= u32::from(self.0[lane] <= 0.0) << lane;
        }
        bits
    }

    /// Selects `if_less` in lanes where self < `bound`, else `otherwise`.
    #[inline(always)]
    pub(crate) fn choose_less(self, bound: Self, if_less: Self, mut otherwise: Self) -> Self {
        for lane in 0..LANES {
            if self.0[lane] < bound.0[lane] {
                otherwise.0[lane] = if_less.0[lane];
            }
        }
        otherwise
    }

    /// Computes the angle of the point (x, y), radians in −π..=π, with an error below 1.2e-5. Zero
    /// at the origin.
    #[inline(always)]
    pub(crate) fn atan2(y: Self, x: Self) -> Self {
        // Polynomial 4.4.49 of Abramowitz & Stegun on the first octant, then reflections. The
        // library function has no vector form, and its bits depend on the platform.
        let (ax, ay) = (x.abs(), y.abs());
        // The limit makes the angle zero at the origin instead of NaN.
        let t = ax.min(ay) / ax.max(ay).max(Self::splat(f32::MIN_POSITIVE));
        let s = t * t;
        let mut p = Self::splat(0.020_835_1);
        for coefficient in [-0.085_133, 0.180_141, -0.330_299_5, 0.999_866] {
            p = p * s + Self::splat(coefficient);
        }
        let first = p * t;
        let quarter = ax.choose_less(ay, Self::splat(std::f32::consts::FRAC_PI_2) - first, first);
        let half = x.choose_less(Self::ZERO, Self::splat(std::f32::consts::PI) - quarter, quarter);
        y.choose_less(Self::ZERO, -half, half)
    }
}

/// Eight 3D vectors, one array per axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3x8 {
    pub(crate) x: F32x8,
    pub(crate) y: F32x8,
    pub(crate) z: F32x8,
}

impl Vec3x8 {
    /// Fills each lane with the vector that `point` returns for its index.
    #[inline(always)]
    pub(crate) fn gather(indices: &[u32; LANES], point: impl Fn(u32) -> Vec3) -> Self {
        let mut all = Self {
            x: F32x8::ZERO,
            y: F32x8::ZERO,
            z: F32x8::ZERO,
        };
        // Scalar loads, because positions are stored as an array of structures.
        for (lane, &index) in indices.iter().enumerate() {
            let p = point(index);
            all.x.0[lane] = p.x;
            all.y.0[lane] = p.y;
            all.z.0[lane] = p.z;
        }
        all
    }

    /// Loads [`LANES`] consecutive vectors that begin at index `first` of three arrays, one per
    /// axis.
    ///
    /// # Panics
    /// Panics when an array ends before `first + LANES`.
    #[inline(always)]
    pub(crate) fn load(axes: &[Vec<f32>; 3], first: usize) -> Self {
        let of = |axis: &Vec<f32>| {
            let mut lanes = F32x8::ZERO;
            lanes.0.copy_from_slice(&axis[first..first + LANES]);
            lanes
        };
        let [x, y, z] = axes;
        Self {
            x: of(x),
            y: of(y),
            z: of(z),
        }
    }

    #[inline(always)]
    pub(crate) fn splat(v: Vec3) -> Self {
        Self {
            x: F32x8::splat(v.x),
            y: F32x8::splat(v.y),
            z: F32x8::splat(v.z),
        }
    }

    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x.0[lane], self.y.0[lane], self.z.0[lane])
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F32x8 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

impl Add for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl Sub for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

impl Mul<F32x8> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: F32x8) -> Self {
        Self {
            x: self.x * scale,
            y: self.y * scale,
            z: self.z * scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_tangent_is_within_its_error_bound_in_all_octants() {
        for i in 0..1000 {
            let angle = (i as f32 + 0.5) / 1000.0 * std::f32::consts::TAU - std::f32::consts::PI;
            let (y, x) = (F32x8::splat(3.0 * angle.sin()), F32x8::splat(3.0 * angle.cos()));
            assert!((F32x8::atan2(y, x).0[3] - angle).abs() < 1.2e-5);
        }
        assert_eq!(F32x8::atan2(F32x8::ZERO, F32x8::ZERO), F32x8::ZERO);
    }
}
