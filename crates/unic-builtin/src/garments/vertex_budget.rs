//! Meshing with a wanted number of vertices.

use super::{GarmentError, GarmentMesh};

/// Tries at an edge length; each removes most of the error.
const TRIES: usize = 8;

/// Share of the wanted number by which the result may miss it.
const TOLERANCE: f32 = 0.007;

/// The garment that `sewn` makes of triangles with about the given edge length, metres, at the length
/// that gives about `vertices` of them; `edge` is a first guess.
pub(super) fn with_vertices(
    vertices: usize,
    mut edge: f32,
    sewn: impl Fn(f32) -> Result<GarmentMesh, GarmentError>,
) -> Result<GarmentMesh, GarmentError> {
    let mut garment = sewn(edge)?;
    for _ in 0..TRIES {
        let ratio = garment.mesh.vertices.len() as f32 / vertices as f32;
        if (ratio - 1.0).abs() < TOLERANCE {
            break;
        }
        edge *= ratio.sqrt();
        garment = sewn(edge)?;
    }
    Ok(garment)
}
