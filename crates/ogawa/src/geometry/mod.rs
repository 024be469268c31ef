//! Meshes and transforms of an archive.

mod attribute;
mod faces;
mod mesh;
mod transform;
mod write;

pub use attribute::{Attribute, Scope};
pub use faces::Faces;
pub use mesh::{Mesh, MeshKind};
pub use transform::Transform;
pub use write::{ArchiveWriter, FrameTiming, MeshDescription, MeshId};

/// Schema of objects with polygons.
pub(crate) const POLY_MESH: &str = "AbcGeom_PolyMesh";
/// Schema of objects with subdivision surfaces.
pub(crate) const SUBDIVISION: &str = "AbcGeom_SubD";
/// Schema of objects that move their children.
pub(crate) const XFORM: &str = "AbcGeom_Xform";
/// Name of the compound of a mesh.
pub(crate) const GEOMETRY: &str = ".geom";
