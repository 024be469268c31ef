//! Characters: a body and its skeleton.

use crate::{
    arrays::view_of_vectors,
    capture::Capture,
    error::Result,
    mesh::{self, Mesh},
    model::Model,
};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::sync::Arc;
use unic_core::{character, skeleton::Skeleton};

/// Skinned body with its skeleton.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Character(pub(crate) Source);

/// Asset that a character is part of.
#[derive(Clone)]
pub(crate) enum Source {
    Own(Arc<character::Character>),
    Model(Arc<unic_core::Model>),
    Capture(Arc<unic_io::Capture>),
}

/// Argument that has a character.
#[derive(FromPyObject)]
pub(crate) enum Wearer<'py> {
    #[pyo3(annotation = "Model")]
    Model(Bound<'py, Model>),
    #[pyo3(annotation = "Capture")]
    Capture(Bound<'py, Capture>),
    #[pyo3(annotation = "Character")]
    Character(Bound<'py, Character>),
}

impl Source {
    pub(crate) fn get(&self) -> &character::Character {
        match self {
            Self::Own(character) => character,
            Self::Model(model) => model.character(),
            Self::Capture(capture) => &capture.character,
        }
    }
}

impl Wearer<'_> {
    pub(crate) fn source(&self) -> Source {
        match self {
            Self::Model(model) => Source::Model(Arc::clone(&model.get().model)),
            Self::Capture(capture) => Source::Capture(Arc::clone(&capture.get().0)),
            Self::Character(character) => character.get().0.clone(),
        }
    }

    /// Frame rate of a model or a capture.
    pub(crate) fn fps(&self) -> Option<f32> {
        match self {
            Self::Model(model) => Some(model.get().model.config().fps),
            Self::Capture(capture) => Some(capture.get().0.manifest.fps),
            Self::Character(_) => None,
        }
    }
}

impl Character {
    fn skeleton(&self) -> &Skeleton {
        &self.0.get().skeleton
    }
}

#[pymethods]
impl Character {
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.skeleton().names().to_vec()
    }

    #[getter]
    fn parents(&self) -> Vec<i64> {
        self.skeleton().to_parts().parents
    }

    #[getter]
    fn joints<'py>(this: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<f32>>> {
        // SAFETY: the object is frozen and keeps its character, behind an `Arc`.
        unsafe { view_of_vectors(this.get().skeleton().joints(), this.clone().into_any()) }
    }

    #[getter]
    fn root(&self) -> usize {
        self.skeleton().root()
    }

    #[getter]
    fn body(&self) -> Mesh {
        Mesh::new(mesh::Source::Body(self.0.clone()))
    }

    fn __repr__(&self) -> String {
        let (joints, vertices) = (self.skeleton().len(), self.0.get().body.vertices.len());
        format!("<unic.Character of {joints} joints and {vertices} vertices>")
    }
}
