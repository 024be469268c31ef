//! From an implicit surface to a regular triangle mesh.
//!
//! [`polygonise`] turns the zero set of a field into triangles, [`Patch::cut`] cuts them along the
//! zero sets of further fields (a plane of symmetry, a hem, a seam), and [`remesh`] makes the triangles
//! near-uniform while every vertex stays on the surface and every cut stays where it is. [`mirrored`]
//! doubles a half that was cut at x = 0.

mod mirror;
mod patch;
mod polygonise;
mod project;
mod remesh;

pub(crate) use mirror::mirrored;
pub(crate) use patch::{Beyond, Patch};
pub(crate) use polygonise::{Lattice, polygonise};
pub(crate) use project::Surfaces;
pub(crate) use remesh::{Sizing, remesh};

use glam::Vec3;

/// A scalar field in metres, negative inside; near its zero set its gradient should be about one.
pub(crate) type Field<'a> = dyn Fn(Vec3) -> f32 + Sync + 'a;

/// Smooth minimum that differs from the minimum only where the two are within `reach` of each other,
/// by at most a quarter of it (Quilez, "smooth minimum", the quadratic one).
pub(crate) fn smooth_min(a: f32, b: f32, reach: f32) -> f32 {
    let overlap = (reach - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * reach)
}
