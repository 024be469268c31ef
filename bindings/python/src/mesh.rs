//! Meshes.

use crate::{
    arrays::{view_of_faces, view_of_pairs, view_of_vectors},
    character,
    error::Result,
};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::sync::Arc;
use unic_core::{Model, mesh::TriMesh};
use unic_io::Capture;

/// Asset that a mesh is part of.
#[derive(Clone)]
pub(crate) enum Source {
    Own(Arc<TriMesh>),
    Garment(Arc<Model>),
    GarmentOfCapture(Arc<Capture>),
    Body(character::Source),
}

/// Triangle mesh. Its arrays are views that cannot be written to.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Mesh(Source);

impl Mesh {
    pub(crate) fn new(source: Source) -> Self {
        Self(source)
    }

    pub(crate) fn own(mesh: TriMesh) -> Self {
        Self(Source::Own(Arc::new(mesh)))
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        match &self.0 {
            Source::Own(mesh) => mesh,
            Source::Garment(model) => &model.garment().rest,
            Source::GarmentOfCapture(capture) => &capture.garment.rest,
            Source::Body(character) => &character.get().body,
        }
    }
}

#[pymethods]
impl Mesh {
    /// Positions, shape (V, 3).
    #[getter]
    fn vertices<'py>(this: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<f32>>> {
        // SAFETY: the object is frozen and keeps its mesh, behind an `Arc`.
        unsafe { view_of_vectors(&this.get().mesh().vertices, this.clone().into_any()) }
    }

    /// Vertex indices, shape (F, 3), counter-clockwise seen from outside.
    #[getter]
    fn faces<'py>(this: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<u32>>> {
        // SAFETY: the object is frozen and keeps its mesh, behind an `Arc`.
        unsafe { view_of_faces(&this.get().mesh().faces, this.clone().into_any()) }
    }

    /// Texture coordinates, shape (N, 2), v upwards.
    #[getter]
    fn uvs<'py>(this: &Bound<'py, Self>) -> Result<Option<Bound<'py, PyArray2<f32>>>> {
        let uvs = this.get().mesh().uvs.as_ref();
        // SAFETY: the object is frozen and keeps its mesh, behind an `Arc`.
        uvs.map(|uvs| unsafe { view_of_pairs(&uvs.coordinates, this.clone().into_any()) })
            .transpose()
    }

    /// Indices into `uvs`, shape (F, 3).
    #[getter]
    fn uv_faces<'py>(this: &Bound<'py, Self>) -> Result<Option<Bound<'py, PyArray2<u32>>>> {
        let uvs = this.get().mesh().uvs.as_ref();
        // SAFETY: the object is frozen and keeps its mesh, behind an `Arc`.
        uvs.map(|uvs| unsafe { view_of_faces(&uvs.faces, this.clone().into_any()) })
            .transpose()
    }

    fn __repr__(&self) -> String {
        let mesh = self.mesh();
        let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
        format!("<unic.Mesh of {vertices} vertices and {faces} faces>")
    }
}
