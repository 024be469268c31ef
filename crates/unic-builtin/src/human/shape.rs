//! Signed distances, or near to them, of the bodies that anatomy is put together from.

use glam::{Vec2, Vec3};

/// A body with a smooth surface.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// The hull of two spheres.
    Cone {
        /// Centres.
        ends: [Vec3; 2],
        /// Radii.
        radii: [f32; 2],
    },
    /// An axis-parallel ellipsoid, turned about the x axis.
    Ellipsoid {
        /// Centre.
        centre: Vec3,
        /// Half axes.
        half: Vec3,
        /// Turn about x, radians: positive tips +Y towards +Z.
        pitch: f32,
    },
    /// Superelliptic sections along an axis.
    Loft(Loft),
}

/// Sections along a straight axis, blended smoothly, with round caps.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    /// Where the axis starts.
    pub(super) origin: Vec3,
    /// Unit direction.
    pub(super) axis: Vec3,
    /// Unit direction of the sections' width.
    pub(super) side: Vec3,
    /// Unit direction of the sections' front.
    pub(super) front: Vec3,
    /// Exponent of the superellipse: 2 is an ellipse, more is squarer.
    pub(super) power: f32,
    /// Sections by ascending distance along the axis.
    pub(super) stations: Vec<Station>,
}

/// One section of a loft, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// Distance along the axis.
    pub(super) along: f32,
    /// Half width.
    pub(super) side: f32,
    /// Depth to the front.
    pub(super) front: f32,
    /// Depth to the back.
    pub(super) back: f32,
}

impl Shape {
    /// Near to the signed distance, metres, negative inside.
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

    /// A sphere around it: centre and radius.
    pub(super) fn bound(&self) -> (Vec3, f32) {
        match self {
            Self::Cone { ends, radii } => {
                let half = 0.5 * ends[0].distance(ends[1]);
                (ends[0].midpoint(ends[1]), half + radii[0].max(radii[1]))
            }
            Self::Ellipsoid { centre, half, .. } => (*centre, half.max_element()),
            Self::Loft(loft) => loft.bound(),
        }
    }
}

/// The least over the spheres between the ends of the distance to a sphere: on the axis at h, q off
/// it, with radii growing by s a metre, it is taken at h + q s / √(1 − s²).
fn cone(p: Vec3, ends: [Vec3; 2], radii: [f32; 2]) -> f32 {
    let axis = ends[1] - ends[0];
    let length = axis.length().max(1e-6);
    let slope = ((radii[1] - radii[0]) / length).clamp(-0.99, 0.99);
    let h = (p - ends[0]).dot(axis) / length;
    let q = (p - ends[0]).reject_from(axis).length();
    let t = ((h + q * slope / (1.0 - slope * slope).sqrt()) / length).clamp(0.0, 1.0);
    p.distance(ends[0] + axis * t) - (radii[0] + (radii[1] - radii[0]) * t)
}

/// First-order distance: the function |p / half| − 1 over its gradient's length.
fn ellipsoid(p: Vec3, half: Vec3) -> f32 {
    let scaled = p / half;
    let level = scaled.length();
    let slope = (scaled / half).length();
    if slope < 1e-6 {
        return -half.min_element();
    }
    level * (level - 1.0) / slope
}

/// Length of a loft's caps as a share of its last section's width and depth together.
const CAP: f32 = 0.3;

impl Loft {
    fn distance(&self, p: Vec3) -> f32 {
        let q = p - self.origin;
        let along = q.dot(self.axis);
        let station = self.station(along);
        let depth = q.dot(self.front);
        let radius = if depth > 0.0 { station.front } else { station.back };
        let cap = CAP * (station.side + station.front.min(station.back));
        let half = Vec3::new(station.side, radius, cap);
        let place = Vec3::new(q.dot(self.side), depth, along - station.along).abs();
        let powers = (place / half).powf(self.power);
        let sum = powers.element_sum().max(1e-12);
        let level = sum.powf(1.0 / self.power);
        // Gradient of the level: its power 1 − n times (x/a)^(n−1) / a.
        let slope = (powers / place.max(Vec3::splat(1e-6))).length() * level / sum;
        let distance = (level - 1.0) / slope.max(1e-3);
        distance.max(-half.min_element())
    }

    /// The section there, by a cubic between stations (Catmull & Rom's, for uneven distances); the
    /// nearest end's beyond them.
    fn station(&self, along: f32) -> Station {
        let last = self.stations.len() - 1;
        let along = along.clamp(self.stations[0].along, self.stations[last].along);
        let next = self.stations.partition_point(|s| s.along <= along).clamp(1, last);
        let index = [next.saturating_sub(2), next - 1, next, (next + 1).min(last)];
        let around = index.map(|i| self.stations[i]);
        let width = around[2].along - around[1].along;
        let t = (along - around[1].along) / width;
        let cubic = |of: fn(&Station) -> f32| {
            let slope = |a: &Station, b: &Station| (of(b) - of(a)) / (b.along - a.along) * width;
            let (start, end) = (slope(&around[0], &around[2]), slope(&around[1], &around[3]));
            hermite([of(&around[1]), of(&around[2])], [start, end], t)
        };
        Station {
            along,
            side: cubic(|s| s.side),
            front: cubic(|s| s.front),
            back: cubic(|s| s.back),
        }
    }

    fn bound(&self) -> (Vec3, f32) {
        let (first, last) = (self.stations[0], self.stations[self.stations.len() - 1]);
        let widest = |s: &Station| Vec2::new(s.side, s.front.max(s.back)).length();
        // A cubic may swing a little beyond its stations.
        let radius = 1.1 * self.stations.iter().map(widest).fold(0.0, f32::max);
        let middle = 0.5 * (first.along + last.along);
        let half = 0.5 * (last.along - first.along) + radius;
        (self.origin + self.axis * middle, half.hypot(radius))
    }
}

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
        let ball = Shape::Ellipsoid {
            centre: Vec3::Y,
            half: Vec3::splat(0.5),
            pitch: 0.4,
        };
        let capsule = Shape::Cone {
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
        let station = |along| Station {
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
            stations: vec![station(0.0), station(0.3), station(1.0)],
        };
        assert!((loft.distance(Vec3::new(0.15, 0.5, 0.0)) - 0.05).abs() < 1e-5);
        assert!(loft.distance(Vec3::new(0.06, 0.1, 0.08)).abs() < 1e-5);
        let (centre, radius) = loft.bound();
        assert!(centre.distance(Vec3::new(0.1, -0.06, 0.0)) < radius);
    }
}
