//! A garment as its maker hands it over.

use unic_core::mesh::TriMesh;

/// A garment's rest shape with what a simulation wants to know of its vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentMesh {
    /// The rest shape in the character's bind-pose space, metres. Texture coordinates are pattern
    /// coordinates in metres: the cloth cut flat, with v along the warp, so that lengths in it
    /// agree with lengths on the rest shape up to what flattening costs.
    pub mesh: TriMesh,
    /// Named parts: panels, layers, bands.
    pub parts: Vec<Part>,
    /// For each vertex its part, an index into `parts`. A vertex on a seam belongs to one of the two.
    pub part_of_vertex: Vec<u32>,
    /// Sets of vertices that may be held on the body.
    pub attachments: Vec<Attachment>,
}

/// One named part of a garment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Unique within the garment, such as `sleeve_left`.
    pub name: String,
    /// What it is made of.
    pub fabric: Fabric,
}

/// Material hint of a part; a simulation maps it to a material of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fabric {
    /// Light shirt cotton.
    Cotton,
    /// Heavy and stiff.
    Denim,
    /// Light, limp and smooth.
    Silk,
    /// Very light, stiff for its weight.
    Tulle,
}

/// Vertices that may be held where they are on the body, such as a waistband.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Unique within the garment.
    pub name: String,
    /// Vertices, ascending.
    pub vertices: Vec<u32>,
}

impl GarmentMesh {
    /// True for the vertices of any of the attachments: `pinned` of a capture's `garment.npz`.
    pub fn attached(&self) -> Vec<bool> {
        let mut attached = vec![false; self.mesh.vertices.len()];
        let vertices = self.attachments.iter().flat_map(|a| &a.vertices);
        vertices.for_each(|&v| attached[v as usize] = true);
        attached
    }

    /// Index of a part by its name.
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
