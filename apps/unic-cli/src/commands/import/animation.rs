//! Animations of a garment or of a body without a rig, in any of the formats that are read.

use super::notes::Notes;
use crate::args::ImportArgs;
use crate::mesh_units::MeshUnits;
use anyhow::{Result, bail};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::mesh::TriMesh;
use unic_io::{
    VertexFrames,
    alembic::{AlembicAnimation, AlembicReader},
    pc2::read_pc2,
    read_vertex_cache,
    rigged::{RiggedFormat, read_scene_points},
};

/// Choice of one mesh of a file.
pub(super) struct MeshChoice<'a> {
    pub(super) path: &'a Path,
    /// Its name.
    pub(super) object: Option<&'a str>,
    /// Number of vertices of meshes that are not meant, where no name tells.
    pub(super) other_vertices: usize,
}

/// Animation of a mesh's vertices. Frames are read one at a time.
pub(super) struct Animation {
    /// Frames per second, if the file states them.
    pub(super) fps: Option<f32>,
    /// First frame with its faces in metres, Y up, if the file has faces.
    pub(super) mesh: Option<TriMesh>,
    source: Source,
    path: PathBuf,
    units: MeshUnits,
}

/// Positions in the unit and axes of the file.
enum Source {
    Frames(VertexFrames),
    Alembic(Box<AlembicAnimation>),
}

impl Animation {
    /// Opens the animation of one mesh.
    ///
    /// # Errors
    /// A file that cannot be read; several meshes of which none is chosen.
    pub(super) fn open(args: &ImportArgs, choice: &MeshChoice<'_>, notes: &mut Notes) -> Result<Self> {
        let path = choice.path;
        let rigged = RiggedFormat::of(path);
        let units = match rigged {
            // The reader converts.
            Some(_) => MeshUnits::METRES,
            None => MeshUnits::stated(args.up, args.scale),
        };
        let (source, fps, mesh) = match rigged {
            Some(format) => Source::scene(args, format, choice, notes)?,
            None if AlembicReader::is_alembic(path) => Source::alembic(choice, notes)?,
            None if choice.object.is_some() => bail!(
                "{}: expected a file with named meshes for --object, found one without names",
                path.display()
            ),
            None => Source::frames(path, notes)?,
        };
        units.notes().iter().for_each(|note| notes.add(path, note));
        Ok(Self {
            fps,
            mesh: mesh.map(|mesh| units.mesh(mesh)),
            source,
            path: path.to_path_buf(),
            units,
        })
    }

    /// Number of frames.
    pub(super) fn len(&self) -> usize {
        match &self.source {
            Source::Frames(frames) => frames.len(),
            Source::Alembic(animation) => animation.len(),
        }
    }

    /// Number of vertices.
    pub(super) fn vertex_count(&self) -> usize {
        match &self.source {
            Source::Frames(frames) => frames.vertex_count(),
            Source::Alembic(animation) => animation.vertex_count(),
        }
    }

    /// Writes the positions of a frame to `positions`, in metres, Y up.
    ///
    /// # Errors
    /// A frame that cannot be read, positions that are not finite.
    ///
    /// # Panics
    /// When the animation does not have the frame.
    pub(super) fn frame(&mut self, frame: usize, positions: &mut Vec<Vec3>) -> Result<()> {
        positions.clear();
        match &mut self.source {
            Source::Frames(frames) => positions.extend_from_slice(frames.frame(frame)),
            Source::Alembic(animation) => animation.frame(frame, positions)?,
        }
        for v in positions.iter_mut() {
            *v = self.units.apply(*v);
        }
        match positions.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(vertex) => bail!(
                "{}: expected finite positions, found others at vertex {vertex} of frame {frame}",
                self.path.display()
            ),
        }
    }
}

/// Source of the frames, frames per second, first frame with its faces.
type Opened = (Source, Option<f32>, Option<TriMesh>);

impl Source {
    fn frames(path: &Path, notes: &mut Notes) -> Result<Opened> {
        let cache = read_vertex_cache(path)?;
        if path.extension().is_some_and(|e| e == "pc2") {
            let step = read_pc2(path)?.frames_per_sample;
            if step != 1.0 {
                let text = format!(
                    "a sample for every {step} frames of the scene: --fps is the rate of the samples"
                );
                notes.add(path, &text);
            }
        }
        Ok((Self::Frames(cache.frames), cache.fps, cache.mesh))
    }

    fn scene(
        args: &ImportArgs,
        format: RiggedFormat,
        choice: &MeshChoice<'_>,
        notes: &mut Notes,
    ) -> Result<Opened> {
        let MeshChoice {
            path,
            object,
            other_vertices,
        } = *choice;
        let read = read_scene_points(path, format, object, other_vertices, &args.assumed())?;
        read.notes.iter().for_each(|note| notes.add(path, note));
        Ok((Self::Frames(read.frames), read.fps, Some(read.mesh)))
    }

    fn alembic(choice: &MeshChoice<'_>, notes: &mut Notes) -> Result<Opened> {
        let path = choice.path;
        let mut reader = AlembicReader::open(path)?;
        let mesh = match choice.object {
            Some(name) => reader.find(name)?,
            None => reader.only_mesh_but(choice.other_vertices)?,
        };
        if reader.len() > 1 {
            let text = format!("mesh {} of {} in the file", reader.name(mesh), reader.len());
            notes.add(path, &text);
        }
        let mut animation = reader.animation(mesh)?;
        let first = animation.first_mesh()?;
        let fps = animation.fps();
        Ok((Self::Alembic(Box::new(animation)), fps, Some(first)))
    }
}
