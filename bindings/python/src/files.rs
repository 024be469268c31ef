//! Readers of meshes, characters and vertex animations.

use crate::{
    capture::Frames,
    character::{Character, Source},
    error::{Result, detached},
    mesh::Mesh,
};
use numpy::PyArray3;
use pyo3::prelude::*;
use std::{path::PathBuf, sync::Arc};
use unic_io::{import_character, read_obj, rigged::CharacterOptions};

/// Positions of vertices over time, in the unit and axes of their file.
#[pyclass(frozen, module = "unic")]
pub(crate) struct VertexAnimation {
    frames: Py<Frames>,
    fps: Option<f32>,
    mesh: Option<Py<Mesh>>,
}

#[pymethods]
impl VertexAnimation {
    /// Positions, shape (T, V, 3): a view that cannot be written to.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray3<f32>>> {
        Frames::view(self.frames.bind(py))
    }

    /// Frames a second, if the file states them.
    #[getter]
    fn fps(&self) -> Option<f32> {
        self.fps
    }

    /// First frame with its faces, if the file has faces.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> Option<Py<Mesh>> {
        self.mesh.as_ref().map(|mesh| mesh.clone_ref(py))
    }
}

/// Reads an OBJ file, in its own unit and axes.
#[pyfunction]
pub(crate) fn read_mesh(py: Python<'_>, path: PathBuf) -> Result<Mesh> {
    detached(py, || Ok(Mesh::own(read_obj(&path)?)))
}

/// Reads PC2, MDD, npz, npy, Alembic, USD or a folder of OBJ files.
///
/// `object` is the name of the mesh, for files with several.
#[pyfunction]
#[pyo3(signature = (path, object=None))]
pub(crate) fn read_vertex_animation(
    py: Python<'_>,
    path: PathBuf,
    object: Option<&str>,
) -> Result<VertexAnimation> {
    let read = detached(py, || Ok(unic_io::read_vertex_animation(&path, object)?))?;
    Ok(VertexAnimation {
        frames: Py::new(py, Frames(read.frames))?,
        fps: read.fps,
        mesh: read.mesh.map(|mesh| Py::new(py, Mesh::own(mesh))).transpose()?,
    })
}

/// Reads a character: npz, glTF, FBX, USD or a pickle of SMPL, in metres and +Y up.
///
/// `body` is the name of the mesh, for files with several.
#[pyfunction]
#[pyo3(signature = (path, body=None))]
pub(crate) fn read_character(py: Python<'_>, path: PathBuf, body: Option<&str>) -> Result<Character> {
    let options = CharacterOptions {
        body,
        ..CharacterOptions::default()
    };
    let character = detached(py, || Ok(import_character(&path, &options)?.character))?;
    Ok(Character(Source::Own(Arc::new(character))))
}
