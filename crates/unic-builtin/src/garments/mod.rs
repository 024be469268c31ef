//! Garments from parameters, for any character whose joints are in SMPL's order.
//!
//! A garment is cut from the body's own shape: [`BodyShape`] slices the body into [`Ring`]s (convex
//! outlines, as a measuring tape lies), a maker offsets them by an ease and lays grids of cloth over
//! them with [`Sewing`], and the result is a [`GarmentMesh`]: a rest shape in the character's
//! bind-pose space with pattern coordinates in metres, named parts and named attachments.
//!
//! Left and right are the character's; left is +X in the bind pose.

mod body_shape;
mod flared_skirt;
mod flatten;
mod mesh;
mod pleated_dress;
mod ring;
mod robe;
mod sewing;
mod shoulder_surface;
mod trunk_surface;
mod tshirt;
mod tulle_skirt;
mod vertex_budget;

pub use body_shape::{BodyShape, Measurements, Side};
pub use flared_skirt::FlaredSkirt;
pub use mesh::{Attachment, Fabric, GarmentMesh, Part};
pub use pleated_dress::PleatedDress;
pub use ring::Ring;
pub use robe::Robe;
pub use sewing::{Grid, GridShape, Sewing, Wrap};
pub use tshirt::TShirt;
pub use tulle_skirt::TulleSkirt;

use thiserror::Error;

/// Why a garment cannot be made.
#[derive(Debug, Error, PartialEq)]
pub enum GarmentError {
    /// The character's joints are not SMPL's 24.
    #[error("garment: expected a character with the 24 joints of SMPL, found {found} joints")]
    Joints {
        /// Number of joints found.
        found: usize,
    },
    /// Skinning weights of another number of vertices than the body.
    #[error("garment: expected skinning weights for {expected} body vertices, found {found}")]
    Weights {
        /// Vertices of the body.
        expected: usize,
        /// Rows found.
        found: usize,
    },
    /// The body has no surface where a section is needed.
    #[error("garment: the body has no {what} at {at_m:.3} m")]
    NoSection {
        /// Which part of the body.
        what: &'static str,
        /// Height, or distance along the limb, metres.
        at_m: f32,
    },
    /// A parameter outside its range.
    #[error("garment: {name} is {found}, expected {expected}")]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its range, in words.
        expected: &'static str,
        /// Its value.
        found: f32,
    },
    /// Two edges to be sewn have different numbers of vertices.
    #[error("garment: a seam joins {left} vertices to {right}")]
    Seam {
        /// Vertices of the first edge.
        left: usize,
        /// Vertices of the second edge.
        right: usize,
    },
    /// The finished mesh is not sound.
    #[error(transparent)]
    Mesh(#[from] unic_core::mesh::MeshError),
}

/// Refuses a parameter outside `range`, NaN included.
pub(crate) fn check_range(
    name: &'static str,
    found: f32,
    range: std::ops::RangeInclusive<f32>,
    expected: &'static str,
) -> Result<(), GarmentError> {
    if range.contains(&found) {
        return Ok(());
    }
    Err(GarmentError::Parameter {
        name,
        expected,
        found,
    })
}
