//! Arrays of the caller that results are written to.

use crate::{
    arrays::copied,
    error::{Error, Result},
    model::Model,
};
use glam::Vec3;
use numpy::{PyArray2, PyArrayMethods, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Arrays of a call that results are written to.
pub(crate) struct Targets<'py> {
    positions: Option<(Target<'py>, Bound<'py, PyAny>)>,
    normals: Option<Target<'py>>,
}

impl<'py> Targets<'py> {
    pub(crate) fn new(
        model: &Model,
        out: Option<&Bound<'py, PyAny>>,
        normals: Option<&Bound<'py, PyAny>>,
    ) -> Result<Self> {
        let vertices = model.model.vertex_count();
        Ok(Self {
            positions: out
                .map(|out| Ok::<_, Error>((Target::new("out", out, vertices)?, out.clone())))
                .transpose()?,
            normals: normals
                .map(|normals| Target::new("normals", normals, vertices))
                .transpose()?,
        })
    }

    /// Writes a frame. Returns the caller's array of positions, or a new one.
    pub(crate) fn write(
        self,
        py: Python<'py>,
        positions: &[Vec3],
        normals: &[Vec3],
    ) -> Result<Bound<'py, PyAny>> {
        if let Some(mut target) = self.normals {
            target.write(normals)?;
        }
        match self.positions {
            None => Ok(copied(py, positions)?.into_any()),
            Some((mut target, array)) => {
                target.write(positions)?;
                Ok(array)
            }
        }
    }
}

/// Array of the caller that results are written to.
struct Target<'py>(PyReadwriteArray2<'py, f32>);

impl<'py> Target<'py> {
    /// Checks an array for `vertices` rows.
    ///
    /// # Errors
    /// Another type or shape, gaps between the numbers, an array that cannot be written to.
    fn new(what: &str, value: &Bound<'py, PyAny>, vertices: usize) -> Result<Self> {
        let expected = format!("a writable array of float32 and shape ({vertices}, 3) in C order");
        let found = || match value
            .getattr("dtype")
            .and_then(|d| Ok((d, value.getattr("shape")?)))
        {
            Ok((dtype, shape)) => format!("one of {dtype} and shape {shape}"),
            Err(_) => format!("a {}", value.get_type()),
        };
        let array = value.cast::<PyArray2<f32>>();
        let array = array.map_err(|_| Error::value(what, &expected, found()))?;
        if array.shape() != [vertices, 3] || !array.is_c_contiguous() {
            return Err(Error::value(what, &expected, found()));
        }
        match array.try_readwrite() {
            Ok(array) => Ok(Self(array)),
            Err(e) => Err(Error::value(what, expected, e)),
        }
    }

    /// Writes one vector a row. The numbers of rows are equal.
    fn write(&mut self, vectors: &[Vec3]) -> Result<()> {
        match self.0.as_slice_mut() {
            Ok(numbers) => {
                numbers.copy_from_slice(bytemuck::cast_slice(vectors));
                Ok(())
            }
            Err(e) => Err(Error::Fault(e.to_string())),
        }
    }
}
