//! Reading Alembic files.

use super::with_path;
use crate::{
    error::{Error, Result},
    foreign_formats::{PartlyReadFormat, partly_read},
    frame_rate::{check_frame_rate, whole_rate},
    mesh_names::{listed, named},
};
use glam::{Vec2, Vec3};
use ogawa::{Archive, Attribute, Faces, Mesh, MeshKind, Scope};
use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};
use unic_core::mesh::{TriMesh, Uvs};

/// Largest number of frames, ten hours at 30 fps. A broken file may claim 2³² equal ones.
const MAX_FRAMES: u32 = 1 << 20;
/// Largest relative difference between the first step in time and the mean one of uniform frames.
const UNIFORM: f64 = 1e-3;

/// An Alembic file that is open for reading.
#[derive(Debug)]
pub struct AlembicReader {
    path: PathBuf,
    archive: Archive<BufReader<File>>,
    /// Meshes that have positions.
    meshes: Vec<Mesh>,
}

impl AlembicReader {
    /// Returns whether a file is Alembic in an Ogawa container, by its first bytes or its extension.
    pub fn is_alembic(path: &Path) -> bool {
        partly_read(path) == Some(PartlyReadFormat::Alembic)
    }

    /// Opens a file and reads its headers.
    ///
    /// # Errors
    /// No such file, damaged headers, no mesh with positions.
    pub fn open(path: &Path) -> Result<Self> {
        let archive = Archive::open(path).map_err(with_path(path))?;
        let mut meshes = archive.meshes().map_err(with_path(path))?;
        meshes.retain(|mesh| mesh.frames() > 0);
        if meshes.is_empty() {
            return Err(Error::content(path, "at least one mesh", "none"));
        }
        Ok(Self {
            path: path.to_path_buf(),
            archive,
            meshes,
        })
    }

    /// Number of meshes with positions, at least one.
    pub fn len(&self) -> usize {
        self.meshes.len()
    }

    /// Returns whether there are no meshes; never true.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// Names of a mesh and its ancestors, as `/garment/garmentShape`.
    ///
    /// # Panics
    /// When there is no such mesh.
    pub fn name(&self, mesh: usize) -> String {
        self.archive.full_name(self.meshes[mesh].object())
    }

    /// Finds the mesh of a name: its full name, its own or that of its parent.
    ///
    /// # Errors
    /// No such mesh, several.
    pub fn find(&self, name: &str) -> Result<usize> {
        let names: Vec<String> = (0..self.len()).map(|mesh| self.name(mesh)).collect();
        named(&self.path, &names, name)
    }

    /// Returns the only mesh, or the only one with another number of vertices than the character's
    /// body.
    ///
    /// # Errors
    /// Several such meshes, none, a mesh that cannot be read.
    pub fn only_mesh_but(&mut self, body_vertices: usize) -> Result<usize> {
        let mut others = Vec::new();
        for mesh in 0..self.len() {
            if self.len() == 1 || self.vertex_count(mesh)? != body_vertices {
                others.push(mesh);
            }
        }
        match others.as_slice() {
            [mesh] => Ok(*mesh),
            _ => {
                let names: Vec<String> = (0..self.len()).map(|mesh| self.name(mesh)).collect();
                let found = format!("{}; --object names the garment", listed(&names));
                let expected = "one mesh beside that of the character";
                Err(Error::content(&self.path, expected, found))
            }
        }
    }

    /// Number of vertices of a mesh in its first frame.
    ///
    /// # Errors
    /// Damaged data.
    ///
    /// # Panics
    /// When there is no such mesh.
    pub fn vertex_count(&mut self, mesh: usize) -> Result<usize> {
        let mut positions = Vec::new();
        let read = self.meshes[mesh].positions(&mut self.archive, 0, &mut positions);
        read.map_err(with_path(&self.path))?;
        Ok(positions.len())
    }

    /// Describes a mesh in words: its kind, its frames.
    pub(crate) fn kind(&self, mesh: usize) -> &'static str {
        match self.meshes[mesh].kind() {
            MeshKind::Polygons => "polygons",
            MeshKind::Subdivision => "subdivision cage",
        }
    }

    /// Program that wrote the file, if it says so.
    pub(crate) fn application(&self) -> Option<&str> {
        self.archive.metadata().get("_ai_Application")
    }

    /// Takes the animation of one mesh.
    ///
    /// # Errors
    /// Faces that change, more than 2²⁰ frames, no vertices, damaged data.
    ///
    /// # Panics
    /// When there is no such mesh.
    pub fn animation(mut self, mesh: usize) -> Result<AlembicAnimation> {
        let vertex_count = self.vertex_count(mesh)?;
        let name = self.name(mesh);
        let mesh = self.meshes.swap_remove(mesh);
        let error = |expected: &str, found: String| Err(Error::content(&self.path, expected, found));
        if !mesh.has_constant_faces() {
            let found = format!("{name}, whose faces change");
            return error("a mesh with the same faces in all frames", found);
        }
        if mesh.frames() > MAX_FRAMES {
            return error("at most 1048576 frames", mesh.frames().to_string());
        }
        if vertex_count == 0 {
            return error("at least one vertex", format!("none in {name}"));
        }
        Ok(AlembicAnimation {
            path: self.path,
            archive: self.archive,
            mesh,
            name,
            vertex_count,
            positions: Vec::new(),
        })
    }
}

/// Animation of one mesh of an Alembic file, whose frames are read one at a time.
#[derive(Debug)]
pub struct AlembicAnimation {
    path: PathBuf,
    archive: Archive<BufReader<File>>,
    mesh: Mesh,
    name: String,
    vertex_count: usize,
    /// Positions of the frame that is being read.
    positions: Vec<[f32; 3]>,
}

impl AlembicAnimation {
    /// Number of frames.
    pub fn len(&self) -> usize {
        self.mesh.frames() as usize
    }

    /// Returns whether there are no frames; never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of vertices of each frame.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Frames per second, if the frames are at equal distances in time. A rate within 0.02 % of a
    /// whole number is rounded to it.
    pub fn fps(&self) -> Option<f32> {
        let time = |frame: u32| self.mesh.time(&self.archive, frame);
        let steps = self.mesh.frames().checked_sub(1).filter(|steps| *steps > 0)?;
        let mean = (time(steps) - time(0)) / f64::from(steps);
        let is_uniform = (time(1) - time(0) - mean).abs() < UNIFORM * mean;
        let fps = whole_rate(1.0 / mean);
        (is_uniform && check_frame_rate(fps).is_ok()).then_some(fps as f32)
    }

    /// Replaces `into` by the positions of a frame, world space, in the unit and axes of the file.
    ///
    /// # Errors
    /// No such frame, another number of vertices than in the first frame, damaged data.
    pub fn frame(&mut self, frame: usize, into: &mut Vec<Vec3>) -> Result<()> {
        // A frame beyond u32 does not exist, which the mesh reports.
        let index = u32::try_from(frame).unwrap_or(u32::MAX);
        let read = self
            .mesh
            .world_positions(&mut self.archive, index, &mut self.positions);
        read.map_err(with_path(&self.path))?;
        if self.positions.len() != self.vertex_count {
            let expected = format!("{} vertices of {} in all frames", self.vertex_count, self.name);
            let found = format!("{} in frame {frame}", self.positions.len());
            return Err(Error::content(&self.path, expected, found));
        }
        into.clear();
        into.extend(self.positions.iter().copied().map(Vec3::from_array));
        Ok(())
    }

    /// Reads the first frame as triangles. A polygon becomes a fan around its first corner; texture
    /// coordinates are kept where every corner has them.
    ///
    /// # Errors
    /// Faces that do not fit together, no faces, positions that are not finite, damaged data.
    pub fn first_mesh(&mut self) -> Result<TriMesh> {
        let mut vertices = Vec::new();
        self.frame(0, &mut vertices)?;
        if let Some(vertex) = vertices.iter().position(|v| !v.is_finite()) {
            let found = format!("others at vertex {vertex} of {}", self.name);
            return Err(Error::content(&self.path, "finite positions", found));
        }
        let faces = self.mesh.faces(&mut self.archive, 0);
        let faces = faces.map_err(with_path(&self.path))?;
        if faces.iter().all(|face| face.len() < 3) {
            let found = format!("none in {}", self.name);
            return Err(Error::content(&self.path, "a mesh with faces", found));
        }
        // Texture coordinates are not needed: a mesh with damaged ones is read without them.
        let uvs = self.mesh.uvs(&mut self.archive, 0).ok().flatten();
        Ok(TriMesh {
            vertices,
            faces: fans(&faces),
            uvs: uvs.and_then(|uvs| triangle_uvs(&uvs, &faces)),
        })
    }
}

/// Cuts polygons into fans around their first corners.
fn fans(faces: &Faces) -> Vec<[u32; 3]> {
    let fan = |face: &[u32]| {
        let first = face.first().copied();
        let pairs: Vec<[u32; 2]> = (face.iter().skip(1).zip(face.iter().skip(2)))
            .map(|(a, b)| [*a, *b])
            .collect();
        pairs.into_iter().filter_map(move |[a, b]| Some([first?, a, b]))
    };
    faces.iter().flat_map(fan).collect()
}

/// Converts texture coordinates of corners or vertices; others and incomplete ones are left out.
fn triangle_uvs(uvs: &Attribute<2>, faces: &Faces) -> Option<Uvs> {
    let index = |element: u32| match &uvs.indices {
        Some(indices) => indices.get(element as usize).copied(),
        None => Some(element).filter(|e| (*e as usize) < uvs.values.len()),
    };
    let mut triangles = Vec::new();
    let mut first = 0_u32;
    for face in faces.iter() {
        for corner in 2..face.len() {
            let element = |corner: usize| match uvs.scope {
                Scope::Corner => Some(first + corner as u32),
                Scope::Vertex => Some(face[corner]),
                Scope::Constant | Scope::Face => None,
            };
            let [a, b, c] = [0, corner - 1, corner].map(|corner| element(corner).and_then(index));
            triangles.push([a?, b?, c?]);
        }
        first += face.len() as u32;
    }
    Some(Uvs {
        coordinates: uvs.values.iter().map(|uv| Vec2::from_array(*uv)).collect(),
        faces: triangles,
    })
}
