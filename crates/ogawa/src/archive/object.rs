//! Objects of an archive.

use super::{metadata::Metadata, property::Property};
use std::ops::Range;

/// Index of an object in its archive. The top object is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub(crate) usize);

impl ObjectId {
    /// The top object, which has no name.
    pub const TOP: Self = Self(0);
}

/// Node of the tree: a transform, a mesh, or anything else that the schema in its metadata names.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name, unique among its siblings in valid files; empty for the top object.
    pub name: Box<str>,
    /// Metadata, with the schema of the object under the key `schema`.
    pub metadata: Metadata,
    /// Properties of the object.
    pub properties: Box<[Property]>,
    pub(crate) parent: Option<ObjectId>,
    pub(crate) children: Range<usize>,
    /// Number of ancestors.
    pub(crate) depth: u16,
}

impl Object {
    /// Parent, which only the top object lacks.
    pub fn parent(&self) -> Option<ObjectId> {
        self.parent
    }

    /// Children, in the order of the file.
    pub fn children(&self) -> impl Iterator<Item = ObjectId> + use<> {
        self.children.clone().map(ObjectId)
    }

    /// Schema without its version, such as `AbcGeom_PolyMesh`; empty for an object without one.
    pub fn schema(&self) -> &str {
        let schema = self.metadata.get("schema").unwrap_or_default();
        schema.rsplit_once("_v").map_or(schema, |(name, _)| name)
    }

    /// Property of this name, if there is one.
    pub fn property(&self, name: &str) -> Option<&Property> {
        find(&self.properties, name)
    }
}

/// Property of this name, if there is one.
pub(crate) fn find<'a>(properties: &'a [Property], name: &str) -> Option<&'a Property> {
    properties.iter().find(|property| &*property.name == name)
}
