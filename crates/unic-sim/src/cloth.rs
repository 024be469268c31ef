//! A garment as the solver sees it: built once, shared by any number of simulations.

mod build;
mod hinges;
mod order;

use crate::{
    Material,
    aggregate::Aggregates,
    constraint::{Coloured, bend::BendBlock, stretch::StretchBlock},
};
use glam::Vec3;
use thiserror::Error;
use unic_core::{mesh::TriMesh, surface::Surface};

/// Description of a [`Cloth`].
#[derive(Debug, Clone)]
pub struct ClothSpec {
    /// The rest shape: defines rest lengths, areas and angles; in the character's bind-pose space
    /// when there is one. Where it has UVs, their v axis is the direction of the warp.
    pub rest: TriMesh,
    /// One material at least.
    pub materials: Vec<Material>,
    /// Material of each face; empty means the first for all.
    pub face_materials: Vec<u16>,
    /// Share of the rest shape's angles that the cloth wants to keep: one for pleats and darts
    /// pressed into it, zero for cloth that wants to be flat everywhere.
    pub rest_angle_share: f32,
    /// Vertices that never move unless [`Simulation::move_pins`](crate::Simulation::move_pins)
    /// moves them.
    pub pins: Vec<u32>,
    /// Vertices that follow the body.
    pub attachments: Vec<Attachment>,
}

impl ClothSpec {
    /// Cloth of one material that keeps its rest angles, free everywhere.
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

/// A garment vertex that follows a point of the body's surface, as a waistband does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attachment {
    /// The garment's vertex.
    pub vertex: u32,
    /// Face of the body.
    pub face: u32,
    /// Weights of the face's corners: sum one; negative ones lie beside the face in its plane.
    pub barycentric: Vec3,
    /// Distance to keep from the face along its normal, metres.
    pub offset: f32,
    /// Compliance of the spring in between, m/N; zero is rigid.
    pub compliance: f32,
}

impl Attachment {
    /// Attaches a vertex at `place` to the face of the body that is closest to it, so that it stays
    /// where it is while the body does. None for a body without a sound face.
    ///
    /// `surface` is the body in its bind pose, like `place`.
    pub fn to_nearest(vertex: u32, place: Vec3, body: &TriMesh, surface: &Surface) -> Option<Self> {
        let face = surface.closest(place)?.face;
        let [a, b, c] = body.faces[face as usize].map(|v| body.vertices[v as usize]);
        let (ab, ac, arm) = (b - a, c - a, place - a);
        let normal = ab.cross(ac).try_normalize()?;
        let per_area = ab.cross(ac).dot(normal).recip();
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

/// What is wrong with a [`ClothSpec`].
#[derive(Debug, Error, PartialEq)]
pub enum ClothError {
    /// The mesh itself.
    #[error("garment {0}")]
    Mesh(#[from] unic_core::mesh::MeshError),
    /// No triangle with three different corners.
    #[error("garment: expected at least one triangle with three different corners, found none")]
    Empty,
    /// UV indices that do not fit the mesh.
    #[error("garment: UVs of face {face} are not there")]
    Uvs {
        /// The face.
        face: usize,
    },
    /// A material that physics cannot take.
    #[error("garment: {quantity} of material {material} is {found}, which no cloth has")]
    Material {
        /// Index of the material.
        material: usize,
        /// Name of the field.
        quantity: &'static str,
        /// Its value.
        found: f32,
    },
    /// `face_materials` does not fit.
    #[error("garment: expected a material for each of {faces} faces, found {found}")]
    FaceMaterials {
        /// Faces of the mesh.
        faces: usize,
        /// Entries found.
        found: usize,
    },
    /// A material beyond the list, or an empty list.
    #[error("garment: face {face} names material {found} of {materials}")]
    NoMaterial {
        /// The face.
        face: usize,
        /// Index found.
        found: usize,
        /// Materials given.
        materials: usize,
    },
    /// A pin or an attachment beyond the vertices.
    #[error("garment: vertex {vertex} is pinned or attached, but there are {vertices}")]
    Vertex {
        /// Index found.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
}

/// A garment ready to be simulated.
///
/// Vertices at the same place are one particle (panels are sewn together); a vertex that belongs to
/// no triangle goes with the nearest one that does. Particles are sorted along a space-filling curve,
/// so that neighbours are neighbours in memory and the result does not depend on the numbering of
/// vertices and faces.
///
/// Without UVs the warp runs along the vertical of the rest shape, or along +Z in triangles within
/// some 18° of horizontal: the grain of a garment that hangs.
#[derive(Debug, Clone)]
pub struct Cloth {
    /// Particle of each vertex of the mesh.
    pub(crate) particle_of_vertex: Vec<u32>,
    /// Particles and triangles at rest.
    pub(crate) rest: TriMesh,
    /// Of each triangle, kg.
    pub(crate) face_masses: Vec<f32>,
    /// Of each particle, kg; zero inverse where pinned.
    pub(crate) masses: Vec<f32>,
    pub(crate) inverse_masses: Vec<f32>,
    /// Faces around particle i are `around[starts[i]..starts[i + 1]]`.
    pub(crate) starts: Vec<u32>,
    pub(crate) around: Vec<u32>,
    pub(crate) stretch: Coloured<StretchBlock, 3>,
    pub(crate) bend: Coloured<BendBlock, 4>,
    pub(crate) aggregates: Aggregates,
    /// Attachments by particle, one each.
    pub(crate) attachments: Vec<Attachment>,
    pub(crate) pins: Vec<(u32, u32)>,
    material: Material,
}

impl Cloth {
    /// Checks a description and prepares everything that does not change in a simulation.
    ///
    /// # Errors
    /// What [`ClothError`] lists. Degenerate triangles, edges of more than two triangles, seams,
    /// holes and separate parts are no errors.
    pub fn new(spec: &ClothSpec) -> Result<Self, ClothError> {
        build::cloth(spec)
    }

    /// Vertices of the mesh.
    pub fn vertex_count(&self) -> usize {
        self.particle_of_vertex.len()
    }

    /// Particles: vertices at different places.
    pub fn particle_count(&self) -> usize {
        self.rest.vertices.len()
    }

    /// Particle of each vertex of the mesh.
    pub fn particle_of_vertex(&self) -> &[u32] {
        &self.particle_of_vertex
    }

    /// The rest shape, with particles for vertices.
    pub fn rest(&self) -> &TriMesh {
        &self.rest
    }

    /// Mass of each particle, kg: a third of each triangle around.
    pub fn masses(&self) -> &[f32] {
        &self.masses
    }

    /// Number of constraints: triangles, hinges, and pairs of aggregates.
    pub fn constraint_counts(&self) -> [usize; 3] {
        [self.stretch.len(), self.bend.len(), self.aggregates.pair_count()]
    }

    /// The material that covers most of the cloth: its thickness and friction are those of contact.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Positions of the mesh's vertices from those of the particles.
    pub fn spread(&self, particles: &[Vec3], vertices: &mut Vec<Vec3>) {
        vertices.clear();
        vertices.extend(self.particle_of_vertex.iter().map(|&p| particles[p as usize]));
    }
}

#[cfg(test)]
mod tests;
