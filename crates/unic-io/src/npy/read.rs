//! Reading arrays from `.npy` streams. Sizes are checked before memory is allocated.

use super::{
    element::{Element, sealed::Decode},
    header::{Dtype, DtypeKind, Header, shape_text},
};
use crate::error::{Error, Result};
use std::{
    fs::File,
    io::{self, BufReader, Read},
    path::Path,
};

/// Size of the buffer that elements are decoded through, bytes.
const CHUNK: usize = 1 << 16;

/// An array in C order: the last index varies fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Extent of each dimension.
    pub shape: Vec<usize>,
    /// All elements.
    pub data: Vec<T>,
}

/// Required extent of an array's dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dim {
    /// Any extent; the letter stands for it in messages.
    Any(&'static str),
    /// Exactly this extent.
    Is(usize),
}

/// Origin of an array, for messages and for the bound on its size.
#[derive(Clone, Copy)]
pub(crate) struct ArraySource<'a> {
    pub(crate) path: &'a Path,
    pub(crate) array: &'a str,
    /// Length of header and elements together in the container, bytes.
    pub(crate) length: u64,
}

impl ArraySource<'_> {
    /// Returns an error about this array.
    pub(crate) fn error(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::Array {
            path: self.path.to_path_buf(),
            array: self.array.into(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    /// Converts an error of the reader.
    pub(crate) fn read_error(&self, error: io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::InvalidData => self.error("a numpy array", error.to_string()),
            io::ErrorKind::UnexpectedEof => self.error("a whole array", "the end of the file"),
            _ => Error::io(self.path, "read")(error),
        }
    }

    /// Reads a header and checks its declared size against the container.
    ///
    /// # Errors
    /// A malformed header; more or fewer bytes than it declares.
    pub(crate) fn header(&self, reader: &mut impl Read) -> Result<Header> {
        let header = Header::read(reader).map_err(|e| self.read_error(e))?;
        // Types without a fixed size have nothing to check; readers refuse them.
        if matches!(header.dtype.kind, DtypeKind::Object | DtypeKind::Other) {
            return Ok(header);
        }
        let declared = header.data_length();
        let held = self.length.saturating_sub(header.length as u64);
        if declared != Some(held) {
            let declared = declared.map_or("more bytes than fit".into(), |d| format!("{d} bytes"));
            let shape = shape_text(&header.shape);
            return Err(self.error(
                format!("{declared} for shape {shape} of {}", header.dtype),
                format!("{held} bytes"),
            ));
        }
        Ok(header)
    }
}

/// Reads one array of the shape `dims`, in C order.
///
/// # Errors
/// Another shape or type, an element out of range, fewer or more bytes than declared.
pub(crate) fn read_array<T: Element>(
    source: ArraySource<'_>,
    reader: &mut impl Read,
    dims: &[Dim],
) -> Result<Array<T>> {
    let header = source.header(reader)?;
    if !T::accepts(header.dtype) {
        return Err(source.error(T::EXPECTED, header.dtype.to_string()));
    }
    expect_shape(&source, &header.shape, dims)?;
    let data = decode(source, reader, &header)?;
    let data = if header.fortran_order {
        c_order(&data, &header.shape)
    } else {
        data
    };
    Ok(Array {
        shape: header.shape,
        data,
    })
}

fn expect_shape(source: &ArraySource<'_>, shape: &[usize], dims: &[Dim]) -> Result<()> {
    let fits = |(&extent, dim): (&usize, &Dim)| match dim {
        Dim::Any(_) => true,
        Dim::Is(expected) => extent == *expected,
    };
    if shape.len() == dims.len() && shape.iter().zip(dims).all(fits) {
        return Ok(());
    }
    let expected: Vec<String> = (dims.iter())
        .map(|dim| match dim {
            Dim::Any(letter) => (*letter).into(),
            Dim::Is(extent) => extent.to_string(),
        })
        .collect();
    Err(source.error(
        format!("shape ({})", expected.join(", ")),
        format!("shape {}", shape_text(shape)),
    ))
}

/// Decodes all elements. Memory grows with the bytes that arrive, not with the declared count.
fn decode<T: Element>(source: ArraySource<'_>, reader: &mut impl Read, header: &Header) -> Result<Vec<T>> {
    let Dtype { kind, size, .. } = header.dtype;
    let mut left = header.element_count().unwrap_or(0);
    let mut data = Vec::with_capacity(left.min(CHUNK));
    // A whole number of elements, and no more than the array has.
    let mut chunk = vec![0; (CHUNK / size * size).min(left.saturating_mul(size))];
    while left > 0 {
        let count = left.min(chunk.len() / size);
        let bytes = &mut chunk[..count * size];
        reader.read_exact(bytes).map_err(|e| source.read_error(e))?;
        for element in bytes.chunks_exact_mut(size) {
            if header.dtype.big_endian {
                // Decoding expects little-endian bytes.
                element.reverse();
            }
            let value = T::decode(kind, element);
            data.push(value.ok_or_else(|| source.error(T::EXPECTED, "one out of range"))?);
        }
        left -= count;
    }
    expect_end(source, reader)?;
    Ok(data)
}

/// Decodes contiguous numbers; `None` for types that are not numbers.
pub(crate) fn decoded(dtype: Dtype, bytes: &[u8]) -> Option<Vec<f64>> {
    let element = |bytes: &[u8]| {
        let mut number = [0; 8];
        let number = &mut number[..bytes.len()];
        number.copy_from_slice(bytes);
        if dtype.big_endian {
            number.reverse();
        }
        f64::decode(dtype.kind, number)
    };
    let is_decodable = f64::accepts(dtype) && (1..=8).contains(&dtype.size);
    is_decodable.then(|| bytes.chunks_exact(dtype.size).map(element).collect())?
}

/// Checks that the reader is at its end.
///
/// A reader of a zip entry verifies its checksum only when it reaches the end. It fails there too
/// if the entry unpacks to more bytes than declared.
fn expect_end(source: ArraySource<'_>, reader: &mut impl Read) -> Result<()> {
    match reader.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(source.error("the end of the array", "more bytes")),
        Err(e) if e.kind() == io::ErrorKind::InvalidData => {
            Err(source.error("the end of the array with its checksum", e.to_string()))
        }
        Err(e) => Err(source.read_error(e)),
    }
}

/// Reorders the elements of a Fortran-ordered array to C order.
fn c_order<T: Copy>(data: &[T], shape: &[usize]) -> Vec<T> {
    // In Fortran order the first index has stride 1. Walking through all indices in C order and
    // summing strides costs a few additions an element and needs no second array of positions.
    let mut index = vec![0; shape.len()];
    let mut strides = Vec::with_capacity(shape.len());
    let mut stride = 1;
    for &extent in shape {
        strides.push(stride);
        stride *= extent;
    }
    (0..data.len())
        .map(|_| {
            let at: usize = index.iter().zip(&strides).map(|(i, s)| i * s).sum();
            advance(&mut index, shape);
            data[at]
        })
        .collect()
}

/// Moves a multi-dimensional index to the next element in C order.
fn advance(index: &mut [usize], shape: &[usize]) {
    for (i, &extent) in index.iter_mut().zip(shape).rev() {
        *i += 1;
        if *i < extent {
            return;
        }
        *i = 0;
    }
}

/// Reads an array of text (`U` or `S`), flattened.
///
/// # Errors
/// Another type, fewer or more bytes than declared, several strings of no characters.
pub(crate) fn read_text(source: ArraySource<'_>, reader: &mut impl Read) -> Result<Vec<String>> {
    let header = source.header(reader)?;
    let count = header.element_count().unwrap_or(0);
    let Dtype { kind, size, .. } = header.dtype;
    if !matches!(kind, DtypeKind::Text | DtypeKind::Bytes) {
        return Err(source.error("text", header.dtype.to_string()));
    }
    if size == 0 {
        // A header can declare any number of empty strings without a byte behind them.
        return match count {
            0 | 1 => Ok(vec![String::new(); count]),
            _ => Err(source.error("text", "strings without a character")),
        };
    }
    // No capacity from the declared count: a damaged header may claim any number.
    let mut texts = Vec::new();
    for _ in 0..count {
        let mut bytes = Vec::new();
        let read = reader.take(size as u64).read_to_end(&mut bytes);
        if read.map_err(|e| source.read_error(e))? < size {
            return Err(source.error("a whole array", "the end of the file"));
        }
        texts.push(text(header.dtype, &bytes));
    }
    expect_end(source, reader)?;
    Ok(texts)
}

/// Decodes one string; the padding zeros at its end are dropped.
fn text(dtype: Dtype, bytes: &[u8]) -> String {
    if dtype.kind == DtypeKind::Bytes {
        return String::from_utf8_lossy(bytes).trim_end_matches('\0').into();
    }
    let units = bytes.chunks_exact(4).filter_map(|unit| {
        let unit: [u8; 4] = unit.try_into().ok()?;
        Some(if dtype.big_endian {
            u32::from_be_bytes(unit)
        } else {
            u32::from_le_bytes(unit)
        })
    });
    let chars = units.map(|u| char::from_u32(u).unwrap_or(char::REPLACEMENT_CHARACTER));
    chars.collect::<String>().trim_end_matches('\0').into()
}

/// Reads a `.npy` file of the shape `dims`.
///
/// # Errors
/// No such file, another shape or type, fewer or more bytes than the header declares.
pub fn read_npy<T: Element>(path: &Path, dims: &[Dim]) -> Result<Array<T>> {
    let (source, mut reader) = open(path)?;
    read_array(source, &mut reader, dims)
}

/// Reads the header of a `.npy` file and checks it against the file's size; elements are not read.
///
/// # Errors
/// No such file, no numpy array, another size than declared.
pub fn read_npy_header(path: &Path) -> Result<Header> {
    let (source, mut reader) = open(path)?;
    source.header(&mut reader)
}

fn open(path: &Path) -> Result<(ArraySource<'_>, BufReader<File>)> {
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let length = file.metadata().map_err(Error::io(path, "read"))?.len();
    // Errors about an array need its name; a `.npy` file has none but its own.
    let array = path.file_name().and_then(|n| n.to_str()).unwrap_or("array");
    let source = ArraySource { path, array, length };
    Ok((source, BufReader::new(file)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortran_order_becomes_c_order() {
        // numpy.asfortranarray([[0, 1, 2], [3, 4, 5]]) stores its columns one after the other.
        assert_eq!(c_order(&[0, 3, 1, 4, 2, 5], &[2, 3]), [0, 1, 2, 3, 4, 5]);
        assert_eq!(
            c_order(&[0, 4, 2, 6, 1, 5, 3, 7], &[2, 2, 2]),
            [0, 1, 2, 3, 4, 5, 6, 7]
        );
        assert_eq!(c_order(&[7], &[]), [7]);
        assert!(c_order::<u8>(&[], &[3, 0]).is_empty());
    }
}
