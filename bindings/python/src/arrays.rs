//! Numpy arrays that leave the library: handed over, or views of assets.

use crate::error::{Error, Result};
use glam::{Vec2, Vec3};
use numpy::{
    Element, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods,
    ndarray::{ArrayView, Dimension, ShapeBuilder, StrideShape},
};
use pyo3::prelude::*;

/// Array of positions, shape (V, 3), that is a copy.
pub(crate) fn copied<'py>(py: Python<'py>, vectors: &[Vec3]) -> Result<Bound<'py, PyArray2<f32>>> {
    let numbers: Vec<f32> = bytemuck::cast_slice(vectors).to_vec();
    Ok(PyArray1::from_vec(py, numbers).reshape([vectors.len(), 3])?)
}

/// Array of frames, shape (T, V, 3), that owns the numbers: nothing is copied.
pub(crate) fn handed_over(
    py: Python<'_>,
    numbers: Vec<f32>,
    shape: [usize; 3],
) -> Result<Bound<'_, PyArray3<f32>>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?)
}

/// View of vectors that belong to an asset, shape (V, 3).
///
/// # Safety
/// `owner` keeps the vectors alive and where they are, and nobody changes them.
pub(crate) unsafe fn view_of_vectors<'py>(
    vectors: &[Vec3],
    owner: Bound<'py, PyAny>,
) -> Result<Bound<'py, PyArray2<f32>>> {
    // SAFETY: by this function's contract.
    unsafe { view(bytemuck::cast_slice(vectors), (vectors.len(), 3), owner) }
}

/// View of texture coordinates that belong to an asset, shape (N, 2).
///
/// # Safety
/// That of [`view_of_vectors`].
pub(crate) unsafe fn view_of_pairs<'py>(
    pairs: &[Vec2],
    owner: Bound<'py, PyAny>,
) -> Result<Bound<'py, PyArray2<f32>>> {
    // SAFETY: by this function's contract.
    unsafe { view(bytemuck::cast_slice(pairs), (pairs.len(), 2), owner) }
}

/// View of triangles that belong to an asset, shape (F, 3).
///
/// # Safety
/// That of [`view_of_vectors`].
pub(crate) unsafe fn view_of_faces<'py>(
    faces: &[[u32; 3]],
    owner: Bound<'py, PyAny>,
) -> Result<Bound<'py, PyArray2<u32>>> {
    // SAFETY: by this function's contract.
    unsafe { view(bytemuck::cast_slice(faces), (faces.len(), 3), owner) }
}

/// View of numbers that belong to an asset, which cannot be written to.
///
/// # Safety
/// That of [`view_of_vectors`].
pub(crate) unsafe fn view<'py, T: Element, D: Dimension, S: ShapeBuilder<Dim = D>>(
    numbers: &[T],
    shape: S,
    owner: Bound<'py, PyAny>,
) -> Result<Bound<'py, PyArray<T, D>>>
where
    StrideShape<D>: From<S>,
{
    let rows = ArrayView::from_shape(shape, numbers).map_err(|e| Error::Fault(e.to_string()))?;
    // SAFETY: the numbers live as long as `owner`, which the array keeps, and do not change.
    let array = unsafe { PyArray::borrow_from_array(&rows, owner) };
    // Numpy makes it writable only with the owner's consent, and the owner has no buffer.
    array.getattr("flags")?.setattr("writeable", false)?;
    Ok(array)
}
