//! Values on the vertices, faces or corners of a mesh.

use crate::archive::Metadata;

/// Elements of a mesh that have a value each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// The whole mesh.
    Constant,
    /// Each face.
    Face,
    /// Each vertex.
    Vertex,
    /// Each corner of each face, in the order of [`Faces`](super::Faces).
    Corner,
}

impl Scope {
    /// Scope in the metadata of a property. Without one it is the whole mesh.
    pub(crate) fn decode(metadata: &Metadata) -> Option<Self> {
        match metadata.get("geoScope").unwrap_or("con") {
            "con" | "" => Some(Self::Constant),
            "uni" => Some(Self::Face),
            "var" | "vtx" => Some(Self::Vertex),
            "fvr" => Some(Self::Corner),
            _ => None,
        }
    }

    pub(crate) fn encode(self) -> &'static str {
        match self {
            Self::Constant => "con",
            Self::Face => "uni",
            Self::Vertex => "vtx",
            Self::Corner => "fvr",
        }
    }
}

/// Values of N floats, as texture coordinates (N = 2) or normals (N = 3).
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute<const N: usize> {
    /// Elements that have a value each.
    pub scope: Scope,
    /// Values.
    pub values: Vec<[f32; N]>,
    /// Index into `values` for each element; without indices, value i is that of element i.
    pub indices: Option<Vec<u32>>,
}

impl<const N: usize> Attribute<N> {
    /// Number of elements with a value.
    pub fn len(&self) -> usize {
        self.indices.as_ref().map_or(self.values.len(), Vec::len)
    }

    /// Whether no element has a value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Value of an element, if there is one.
    pub fn get(&self, element: usize) -> Option<[f32; N]> {
        let index = match &self.indices {
            Some(indices) => *indices.get(element)? as usize,
            None => element,
        };
        self.values.get(index).copied()
    }
}
