//! A garment prepared for the solver: built once, shared by any number of simulations.

mod build;
mod hinges;
mod order;

use crate::{
    Material,
    constraint::{ColouredConstraints, bend::BendBlock, stretch::StretchBlock},
    long_range::LongRangeLimits,
};
use glam::Vec3;
use thiserror::Error;
use unic_core::{mesh::TriMesh, surface::Surface};

/// Description of a [`Cloth`].
#[derive(Debug, Clone)]
pub struct ClothSpec {
    /// Rest shape: defines rest lengths, areas and angles. It lies in the character's bind-pose
    /// space if there is a character. Where it has UVs, their v axis is the direction of the warp.
    pub rest: TriMesh,
    /// Materials, at least one.
    pub materials: Vec<Material>,
    /// Index of the material of each face; empty assigns the first material to all faces.
    pub face_materials: Vec<u16>,
    /// Share of the rest shape's dihedral angles that are rest angles of bending. One keeps pleats
    /// and darts, zero lets the cloth straighten everywhere.
    pub rest_angle_share: f32,
    /// Pinned vertices, which move only by
    /// [`Simulation::move_pins`](crate::Simulation::move_pins).
    pub pins: Vec<u32>,
    /// Vertices that follow points of the body.
    pub attachments: Vec<Attachment>,
}

impl ClothSpec {
    /// Describes cloth of one material that keeps its rest angles, without pins and attachments.
    pub fn new(rest: TriMesh, material: Material) -> Self {
        Self {
            rest,
            materials: vec![material],
            face_materials: Vec::new(),
            rest_angle_share: 1.0,
            pins: Vec::new(),
            attachments: Vec::new(),
        }
    }
}

/// A spring between a garment vertex and a point of the body's surface, for example at a waistband.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// Index of the garment's vertex.
    pub vertex: u32,
    /// Index of the body's face.
    pub face: u32,
    /// Barycentric weights of the face's corners, of sum one. A point beside the face in its plane
    /// has negative weights.
    pub barycentric: Vec3,
    /// Offset of the target from the face along its normal, metres.
    pub offset: f32,
    /// Compliance of the spring, m/N; zero is rigid.
    pub compliance: f32,
}

impl Attachment {
    /// Attaches a vertex to the closest face of the body, with the vertex position as target.
    ///
    /// `position`, `body` and `surface` are in bind-pose space, in metres. Returns `None` when all
    /// faces of the body are degenerate.
    pub fn to_nearest(vertex: u32, position: Vec3, body: &TriMesh, surface: &Surface) -> Option<Self> {
        let face = surface.closest(position)?.face;
        let [a, b, c] = body.faces[face as usize].map(|v| body.vertices[v as usize]);
        let (ab, ac, arm) = (b - a, c - a, position - a);
        let normal = ab.cross(ac).try_normalize()?;
        let per_area = ab.cross(ac).dot(normal).recip();
        // Weights of the projection onto the face's plane, not clamped: the vertex keeps its place
        // even beside the face.
        let (v, w) = (
            arm.cross(ac).dot(normal) * per_area,
            ab.cross(arm).dot(normal) * per_area,
        );
        Some(Self {
            vertex,
            face,
            barycentric: Vec3::new(1.0 - v - w, v, w),
            offset: arm.dot(normal),
            compliance: 0.0,
        })
    }
}

/// An invalid [`ClothSpec`].
#[derive(Debug, Error, PartialEq)]
pub enum ClothError {
    /// An invalid mesh.
    #[error("garment {0}")]
    Mesh(#[from] unic_core::mesh::MeshError),
    /// A mesh without any triangle that has three different corners.
    #[error("garment: expected at least one triangle with three different corners, found none")]
    Empty,
    /// UV indices that do not fit the mesh.
    #[error("garment: expected UVs for face {face}, found none or an index beyond the UV coordinates")]
    Uvs {
        /// Index of the face.
        face: usize,
    },
    /// A material quantity out of range.
    #[error(
        "garment: expected a valid {quantity} of material {material} (finite, not negative, density above zero), \
         found {found}"
    )]
    Material {
        /// Index of the material.
        material: usize,
        /// Name of the field.
        quantity: &'static str,
        /// Value of the field.
        found: f32,
    },
    /// A wrong number of entries in `face_materials`.
    #[error("garment: expected a material for each of {faces} faces, found {found}")]
    FaceMaterials {
        /// Number of faces of the mesh.
        faces: usize,
        /// Number of entries.
        found: usize,
    },
    /// A material index beyond the list, or an empty list.
    #[error("garment: expected face {face} to name one of {materials} materials, found index {found}")]
    NoMaterial {
        /// Index of the face.
        face: usize,
        /// Index of the material that the face names.
        found: usize,
        /// Number of materials.
        materials: usize,
    },
    /// A pin or an attachment that names a vertex beyond the mesh.
    #[error("garment: expected pinned and attached vertices below {vertices}, found {vertex}")]
    Vertex {
        /// Index of the vertex.
        vertex: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
}

/// Numbers of constraints in a [`Cloth`], by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConstraintCounts {
    /// Number of triangles that resist stretch.
    pub triangles: usize,
    /// Number of hinges that resist bending.
    pub hinges: usize,
    /// Number of distance limits between coarse particles, on all levels.
    pub long_range: usize,
}

/// A garment prepared for simulation.
///
/// Vertices at the same position are one particle, so that panels are sewn together. A vertex that
/// belongs to no triangle follows the nearest one that does. Particles are sorted along a
/// space-filling curve, so that neighbours are close in memory. The result therefore does not
/// depend on the numbering of vertices and faces.
///
/// Without UVs the warp runs along the vertical of the rest shape, as in most garments. In
/// triangles within about 18° of horizontal it runs along +Z.
#[derive(Debug, Clone)]
pub struct Cloth {
    /// Particle of each vertex of the mesh.
    pub(crate) particle_of_vertex: Vec<u32>,
    /// Rest shape: one vertex per particle, and triangles between particles.
    pub(crate) rest: TriMesh,
    /// Mass of each triangle, kg.
    pub(crate) face_masses: Vec<f32>,
    /// Mass of each particle, pinned or not, kg.
    pub(crate) masses: Vec<f32>,
    /// Inverse mass of each particle, 1/kg; zero for pinned particles.
    pub(crate) inverse_masses: Vec<f32>,
    /// Row starts of `faces_of_particles`: the faces around particle i are
    /// `faces_of_particles[face_starts[i]..face_starts[i + 1]]`.
    pub(crate) face_starts: Vec<u32>,
    pub(crate) faces_of_particles: Vec<u32>,
    pub(crate) stretch: ColouredConstraints<StretchBlock, 3>,
    pub(crate) bend: ColouredConstraints<BendBlock, 4>,
    pub(crate) long_range: LongRangeLimits,
    /// Attachments sorted by particle, at most one per particle; `vertex` is the particle.
    pub(crate) attachments: Vec<Attachment>,
    /// Particle of each pin, in the order of `ClothSpec::pins`.
    pub(crate) pins: Vec<u32>,
    material: Material,
}

impl Cloth {
    /// Checks a description and prepares everything that is constant during a simulation.
    ///
    /// # Errors
    /// Returns a [`ClothError`] for an invalid description. Degenerate triangles, edges of more
    /// than two triangles, seams, holes and separate parts are valid.
    pub fn new(spec: &ClothSpec) -> Result<Self, ClothError> {
        build::cloth(spec)
    }

    /// Returns the number of vertices of the mesh.
    pub fn vertex_count(&self) -> usize {
        self.particle_of_vertex.len()
    }

    /// Returns the number of particles, which is the number of distinct vertex positions in use.
    pub fn particle_count(&self) -> usize {
        self.rest.vertices.len()
    }

    /// Returns the particle of each vertex of the mesh.
    pub fn particle_of_vertex(&self) -> &[u32] {
        &self.particle_of_vertex
    }

    /// Returns the rest shape, whose vertices are the particles.
    pub fn rest(&self) -> &TriMesh {
        &self.rest
    }

    /// Returns the mass of each particle, kg: a third of each triangle around it.
    pub fn masses(&self) -> &[f32] {
        &self.masses
    }

    /// Returns the number of constraints of each kind.
    pub fn constraint_counts(&self) -> ConstraintCounts {
        ConstraintCounts {
            triangles: self.stretch.len(),
            hinges: self.bend.len(),
            long_range: self.long_range.limit_count(),
        }
    }

    /// Returns the material that covers the largest area. Its thickness and friction apply to
    /// contact.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Writes the positions of the mesh's vertices, given those of the particles, to `vertices`.
    pub fn vertex_positions(&self, particles: &[Vec3], vertices: &mut Vec<Vec3>) {
        vertices.clear();
        vertices.extend(self.particle_of_vertex.iter().map(|&p| particles[p as usize]));
    }
}

#[cfg(test)]
mod tests;
