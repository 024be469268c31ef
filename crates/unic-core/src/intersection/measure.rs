//! Measures of how deep a point is inside a body.

use super::BodySnapshot;
use crate::surface::Surface;
use glam::Vec3;

/// Test of whether a point is inside a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsideTest {
    /// Test by the tangent plane at the nearest vertex: the paper's, for comparison with its
    /// tables.
    TangentPlane,
    /// Test by the side of the closest point of the surface: exact for a closed body.
    ClosestTriangle,
}

/// Posed body with the data of both inside tests.
#[derive(Clone, Copy, Debug)]
pub struct InsideTestBody<'a> {
    /// Body for [`InsideTest::TangentPlane`].
    pub snapshot: &'a BodySnapshot,
    /// Body for [`InsideTest::ClosestTriangle`].
    pub surface: &'a Surface,
}

impl InsideTestBody<'_> {
    /// Depth of `p` inside the body, metres; zero outside.
    pub fn depth(&self, test: InsideTest, p: Vec3) -> f32 {
        let height = match test {
            InsideTest::TangentPlane => self.snapshot.tangent_plane(p).map(|t| t.height),
            InsideTest::ClosestTriangle => self.surface.closest(p).map(|hit| hit.signed_distance),
        };
        // Without a body, or for a point that is not finite, there is no height and no depth.
        (-height.unwrap_or(0.0)).max(0.0)
    }
}
