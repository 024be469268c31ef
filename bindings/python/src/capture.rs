//! Captures, and the frames of their clips.

use crate::{
    arrays::view,
    character::{self, Character},
    error::{Result, detached},
    mesh::{self, Mesh},
    motion::Motion,
};
use numpy::PyArray3;
use pyo3::{prelude::*, types::PyDict};
use std::{path::PathBuf, sync::Arc};
use unic_io::{Split, VertexFrames};

/// Capture: a garment that moves on a character. Clips are read when they are asked for.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Capture(pub(crate) Arc<unic_io::Capture>);

/// One clip of a capture. Its arrays are views that cannot be written to.
#[pyclass(frozen, module = "unic")]
pub(crate) struct CapturedClip {
    motion: Py<Motion>,
    garment: Py<Frames>,
    body: Option<Py<Frames>>,
    notes: Vec<String>,
}

/// Owner of frames that arrays are views of.
#[pyclass(frozen, module = "unic._unic")]
pub(crate) struct Frames(pub(crate) VertexFrames);

impl Frames {
    /// View of all frames, shape (T, V, 3). Frames of a file are mapped, and read when they are used.
    pub(crate) fn view<'py>(this: &Bound<'py, Self>) -> Result<Bound<'py, PyArray3<f32>>> {
        let frames = &this.get().0;
        let shape = (frames.len(), frames.vertex_count(), 3);
        // SAFETY: the object is frozen and keeps its frames, in memory or mapped, behind an `Arc`.
        unsafe { view(frames.numbers(), shape, this.clone().into_any()) }
    }
}

#[pymethods]
impl Capture {
    /// Opens the folder of a capture.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> Result<Self> {
        detached(py, || Ok(Self(Arc::new(unic_io::Capture::open(&folder)?))))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.manifest.name
    }

    #[getter]
    fn provenance(&self) -> &str {
        &self.0.manifest.provenance
    }

    #[getter]
    fn fps(&self) -> f32 {
        self.0.manifest.fps
    }

    #[getter]
    fn character(&self) -> Character {
        Character(character::Source::Capture(Arc::clone(&self.0)))
    }

    /// Rest shape of the garment.
    #[getter]
    fn mesh(&self) -> Mesh {
        Mesh::new(mesh::Source::GarmentOfCapture(Arc::clone(&self.0)))
    }

    /// Names of the clips of the splits train, validation and test.
    #[getter]
    fn splits<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let splits = PyDict::new(py);
        for split in Split::ALL {
            splits.set_item(split.name(), self.0.clip_names(split))?;
        }
        Ok(splits)
    }

    /// Names of all clips in the folder.
    #[getter]
    fn clips(&self) -> Result<Vec<String>> {
        Ok(self.0.clips_on_disk()?)
    }

    /// Reads a clip. A garment in a file of its own is mapped.
    fn clip(&self, py: Python<'_>, name: &str) -> Result<CapturedClip> {
        let clip = detached(py, || Ok(self.0.load_clip(name)?))?;
        let frames = |frames| Py::new(py, Frames(frames));
        Ok(CapturedClip {
            motion: Py::new(py, Motion::new(clip.clip))?,
            garment: frames(clip.garment)?,
            body: clip.body.map(frames).transpose()?,
            notes: clip.findings.iter().map(ToString::to_string).collect(),
        })
    }

    fn __repr__(&self) -> String {
        let (name, vertices) = (self.name(), self.0.garment.rest.vertices.len());
        format!(
            "<unic.Capture '{name}' of {vertices} vertices at {} fps>",
            self.fps()
        )
    }
}

#[pymethods]
impl CapturedClip {
    #[getter]
    fn motion(&self, py: Python<'_>) -> Py<Motion> {
        self.motion.clone_ref(py)
    }

    /// Positions of the garment, shape (T, V, 3).
    #[getter]
    fn garment<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray3<f32>>> {
        Frames::view(self.garment.bind(py))
    }

    /// Positions of the body, shape (T, B, 3), if they are not those of skinning.
    #[getter]
    fn body<'py>(&self, py: Python<'py>) -> Result<Option<Bound<'py, PyArray3<f32>>>> {
        self.body
            .as_ref()
            .map(|body| Frames::view(body.bind(py)))
            .transpose()
    }

    /// Probable mistakes in the motion, one sentence each.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}
