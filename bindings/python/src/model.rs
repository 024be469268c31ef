//! Models: trained garments of characters.

use crate::{
    character::{self, Character},
    error::{Error, Result, detached},
    mesh::{self, Mesh},
    names::choose,
    numbers::Numbers,
};
use pyo3::{exceptions::PyUserWarning, prelude::*, types::PyBytes};
use std::{ffi::CString, path::PathBuf, sync::Arc};
use unic_cli::{garments::Shipped, model_file};
use unic_core::Precision;

/// Trained garment of a character. It does not change, and all threads may use it.
#[pyclass(frozen, module = "unic")]
pub(crate) struct Model {
    pub(crate) model: Arc<unic_core::Model>,
    /// Checksum of the file, which marks saved states.
    pub(crate) checksum: u32,
}

const PRECISIONS: [(&str, Option<Precision>); 5] = [
    ("auto", None),
    ("f32", Some(Precision::F32)),
    ("bf16", Some(Precision::Bf16)),
    ("int16", Some(Precision::Int16)),
    ("int8", Some(Precision::Int8)),
];

impl Model {
    fn read(bytes: &[u8]) -> std::result::Result<Self, unic_core::ModelFileError> {
        Ok(Self {
            model: Arc::new(unic_core::Model::from_bytes(bytes)?),
            checksum: crc32fast::hash(bytes),
        })
    }

    /// The same file, so that states fit, in another form.
    pub(crate) fn changed(&self, model: unic_core::Model) -> Self {
        Self {
            model: Arc::new(model),
            checksum: self.checksum,
        }
    }

    /// Number format by name; `auto` is the fastest one within an error. Warns about one that is
    /// slower and less exact than f32; Python shows a warning once for each line of a program.
    ///
    /// # Errors
    /// An unknown name, an error that is no share, a warning that the program's filters raise.
    pub(crate) fn precision_of(&self, py: Python<'_>, name: &str, error: f64) -> Result<Precision> {
        if !(error.is_finite() && error >= 0.0) {
            return Err(Error::value("error", "a share, at least 0", error));
        }
        let Some(chosen) = choose("precision", name, &PRECISIONS)? else {
            return Ok(self.model.fastest_precision(error));
        };
        let width = self.model.config().field.width;
        if chosen.is_slower_than_f32(width) {
            let text = format!(
                "{name} is slower than f32 on this processor for a field of {width} channels, and less exact"
            );
            let text = CString::new(text).map_err(|e| Error::Fault(e.to_string()))?;
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
        }
        Ok(chosen)
    }
}

#[pymethods]
impl Model {
    /// Reads a model file (.unic).
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self> {
        detached(py, || {
            let bytes = model_file::read_bytes(&path).map_err(|e| Error::of_file(&e))?;
            Self::read(&bytes).map_err(|e| Error::File {
                text: format!("{}: {e}", path.display()),
                errno: None,
            })
        })
    }

    /// Reads the content of a model file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, content: &Bound<'_, PyBytes>) -> Result<Self> {
        let content = content.as_bytes();
        detached(py, || {
            Self::read(content).map_err(|e| Error::Value(e.to_string()))
        })
    }

    /// Reads a garment that comes with the package, on the built-in human.
    #[staticmethod]
    fn shipped(py: Python<'_>, name: &str) -> Result<Self> {
        let garment = choose(
            "name",
            name,
            &Shipped::ALL.map(|garment| (garment.name(), garment)),
        )?;
        detached(py, || {
            Self::read(garment.bytes()).map_err(|e| Error::Fault(e.to_string()))
        })
    }

    /// Same model with networks in another number format.
    ///
    /// "auto", the choice of a model that is read, is the fastest format of this processor whose
    /// error, as training has measured it, is at most the share `error` above that of "f32". A format
    /// that is slower than "f32" on this processor gives a `UserWarning`.
    // The default is written out for the signature that Python shows; it is
    // `unic_core::Model::ALLOWED_PRECISION_ERROR`.
    #[pyo3(signature = (precision, error=0.01))]
    fn with_precision(&self, py: Python<'_>, precision: &str, error: f64) -> Result<Self> {
        let precision = self.precision_of(py, precision, error)?;
        detached(py, || {
            Ok(self.changed(unic_core::Model::clone(&self.model).with_precision(precision)))
        })
    }

    /// Same model with the networks evaluated at a share of the vertices, 0 to 1.
    fn with_sampling(&self, py: Python<'_>, share: f32) -> Result<Self> {
        detached(py, || {
            Ok(self.changed(unic_core::Model::clone(&self.model).with_sampling(share)?))
        })
    }

    /// Same model on another mesh of the garment, in the same rest space.
    fn with_mesh(&self, py: Python<'_>, mesh: &Bound<'_, Mesh>) -> Result<Self> {
        let mesh = mesh.get();
        detached(
            py,
            || Ok(self.changed(self.model.with_mesh(mesh.mesh().clone())?)),
        )
    }

    /// Same model blended with skinning: shape (V,), 1 is the model, 0 the skinned rest shape.
    fn with_mask(&self, py: Python<'_>, mask: &Bound<'_, PyAny>) -> Result<Self> {
        let mask = Numbers::read("mask", mask)?;
        match mask.shape[..] {
            [_] => detached(py, || Ok(self.changed(self.model.with_mask(&mask.data)?))),
            _ => Err(mask.wrong_shape("mask", "(V,)")),
        }
    }

    /// Name of the capture that the model was trained on.
    #[getter]
    fn name(&self) -> &str {
        &self.model.about().name
    }

    /// Source and licence of the training data.
    #[getter]
    fn provenance(&self) -> &str {
        &self.model.about().provenance
    }

    /// Settings and results of training, as JSON holds them.
    #[getter]
    fn training<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let text = self.model.about().training.to_string();
        Ok(py.import("json")?.call_method1("loads", (text,))?)
    }

    /// Steps a second.
    #[getter]
    fn fps(&self) -> f32 {
        self.model.config().fps
    }

    /// Number format of the networks.
    #[getter]
    fn precision(&self) -> &'static str {
        self.model.precision().name()
    }

    #[getter]
    fn vertex_count(&self) -> usize {
        self.model.vertex_count()
    }

    #[getter]
    fn parameter_count(&self) -> usize {
        self.model.parameter_count()
    }

    #[getter]
    fn joint_names(&self) -> Vec<String> {
        self.model.character().skeleton.names().to_vec()
    }

    /// Rest shape of the garment.
    #[getter]
    fn mesh(&self) -> Mesh {
        Mesh::new(mesh::Source::Garment(Arc::clone(&self.model)))
    }

    #[getter]
    fn character(&self) -> Character {
        Character(character::Source::Model(Arc::clone(&self.model)))
    }

    fn __repr__(&self) -> String {
        let (name, vertices, fps) = (self.name(), self.vertex_count(), self.fps());
        format!(
            "<unic.Model '{name}' of {vertices} vertices at {fps} fps in {}>",
            self.precision()
        )
    }
}
