//! Meshing of garments with a wanted number of vertices.

use super::{GarmentError, GarmentMesh};

/// Largest number of corrections of the edge length; each removes most of the error.
const TRIES: usize = 8;

/// Allowed deviation as a share of the wanted number of vertices.
const TOLERANCE: f32 = 0.007;

/// Makes a garment of about `vertices` vertices.
///
/// `sewn` makes the garment with a given edge length in metres; `edge` is a first guess at it.
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
        // The number of vertices falls with the square of the edge length.
        edge *= ratio.sqrt();
        garment = sewn(edge)?;
    }
    Ok(garment)
}
