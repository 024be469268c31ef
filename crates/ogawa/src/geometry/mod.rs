//! Meshes and transforms of an archive.

mod attribute;
mod faces;
mod find_meshes;
mod mesh;
mod mesh_writer;
mod transform;
mod write;

pub use attribute::{Attribute, Scope};
pub use faces::Faces;
pub use mesh::{Mesh, MeshKind};
pub use mesh_writer::MeshDescription;
pub use transform::Transform;
pub use write::{ArchiveWriter, FrameTiming, MeshId};

/// Schema of objects with polygons.
pub(crate) const POLY_MESH: &str = "AbcGeom_PolyMesh";
/// Schema of objects with subdivision surfaces.
pub(crate) const SUBDIVISION: &str = "AbcGeom_SubD";
/// Schema of objects that move their children.
pub(crate) const XFORM: &str = "AbcGeom_Xform";
/// Name of the compound of a mesh.
pub(crate) const GEOMETRY: &str = ".geom";
/// Name of the compound of a transform.
pub(crate) const TRANSFORM: &str = ".xform";
