//! Garments from parameters, for any character whose joints are in SMPL's order.
//!
//! A garment follows the shape of the body. [`BodyShape`] slices the body into [`Ring`]s: convex
//! outlines, as a measuring tape would show them. A garment offsets them by an ease and covers them
//! with grids of cloth, joined by [`Sewing`]. The result is a [`GarmentMesh`]: a rest shape in the
//! character's bind-pose space with pattern coordinates in metres, named parts and attachments.
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

pub use crate::side::Side;
pub use body_shape::{ArmPoint, BodyShape, Measurements};
pub use flared_skirt::FlaredSkirt;
pub use mesh::{Attachment, Fabric, GarmentMesh, Part};
pub use pleated_dress::PleatedDress;
pub use ring::Ring;
pub use robe::Robe;
pub use sewing::{Grid, GridShape, PatternVertex, Sewing, Wrap};
pub use tshirt::TShirt;
pub use tulle_skirt::TulleSkirt;

use thiserror::Error;

/// Reason why a garment cannot be made.
#[derive(Debug, Error, PartialEq)]
pub enum GarmentError {
    /// The character's joints are not SMPL's 24.
    #[error("garment: expected a character with the 24 joints of SMPL, found {found} joints")]
    Joints {
        /// Number of joints found.
        found: usize,
    },
    /// The number of rows of skinning weights is not the number of body vertices.
    #[error("garment: expected skinning weights for {expected} body vertices, found {found}")]
    Weights {
        /// Number of body vertices.
        expected: usize,
        /// Number of rows found.
        found: usize,
    },
    /// The body has no surface where a section is needed.
    #[error("garment: the body has no {what} at {at_m:.3} m")]
    NoSection {
        /// Name of the missing body part.
        what: &'static str,
        /// Height, or distance along the limb, metres.
        at_m: f32,
    },
    /// A parameter is outside its range.
    #[error("garment: {name} is {found}, expected {expected}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Allowed range, in words.
        expected: &'static str,
        /// Value of the parameter.
        found: f32,
    },
    /// Two edges to be sewn have different numbers of vertices.
    #[error("garment: a seam joins {left} vertices to {right}")]
    Seam {
        /// Number of vertices of the first edge.
        left: usize,
        /// Number of vertices of the second edge.
        right: usize,
    },
    /// The finished mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] unic_core::mesh::MeshError),
}

/// Returns an error for a parameter outside `range`, NaN included.
pub(crate) fn check_range(
    name: &'static str,
    found: f32,
    range: std::ops::RangeInclusive<f32>,
    expected: &'static str,
) -> Result<(), GarmentError> {
    // No range contains NaN.
    if range.contains(&found) {
        return Ok(());
    }
    Err(GarmentError::Parameter {
        name,
        expected,
        found,
    })
}
