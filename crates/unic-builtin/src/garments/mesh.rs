//! Finished garments: mesh, parts and attachments.

use unic_core::mesh::TriMesh;

/// Rest shape of a garment with the parts and attachments that a simulation needs.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentMesh {
    /// Rest shape in the character's bind-pose space, metres.
    ///
    /// Texture coordinates are pattern coordinates in metres: the cloth laid flat, with v along the
    /// warp. Lengths in the pattern agree with lengths on the rest shape up to the distortion of
    /// flattening.
    pub mesh: TriMesh,
    /// Named parts: panels, layers, bands.
    pub parts: Vec<Part>,
    /// Part of each vertex, an index into `parts`. A vertex on a seam belongs to one of its two
    /// parts.
    pub part_of_vertex: Vec<u32>,
    /// Sets of vertices that may be held on the body.
    pub attachments: Vec<Attachment>,
}

/// One named part of a garment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Name that is unique within the garment, such as `sleeve_left`.
    pub name: String,
    /// Fabric of the part.
    pub fabric: Fabric,
}

/// Fabric of a part. A simulation maps it to one of its own materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fabric {
    /// Light shirt cotton.
    Cotton,
    /// Heavy, stiff trouser fabric.
    Denim,
    /// Light, limp, smooth fabric.
    Silk,
    /// Very light net, stiff for its weight.
    Tulle,
}

/// Vertices that may be held in place on the body, such as a waistband.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Name that is unique within the garment.
    pub name: String,
    /// Vertices, ascending.
    pub vertices: Vec<u32>,
}

impl GarmentMesh {
    /// Marks the vertices of all attachments with true: `pinned` of a capture's `garment.npz`.
    pub fn attached(&self) -> Vec<bool> {
        let mut attached = vec![false; self.mesh.vertices.len()];
        let vertices = self.attachments.iter().flat_map(|a| &a.vertices);
        vertices.for_each(|&v| attached[v as usize] = true);
        attached
    }

    /// Index of the part with a name.
    pub fn part(&self, name: &str) -> Option<u32> {
        let index = self.parts.iter().position(|p| p.name == name);
        index.map(|i| i as u32)
    }

    /// Vertices of a part, ascending.
    pub fn vertices_of(&self, part: u32) -> impl Iterator<Item = u32> + '_ {
        let vertices = self.part_of_vertex.iter().enumerate();
        vertices.filter(move |(_, p)| **p == part).map(|(v, _)| v as u32)
    }
}
