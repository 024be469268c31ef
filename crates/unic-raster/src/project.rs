//! Clipping and projection of world-space faces to screen triangles.

use glam::Vec3;

use crate::camera::View;
use crate::raster::{ScreenPoint, ScreenTriangle};
use crate::surface::Surface;

/// Half size of the clipping region, in half pictures from the centre.
///
/// Clipping keeps coordinates in the range of the fixed-point rasteriser. Scan conversion skips the
/// pixels between the border of the picture and this one.
const GUARD_BAND: f32 = 8.0;

/// A face of one of the surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceId {
    /// Index of the surface in the scene.
    pub(crate) surface: u32,
    /// Index of the face in the surface.
    pub(crate) face: u32,
}

/// A visible piece of a face.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) source: FaceId,
    /// Barycentric coordinates in the face of the corners of the piece.
    corners: [Vec3; 3],
}

impl Piece {
    /// Barycentric coordinates in the face for barycentric coordinates in the piece.
    pub(crate) fn face_weights(&self, weights: [f32; 3]) -> Vec3 {
        let [a, b, c] = self.corners;
        a * weights[0] + b * weights[1] + c * weights[2]
    }
}

/// Screen triangles with the pieces of faces that they show.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    pub(crate) triangles: Vec<ScreenTriangle>,
    /// Piece of each triangle, in the same order.
    pub(crate) pieces: Vec<Piece>,
}

impl Pieces {
    /// Projects all faces of surfaces that [`Surface::check`] has accepted.
    pub(crate) fn new(surfaces: &[Surface], view: &View) -> Self {
        let mut pieces = Self::default();
        for (index, surface) in (0..).zip(surfaces) {
            let clip: Vec<Vec3> = surface
                .vertices
                .iter()
                .map(|&vertex| view.clip_from_world(vertex))
                .collect();
            for (face, corners) in (0..).zip(surface.faces) {
                let corners = corners.map(|corner| clip[corner as usize]);
                let source = FaceId { surface: index, face };
                pieces.add(view, source, corners);
            }
        }
        pieces
    }

    /// Adds the visible pieces of a face with the given corners in clip coordinates.
    fn add(&mut self, view: &View, source: FaceId, corners: [Vec3; 3]) {
        if corners.iter().any(|corner| !corner.is_finite()) || is_outside(corners) {
            return;
        }
        let triangle = [
            ClipCorner {
                clip: corners[0],
                weights: Vec3::X,
            },
            ClipCorner {
                clip: corners[1],
                weights: Vec3::Y,
            },
            ClipCorner {
                clip: corners[2],
                weights: Vec3::Z,
            },
        ];
        // Nearly all faces need no clipping.
        if triangle
            .iter()
            .all(|corner| PLANES.iter().all(|plane| plane(corner.clip) >= 0.0))
        {
            return self.push(view, source, triangle);
        }
        let polygon = PLANES
            .iter()
            .fold(triangle.to_vec(), |polygon, plane| clipped(&polygon, *plane));
        // A convex polygon is a fan of triangles around its first corner.
        for pair in polygon.get(1..).unwrap_or_default().windows(2) {
            self.push(view, source, [polygon[0], pair[0], pair[1]]);
        }
    }

    fn push(&mut self, view: &View, source: FaceId, corners: [ClipCorner; 3]) {
        let points = corners.map(|corner| ScreenPoint {
            pixel: view.pixel_from_clip(corner.clip),
            nearness: 1.0 / corner.clip.z,
        });
        if let Some(triangle) = ScreenTriangle::new(points) {
            self.triangles.push(triangle);
            let corners = corners.map(|corner| corner.weights);
            self.pieces.push(Piece { source, corners });
        }
    }
}

/// Corner of a clipped polygon.
#[derive(Clone, Copy, Debug)]
struct ClipCorner {
    /// Homogeneous (x, y, w), see [`View::clip_from_world`].
    clip: Vec3,
    /// Barycentric coordinates in the face.
    weights: Vec3,
}

/// Clipping planes as signed distances, positive inside: the near plane and the guard band.
const PLANES: [fn(Vec3) -> f32; 5] = [
    |clip| clip.z - View::NEAR,
    |clip| GUARD_BAND * clip.z - clip.x,
    |clip| GUARD_BAND * clip.z + clip.x,
    |clip| GUARD_BAND * clip.z - clip.y,
    |clip| GUARD_BAND * clip.z + clip.y,
];

/// Returns true if all corners are outside the same side of the picture.
fn is_outside(corners: [Vec3; 3]) -> bool {
    // In homogeneous coordinates, without a division that would fail behind the eye.
    let all = |test: fn(&Vec3) -> bool| corners.iter().all(test);
    all(|p| p.z < View::NEAR)
        || all(|p| p.x > p.z)
        || all(|p| -p.x > p.z)
        || all(|p| p.y > p.z)
        || all(|p| -p.y > p.z)
}

/// Part of a convex polygon on the positive side of a plane (Sutherland and Hodgman 1974).
fn clipped(polygon: &[ClipCorner], plane: fn(Vec3) -> f32) -> Vec<ClipCorner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let (d_from, d_to) = (plane(from.clip), plane(to.clip));
        if d_from >= 0.0 {
            kept.push(from);
        }
        if (d_from >= 0.0) != (d_to >= 0.0) {
            // In homogeneous coordinates weights are linear along an edge, before the division by
            // w.
            let t = d_from / (d_from - d_to);
            kept.push(ClipCorner {
                clip: from.clip.lerp(to.clip, t),
                weights: from.weights.lerp(to.weights, t),
            });
        }
    }
    kept
}
