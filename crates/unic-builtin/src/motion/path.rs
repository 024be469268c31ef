//! Path of the character over the ground: the integral of its speed and turning rate.

use super::channel::{Channel, Gestures};
use glam::{DVec2, Vec3};

/// Position and heading on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GroundPose {
    /// World x and z, metres.
    pub(super) position: DVec2,
    /// Angle about +Y from +Z, radians, positive to the left.
    pub(super) heading: f64,
}

impl GroundPose {
    /// Unit vector along the heading (world x, z).
    pub(super) fn forward(&self) -> DVec2 {
        DVec2::new(self.heading.sin(), self.heading.cos())
    }

    /// Unit vector to the left of the heading (world x, z).
    pub(super) fn left(&self) -> DVec2 {
        DVec2::new(self.heading.cos(), -self.heading.sin())
    }

    /// Point that lies `left` metres to the left and `ahead` metres along the heading.
    pub(super) fn offset(&self, left: f64, ahead: f64) -> DVec2 {
        self.position + self.left() * left + self.forward() * ahead
    }
}

/// World position at `height` metres above the ground point (x, z).
pub(super) fn on_ground(point: DVec2, height: f64) -> Vec3 {
    Vec3::new(point.x as f32, height as f32, point.y as f32)
}

/// Path that starts at the origin with the heading +Z.
///
/// The channels [`Channel::Speed`], [`Channel::Strafe`] and [`Channel::TurnRate`] drive it.
#[derive(Clone, Debug)]
pub(super) struct GroundPath {
    /// Poses at multiples of 1 / [`GroundPath::RATE`] seconds.
    poses: Vec<GroundPose>,
}

impl GroundPath {
    /// Integration steps per second; Simpson's rule is exact to micrometres at this rate.
    const RATE: f64 = 120.0;

    pub(super) fn new(gestures: &Gestures, seconds: f64) -> Self {
        let mut here = GroundPose {
            position: DVec2::ZERO,
            heading: 0.0,
        };
        let mut poses = vec![here];
        for i in 0..(seconds * Self::RATE).ceil() as usize {
            let t = i as f64 / Self::RATE;
            here = advance(gestures, here, t, 1.0 / Self::RATE);
            poses.push(here);
        }
        Self { poses }
    }

    /// Pose at a time in seconds; before the start and after the end the character stands.
    pub(super) fn at(&self, gestures: &Gestures, t: f64) -> GroundPose {
        let last = self.poses.len() - 1;
        let x = (t * Self::RATE).clamp(0.0, last as f64);
        let node = x as usize;
        // One shorter step from the node: interpolating between nodes would break the second
        // derivative.
        let remainder = (x - node as f64) / Self::RATE;
        advance(gestures, self.poses[node], node as f64 / Self::RATE, remainder)
    }
}

/// Integrates the channels from time `t` over `h` seconds.
fn advance(gestures: &Gestures, from: GroundPose, t: f64, h: f64) -> GroundPose {
    let rate = |t| gestures.at(Channel::TurnRate, t);
    let [r0, r1, r2] = [rate(t), rate(t + 0.5 * h), rate(t + h)];
    // Half a step integrates the parabola through the three rates; the full step is Simpson's rule.
    let middle = from.heading + h * (5.0 * r0 + 8.0 * r1 - r2) / 24.0;
    let heading = from.heading + h * (r0 + 4.0 * r1 + r2) / 6.0;
    let [v0, v1, v2] = [
        velocity(gestures, from.heading, t),
        velocity(gestures, middle, t + 0.5 * h),
        velocity(gestures, heading, t + h),
    ];
    GroundPose {
        position: from.position + (v0 + v1 * 4.0 + v2) * (h / 6.0),
        heading,
    }
}

fn velocity(gestures: &Gestures, heading: f64, t: f64) -> DVec2 {
    let frame = GroundPose {
        position: DVec2::ZERO,
        heading,
    };
    frame.forward() * gestures.at(Channel::Speed, t) + frame.left() * gestures.at(Channel::Strafe, t)
}
