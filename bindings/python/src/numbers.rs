//! Numbers that come in: anything that numpy takes for an array, checked.

use crate::error::{Error, Result};
use glam::Vec3;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::{intern, prelude::*, types::PyDict};

/// Numbers of an argument, in C order.
pub(crate) struct Numbers {
    pub(crate) data: Vec<f32>,
    pub(crate) shape: Vec<usize>,
}

impl Numbers {
    /// Reads an array, or what numpy makes one of, such as a list.
    ///
    /// # Errors
    /// Values that are no numbers.
    pub(crate) fn read(what: &str, value: &Bound<'_, PyAny>) -> Result<Self> {
        let py = value.py();
        let unusable = |found: String| Error::value(what, "an array of numbers", found);
        let array = py
            .import(intern!(py, "numpy"))?
            .call_method1(intern!(py, "asarray"), (value,))
            .map_err(|e| unusable(e.to_string()))?;
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract::<String>()?;
        if !matches!(kind.as_str(), "f" | "i" | "u") {
            return Err(unusable(format!("one of {}", array.getattr("dtype")?)));
        }
        let options = PyDict::new(py);
        options.set_item("order", "C")?;
        options.set_item("copy", false)?;
        let array = array.call_method(intern!(py, "astype"), ("float32",), Some(&options))?;
        let array: PyReadonlyArrayDyn<'_, f32> =
            array.extract().map_err(|e: PyErr| unusable(e.to_string()))?;
        let data = array.as_slice().map_err(|e| unusable(e.to_string()))?;
        Ok(Self {
            data: data.to_vec(),
            shape: array.shape().to_vec(),
        })
    }

    /// Makes the error about another shape.
    pub(crate) fn wrong_shape(&self, what: &str, expected: &str) -> Error {
        Error::value(
            what,
            format!("an array of shape {expected}"),
            text_of_shape(&self.shape),
        )
    }

    /// Numbers as vectors. Their last axis has the length 3.
    pub(crate) fn vectors(&self) -> Vec<Vec3> {
        self.data.chunks_exact(3).map(Vec3::from_slice).collect()
    }
}

/// Shape as Python writes it.
pub(crate) fn text_of_shape(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!(
            "({})",
            shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
        ),
    }
}

/// Reads three numbers.
///
/// # Errors
/// Another shape.
pub(crate) fn vector(what: &str, value: &Bound<'_, PyAny>) -> Result<Vec3> {
    let numbers = Numbers::read(what, value)?;
    match numbers.shape[..] {
        [3] => Ok(Vec3::from_slice(&numbers.data)),
        _ => Err(numbers.wrong_shape(what, "(3,)")),
    }
}

/// Reads one vector a row.
///
/// # Errors
/// Another shape.
pub(crate) fn vectors(what: &str, value: &Bound<'_, PyAny>, rows: &str) -> Result<Vec<Vec3>> {
    let numbers = Numbers::read(what, value)?;
    match numbers.shape[..] {
        [_, 3] => Ok(numbers.vectors()),
        _ => Err(numbers.wrong_shape(what, &format!("({rows}, 3)"))),
    }
}
