//! Characters: a body and its skeleton.

use crate::{
    arrays::view_of_vectors,
    capture::Capture,
    error::Result,
    mesh::{self, Mesh},
    model::Model,
};
use numpy::PyArray2;
use pyo3::{exceptions::PyTypeError, prelude::*};
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
pub(crate) enum Wearer<'py> {
    Model(Bound<'py, Model>),
    Capture(Bound<'py, Capture>),
    Character(Bound<'py, Character>),
}

impl<'py> FromPyObject<'_, 'py> for Wearer<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(model) = value.cast::<Model>() {
            return Ok(Self::Model(model.to_owned()));
        }
        if let Ok(capture) = value.cast::<Capture>() {
            return Ok(Self::Capture(capture.to_owned()));
        }
        if let Ok(character) = value.cast::<Character>() {
            return Ok(Self::Character(character.to_owned()));
        }
        let found = value.get_type().name()?;
        let text = format!("expected a Model, a Capture or a Character, found {found}");
        Err(PyTypeError::new_err(text))
    }
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

    /// Index of each joint's parent, -1 for the root.
    #[getter]
    fn parents(&self) -> Vec<i64> {
        self.skeleton().to_parts().parents
    }

    /// Positions of the joints in the rest pose, shape (J, 3).
    #[getter]
    fn joints<'py>(this: &Bound<'py, Self>) -> Result<Bound<'py, PyArray2<f32>>> {
        // SAFETY: the object is frozen and keeps its character, behind an `Arc`.
        unsafe { view_of_vectors(this.get().skeleton().joints(), this.clone().into_any()) }
    }

    /// Index of the root joint.
    #[getter]
    fn root(&self) -> usize {
        self.skeleton().root()
    }

    /// Body in the rest pose.
    #[getter]
    fn body(&self) -> Mesh {
        Mesh::new(mesh::Source::Body(self.0.clone()))
    }

    fn __repr__(&self) -> String {
        let (joints, vertices) = (self.skeleton().len(), self.0.get().body.vertices.len());
        format!("<unic.Character of {joints} joints and {vertices} vertices>")
    }
}
