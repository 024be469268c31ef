//! Eight numbers at a time, in plain loops that the compiler turns into vector instructions.
//!
//! No fused multiply-add: every instruction set then gives the same bits.

use glam::Vec3;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Constraints that a kernel solves together.
pub(crate) const WIDTH: usize = 8;

/// A number for each of [`WIDTH`] constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lanes(pub(crate) [f32; WIDTH]);

macro_rules! lane_by_lane {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for lane in 0..WIDTH {
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

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in 0..WIDTH {
            self.0[lane] = -self.0[lane];
        }
        self
    }
}

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    pub(crate) fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    pub(crate) fn max(mut self, other: Self) -> Self {
        for lane in 0..WIDTH {
            let (a, b) = (self.0[lane], other.0[lane]);
            self.0[lane] = if a > b { a } else { b };
        }
        self
    }

    #[inline(always)]
    pub(crate) fn min(mut self, other: Self) -> Self {
        for lane in 0..WIDTH {
            let (a, b) = (self.0[lane], other.0[lane]);
            self.0[lane] = if a < b { a } else { b };
        }
        self
    }

    #[inline(always)]
    pub(crate) fn sqrt(mut self) -> Self {
        for lane in 0..WIDTH {
            self.0[lane] = self.0[lane].sqrt();
        }
        self
    }

    #[inline(always)]
    pub(crate) fn abs(mut self) -> Self {
        for lane in 0..WIDTH {
            self.0[lane] = self.0[lane].abs();
        }
        self
    }

    /// A bit for each lane that is zero or less, the first lane lowest; none for NaN.
    #[inline(always)]
    pub(crate) fn not_above_zero(self) -> u32 {
        let mut bits = 0;
        for lane in 0..WIDTH {
            bits |= u32::from(self.0[lane] <= 0.0) << lane;
        }
        bits
    }

    /// `if_less` where self < bound, else `otherwise`.
    #[inline(always)]
    pub(crate) fn choose_less(self, bound: Self, if_less: Self, mut otherwise: Self) -> Self {
        for lane in 0..WIDTH {
            if self.0[lane] < bound.0[lane] {
                otherwise.0[lane] = if_less.0[lane];
            }
        }
        otherwise
    }

    /// Angle of the point (x, y), radians in −π..=π, within 1e-5: the polynomial 4.4.49 of
    /// Abramowitz & Stegun for the first octant. Zero at the origin.
    #[inline(always)]
    pub(crate) fn atan2(y: Self, x: Self) -> Self {
        let (ax, ay) = (x.abs(), y.abs());
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

/// A vector for each of [`WIDTH`] constraints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3 {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) z: Lanes,
}

impl Lanes3 {
    /// What `point` gives for each lane's index.
    #[inline(always)]
    pub(crate) fn gather(indices: &[u32; WIDTH], point: impl Fn(u32) -> Vec3) -> Self {
        let mut all = Self {
            x: Lanes::ZERO,
            y: Lanes::ZERO,
            z: Lanes::ZERO,
        };
        for (lane, &index) in indices.iter().enumerate() {
            let p = point(index);
            all.x.0[lane] = p.x;
            all.y.0[lane] = p.y;
            all.z.0[lane] = p.z;
        }
        all
    }

    /// Neighbours from `first` on, from one list an axis; each must hold [`WIDTH`] of them.
    #[inline(always)]
    pub(crate) fn load(axes: &[Vec<f32>; 3], first: usize) -> Self {
        let of = |axis: &Vec<f32>| {
            let mut lanes = Lanes::ZERO;
            lanes.0.copy_from_slice(&axis[first..first + WIDTH]);
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
            x: Lanes::splat(v.x),
            y: Lanes::splat(v.y),
            z: Lanes::splat(v.z),
        }
    }

    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x.0[lane], self.y.0[lane], self.z.0[lane])
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes {
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

impl Add for Lanes3 {
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

impl Sub for Lanes3 {
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

impl Mul<Lanes> for Lanes3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: Lanes) -> Self {
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
    fn the_arc_tangent_is_within_its_bound_all_around() {
        for i in 0..1000 {
            let angle = (i as f32 + 0.5) / 1000.0 * std::f32::consts::TAU - std::f32::consts::PI;
            let (y, x) = (Lanes::splat(3.0 * angle.sin()), Lanes::splat(3.0 * angle.cos()));
            assert!((Lanes::atan2(y, x).0[3] - angle).abs() < 1.2e-5);
        }
        assert_eq!(Lanes::atan2(Lanes::ZERO, Lanes::ZERO), Lanes::ZERO);
    }
}
