//! Implicit primitives of the anatomy, with exact or approximate signed distances.

use glam::{Vec2, Vec3};

/// Solid with a smooth surface.
#[derive(Clone, Debug)]
pub(super) enum Primitive {
    /// Convex hull of two spheres.
    Cone {
        /// Centres of the spheres, metres.
        ends: [Vec3; 2],
        /// Radii of the spheres, metres.
        radii: [f32; 2],
    },
    /// Axis-parallel ellipsoid, turned about the x axis.
    Ellipsoid {
        /// Centre, metres.
        centre: Vec3,
        /// Half axes, metres.
        half: Vec3,
        /// Turn about x, radians: positive tips +Y towards +Z.
        pitch: f32,
    },
    /// Superelliptic sections along an axis.
    Loft(Loft),
}

/// Sphere that contains a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundingSphere {
    /// Centre, metres.
    pub(super) centre: Vec3,
    /// Radius, metres.
    pub(super) radius: f32,
}

/// Superelliptic sections along a straight axis, blended smoothly, with round caps.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    /// Start of the axis, metres.
    pub(super) origin: Vec3,
    /// Unit direction of the axis.
    pub(super) axis: Vec3,
    /// Unit direction of the sections' width.
    pub(super) side: Vec3,
    /// Unit direction of the sections' front.
    pub(super) front: Vec3,
    /// Exponent of the superellipse: 2 is an ellipse, larger is squarer.
    pub(super) power: f32,
    /// Sections by ascending distance along the axis.
    pub(super) sections: Vec<LoftSection>,
}

/// One section of a loft, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoftSection {
    /// Distance along the axis.
    pub(super) along: f32,
    /// Half width.
    pub(super) side: f32,
    /// Depth to the front.
    pub(super) front: f32,
    /// Depth to the back.
    pub(super) back: f32,
}

impl Primitive {
    /// Exact or approximate signed distance, metres, negative inside.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        match self {
            Self::Cone { ends, radii } => cone(p, *ends, *radii),
            Self::Ellipsoid { centre, half, pitch } => {
                let (sin, cos) = pitch.sin_cos();
                let q = p - *centre;
                ellipsoid(
                    Vec3::new(q.x, cos * q.y + sin * q.z, cos * q.z - sin * q.y),
                    *half,
                )
            }
            Self::Loft(loft) => loft.distance(p),
        }
    }

    /// Sphere that contains the primitive.
    pub(super) fn bound(&self) -> BoundingSphere {
        match self {
            Self::Cone { ends, radii } => {
                let half = 0.5 * ends[0].distance(ends[1]);
                BoundingSphere {
                    centre: ends[0].midpoint(ends[1]),
                    radius: half + radii[0].max(radii[1]),
                }
            }
            Self::Ellipsoid { centre, half, .. } => BoundingSphere {
                centre: *centre,
                radius: half.max_element(),
            },
            Self::Loft(loft) => loft.bound(),
        }
    }
}

/// Exact distance from a cone: the least distance from any sphere between its ends.
///
/// For a point at the distance h along the axis and q off it, with radii that grow by s a metre,
/// the nearest sphere has its centre at h + q s / √(1 − s²).
fn cone(p: Vec3, ends: [Vec3; 2], radii: [f32; 2]) -> f32 {
    let axis = ends[1] - ends[0];
    let length = axis.length().max(1e-6);
    // At a slope of 1 one sphere contains the other, and the root below is zero.
    let slope = ((radii[1] - radii[0]) / length).clamp(-0.99, 0.99);
    let h = (p - ends[0]).dot(axis) / length;
    let q = (p - ends[0]).reject_from(axis).length();
    let t = ((h + q * slope / (1.0 - slope * slope).sqrt()) / length).clamp(0.0, 1.0);
    p.distance(ends[0] + axis * t) - (radii[0] + (radii[1] - radii[0]) * t)
}

/// First-order distance from an ellipsoid: the function |p / half| − 1 over its gradient's length.
fn ellipsoid(p: Vec3, half: Vec3) -> f32 {
    let scaled = p / half;
    let level = scaled.length();
    let slope = (scaled / half).length();
    // At the centre both level and slope vanish; the distance is the least half axis.
    if slope < 1e-6 {
        return -half.min_element();
    }
    level * (level - 1.0) / slope
}

/// Length of a loft's caps as a share of the sum of its last section's half width and depth.
const CAP: f32 = 0.3;

impl Loft {
    /// First-order distance from the superellipsoid whose equator is the section at the point.
    fn distance(&self, p: Vec3) -> f32 {
        let q = p - self.origin;
        let along = q.dot(self.axis);
        let section = self.section(along);
        let depth = q.dot(self.front);
        let radius = if depth > 0.0 { section.front } else { section.back };
        let cap = CAP * (section.side + section.front.min(section.back));
        let half = Vec3::new(section.side, radius, cap);
        // Along the axis the offset is zero between the end sections: only beyond them the caps
        // count.
        let place = Vec3::new(q.dot(self.side), depth, along - section.along).abs();
        let powers = (place / half).powf(self.power);
        let sum = powers.element_sum().max(1e-12);
        let level = sum.powf(1.0 / self.power);
        // Gradient of the level: its power 1 − n times (x/a)^(n−1) / a.
        let slope = (powers / place.max(Vec3::splat(1e-6))).length() * level / sum;
        let distance = (level - 1.0) / slope.max(1e-3);
        // Near the axis the slope vanishes and the quotient would be far too deep.
        distance.max(-half.min_element())
    }

    /// Section at a distance along the axis; beyond the ends, the first or last section.
    ///
    /// Sections are interpolated by a Catmull-Rom cubic for uneven distances.
    fn section(&self, along: f32) -> LoftSection {
        let last = self.sections.len() - 1;
        let along = along.clamp(self.sections[0].along, self.sections[last].along);
        let next = self.sections.partition_point(|s| s.along <= along).clamp(1, last);
        let index = [next.saturating_sub(2), next - 1, next, (next + 1).min(last)];
        let around = index.map(|i| self.sections[i]);
        let width = around[2].along - around[1].along;
        let t = (along - around[1].along) / width;
        let cubic = |of: fn(&LoftSection) -> f32| {
            let slope = |a: &LoftSection, b: &LoftSection| (of(b) - of(a)) / (b.along - a.along) * width;
            let (start, end) = (slope(&around[0], &around[2]), slope(&around[1], &around[3]));
            hermite([of(&around[1]), of(&around[2])], [start, end], t)
        };
        LoftSection {
            along,
            side: cubic(|s| s.side),
            front: cubic(|s| s.front),
            back: cubic(|s| s.back),
        }
    }

    fn bound(&self) -> BoundingSphere {
        let (first, last) = (self.sections[0], self.sections[self.sections.len() - 1]);
        let widest = |s: &LoftSection| Vec2::new(s.side, s.front.max(s.back)).length();
        // A cubic may overshoot its sections a little.
        let radius = 1.1 * self.sections.iter().map(widest).fold(0.0, f32::max);
        let middle = 0.5 * (first.along + last.along);
        let half = 0.5 * (last.along - first.along) + radius;
        BoundingSphere {
            centre: self.origin + self.axis * middle,
            radius: half.hypot(radius),
        }
    }
}

/// Cubic Hermite curve between two values with given slopes, for t from 0 to 1.
fn hermite(values: [f32; 2], slopes: [f32; 2], t: f32) -> f32 {
    let (t2, t3) = (t * t, t * t * t);
    values[0] * (2.0 * t3 - 3.0 * t2 + 1.0)
        + slopes[0] * (t3 - 2.0 * t2 + t)
        + values[1] * (3.0 * t2 - 2.0 * t3)
        + slopes[1] * (t3 - t2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_round_shapes_are_exact() {
        let ball = Primitive::Ellipsoid {
            centre: Vec3::Y,
            half: Vec3::splat(0.5),
            pitch: 0.4,
        };
        let capsule = Primitive::Cone {
            ends: [Vec3::ZERO, Vec3::Y],
            radii: [0.2; 2],
        };
        for p in [Vec3::new(0.3, 1.4, 0.9), Vec3::new(-0.2, 0.8, 0.1)] {
            assert!((ball.distance(p) - (p.distance(Vec3::Y) - 0.5)).abs() < 1e-5);
            let axis = Vec3::Y * p.y.min(1.0);
            assert!((capsule.distance(p) - (p.distance(axis) - 0.2)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_loft_of_equal_circles_is_a_cylinder() {
        let section = |along| LoftSection {
            along,
            side: 0.1,
            front: 0.1,
            back: 0.1,
        };
        let loft = Loft {
            origin: Vec3::ZERO,
            axis: Vec3::Y,
            side: Vec3::X,
            front: Vec3::Z,
            power: 2.0,
            sections: vec![section(0.0), section(0.3), section(1.0)],
        };
        assert!((loft.distance(Vec3::new(0.15, 0.5, 0.0)) - 0.05).abs() < 1e-5);
        assert!(loft.distance(Vec3::new(0.06, 0.1, 0.08)).abs() < 1e-5);
        let bound = loft.bound();
        assert!(bound.centre.distance(Vec3::new(0.1, -0.06, 0.0)) < bound.radius);
    }
}
