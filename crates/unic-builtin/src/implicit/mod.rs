//! Regular triangle meshes of implicit surfaces.
//!
//! - [`polygonise`] turns the zero set of a field into triangles.
//! - [`Patch::cut`] cuts them along the zero sets of further fields: a plane of symmetry, a hem, a
//!   seam.
//! - [`remesh`] makes the triangles near-uniform while every vertex stays on the surface and every
//!   cut stays in place.
//! - [`mirrored`] joins a half that was cut at x = 0 with its mirror image.

mod mirror;
mod patch;
mod polygonise;
mod project;
mod remesh;

pub(crate) use mirror::{Mirrored, mirrored};
pub(crate) use patch::{Patch, PositiveSide};
pub(crate) use polygonise::{Lattice, polygonise};
pub(crate) use project::Surfaces;
pub(crate) use remesh::{Sizing, remesh};

use glam::Vec3;

/// Scalar field in metres, negative inside. Near its zero set its gradient should be about one.
pub(crate) type Field<'a> = dyn Fn(Vec3) -> f32 + Sync + 'a;

/// Smooth minimum (the quadratic one of Quilez, "smooth minimum").
///
/// It is below the minimum only where both values are within `reach` of each other, by at most a
/// quarter of it.
pub(crate) fn smooth_min(a: f32, b: f32, reach: f32) -> f32 {
    let overlap = (reach - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * reach)
}
