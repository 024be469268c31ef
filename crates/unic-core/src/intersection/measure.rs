//! How an intersection is measured.

use super::BodySnapshot;
use crate::surface::Surface;
use glam::Vec3;

/// How an intersection is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsideTest {
    /// Below the tangent plane at the nearest vertex: the paper's, for comparison with its tables.
    TangentPlane,
    /// On the inner side of the closest point of the surface: the true answer for a closed body.
    ClosestTriangle,
}

/// A posed body that both tests are asked of.
#[derive(Clone, Copy, Debug)]
pub struct PosedBody<'a> {
    /// For [`InsideTest::TangentPlane`].
    pub snapshot: &'a BodySnapshot,
    /// For [`InsideTest::ClosestTriangle`].
    pub surface: &'a Surface,
}

impl PosedBody<'_> {
    /// How deep inside the body `p` is, metres; zero when it is not.
    pub fn depth(&self, test: InsideTest, p: Vec3) -> f32 {
        let height = match test {
            InsideTest::TangentPlane => self.snapshot.tangent_plane(p).map(|t| t.height),
            InsideTest::ClosestTriangle => self.surface.closest(p).map(|hit| hit.signed_distance),
        };
        (-height.unwrap_or(0.0)).max(0.0)
    }
}
