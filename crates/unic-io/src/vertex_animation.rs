//! Vertex animations of any format, for readers that know no character.

use crate::{
    alembic::AlembicReader,
    cache::{VertexCache, read_vertex_cache},
    error::{Error, Result},
    frames::VertexFrames,
    rigged::{RiggedFormat, ScenePoints, read_scene_points},
};
use std::path::Path;
use unic_scene::Assumed;

/// No body has this number of vertices: all meshes of a file are considered.
const NO_BODY: usize = usize::MAX;

/// Returns whether a file may hold several meshes: Alembic and USD.
pub fn holds_several_meshes(path: &Path) -> bool {
    AlembicReader::is_alembic(path) || RiggedFormat::of(path) == Some(RiggedFormat::Usd)
}

/// Reads a vertex animation as [`read_vertex_cache`] does, and Alembic and USD too: of several
/// meshes the one of the name `object`, else the one called `garment`.
///
/// # Errors
/// Those of [`read_vertex_cache`]; no mesh of the name; several meshes of which none is called
/// `garment`.
pub fn read_vertex_animation(path: &Path, object: Option<&str>) -> Result<VertexCache> {
    if AlembicReader::is_alembic(path) {
        return read_alembic(path, object);
    }
    match RiggedFormat::of(path) {
        Some(format @ RiggedFormat::Usd) => {
            let read = read_scene_points(path, format, object, NO_BODY, &Assumed::default())?;
            let ScenePoints {
                frames, fps, mesh, ..
            } = read;
            let mesh = Some(mesh);
            Ok(VertexCache { frames, fps, mesh })
        }
        _ => read_vertex_cache(path),
    }
}

fn read_alembic(path: &Path, object: Option<&str>) -> Result<VertexCache> {
    let mut reader = AlembicReader::open(path)?;
    let mesh = match object {
        Some(name) => reader.find(name)?,
        None => reader.only_mesh_but(NO_BODY)?,
    };
    let mut animation = reader.animation(mesh)?;
    let mesh = Some(animation.first_mesh()?);
    let (len, vertices) = (animation.len(), animation.vertex_count());
    let (mut data, mut frame): (Vec<f32>, Vec<_>) = Default::default();
    for t in 0..len {
        animation.frame(t, &mut frame)?;
        data.extend_from_slice(bytemuck::cast_slice(&frame));
    }
    // Every frame has the vertices of the first, which the animation checks.
    let frames = VertexFrames::new(data, len, vertices)
        .ok_or_else(|| Error::content(path, "at least one vertex", "none"))?;
    let fps = animation.fps();
    Ok(VertexCache { frames, fps, mesh })
}
