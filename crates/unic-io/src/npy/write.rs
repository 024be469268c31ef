//! Writing `.npy` headers and files with the bytes that numpy writes.

use super::header::shape_text;
use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use std::{io::Write, path::Path};

/// Alignment of the first element in the file, bytes: a mapped file is aligned for any type.
const ALIGNMENT: usize = 64;

/// Returns the header of a C-ordered array; `code` is numpy's type code, such as `<f4`.
pub(crate) fn header_bytes(code: &str, shape: &[usize]) -> Vec<u8> {
    padded_header_bytes(code, shape, 0)
}

/// Returns the header of a C-ordered array, padded with spaces to at least `least` bytes.
///
/// The padding leaves room for a header that is written again once the number of frames is known.
pub(crate) fn padded_header_bytes(code: &str, shape: &[usize], least: usize) -> Vec<u8> {
    let shape = shape_text(shape);
    let text = format!("{{'descr': '{code}', 'fortran_order': False, 'shape': {shape}, }}");
    // Magic, version, length and the newline that ends the header.
    let length = (10 + text.len() + 1).max(least).next_multiple_of(ALIGNMENT);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(((length - 10) as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.resize(length - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// Writes a `.npy` file of f32, atomically.
///
/// # Errors
/// A shape that does not hold `data`; the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], data: &[f32]) -> Result<()> {
    if shape.iter().product::<usize>() != data.len() {
        let expected = format!("as many numbers as shape {} holds", shape_text(shape));
        return Err(Error::content(path, expected, data.len().to_string()));
    }
    let mut file = AtomicFile::create(path)?;
    let mut write = |bytes: &[u8]| file.write_all(bytes).map_err(Error::io(path, "write"));
    write(&header_bytes("<f4", shape))?;
    write(bytemuck::cast_slice(data))?;
    file.finish()
}
