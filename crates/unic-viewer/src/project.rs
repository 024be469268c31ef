//! From world-space faces to screen triangles: clipping and projection.

use glam::Vec3;

use crate::camera::View;
use crate::raster::{ScreenPoint, ScreenTriangle};
use crate::surface::Surface;

/// Faces are cut at this many half pictures from the centre, so that coordinates stay in the
/// range of the fixed-point rasteriser; what lies between is left to scan conversion.
const GUARD_BAND: f32 = 8.0;

/// A visible piece of a face.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) surface: u32,
    pub(crate) face: u32,
    /// Corners of the piece as weights of the corners of the face.
    corners: [Vec3; 3],
}

impl Piece {
    /// Weights of the face's corners from weights of the piece's corners.
    pub(crate) fn face_weights(&self, weights: [f32; 3]) -> Vec3 {
        let [a, b, c] = self.corners;
        a * weights[0] + b * weights[1] + c * weights[2]
    }
}

/// Screen triangles and what each shows; same length, same order.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    pub(crate) triangles: Vec<ScreenTriangle>,
    pub(crate) pieces: Vec<Piece>,
}

impl Pieces {
    /// Projects all faces of surfaces that have been checked.
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
                pieces.add(view, [index, face], corners);
            }
        }
        pieces
    }

    fn add(&mut self, view: &View, [surface, face]: [u32; 2], corners: [Vec3; 3]) {
        if corners.iter().any(|corner| !corner.is_finite()) || is_outside(corners) {
            return;
        }
        let whole = [
            Corner {
                clip: corners[0],
                weights: Vec3::X,
            },
            Corner {
                clip: corners[1],
                weights: Vec3::Y,
            },
            Corner {
                clip: corners[2],
                weights: Vec3::Z,
            },
        ];
        if whole
            .iter()
            .all(|corner| PLANES.iter().all(|plane| plane(corner.clip) >= 0.0))
        {
            return self.push(view, [surface, face], whole);
        }
        let polygon = PLANES
            .iter()
            .fold(whole.to_vec(), |polygon, plane| cut(&polygon, *plane));
        for pair in polygon.get(1..).unwrap_or_default().windows(2) {
            self.push(view, [surface, face], [polygon[0], pair[0], pair[1]]);
        }
    }

    fn push(&mut self, view: &View, [surface, face]: [u32; 2], corners: [Corner; 3]) {
        let points = corners.map(|corner| ScreenPoint {
            pixel: view.pixel_from_clip(corner.clip),
            nearness: 1.0 / corner.clip.z,
        });
        if let Some(triangle) = ScreenTriangle::new(points) {
            self.triangles.push(triangle);
            let corners = corners.map(|corner| corner.weights);
            self.pieces.push(Piece {
                surface,
                face,
                corners,
            });
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Homogeneous (x, y, w), see [`View::clip_from_world`].
    clip: Vec3,
    weights: Vec3,
}

/// Signed distances, positive inside: near plane and guard band.
const PLANES: [fn(Vec3) -> f32; 5] = [
    |clip| clip.z - View::NEAR,
    |clip| GUARD_BAND * clip.z - clip.x,
    |clip| GUARD_BAND * clip.z + clip.x,
    |clip| GUARD_BAND * clip.z - clip.y,
    |clip| GUARD_BAND * clip.z + clip.y,
];

/// Whether all corners are beyond the same side of the picture.
fn is_outside(corners: [Vec3; 3]) -> bool {
    let all = |test: fn(&Vec3) -> bool| corners.iter().all(test);
    all(|p| p.z < View::NEAR)
        || all(|p| p.x > p.z)
        || all(|p| -p.x > p.z)
        || all(|p| p.y > p.z)
        || all(|p| -p.y > p.z)
}

/// The part of a convex polygon on the positive side of a plane (Sutherland and Hodgman 1974).
fn cut(polygon: &[Corner], plane: fn(Vec3) -> f32) -> Vec<Corner> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let (d_from, d_to) = (plane(from.clip), plane(to.clip));
        if d_from >= 0.0 {
            kept.push(from);
        }
        if (d_from >= 0.0) != (d_to >= 0.0) {
            let t = d_from / (d_from - d_to);
            kept.push(Corner {
                clip: from.clip.lerp(to.clip, t),
                weights: from.weights.lerp(to.weights, t),
            });
        }
    }
    kept
}
