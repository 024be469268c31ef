//! Arrays from `.npy` streams, with their sizes checked before memory is asked for.

use super::{
    element::{Element, sealed::Decode},
    header::{Dtype, Header, Kind, shape_text},
};
use crate::error::{Error, Result};
use std::{
    fs::File,
    io::{self, BufReader, Read},
    path::Path,
};

/// Elements are decoded through a buffer of about this many bytes.
const CHUNK: usize = 1 << 16;

/// An array in C order: the last index varies fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Extent of each dimension.
    pub shape: Vec<usize>,
    /// All elements.
    pub data: Vec<T>,
}

/// What an array's dimension should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dim {
    /// Anything; the letter is for messages.
    Any(&'static str),
    /// Exactly this many.
    Is(usize),
}

/// Where an array comes from, for messages and for the bounds on its size.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) array: &'a str,
    /// Bytes that the container holds for header and elements together.
    pub(crate) length: u64,
}

impl Source<'_> {
    pub(crate) fn error(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::Array {
            path: self.path.to_path_buf(),
            array: self.array.into(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    pub(crate) fn read_error(&self, error: io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::InvalidData => self.error("a numpy array", error.to_string()),
            io::ErrorKind::UnexpectedEof => self.error("a whole array", "the end of the file"),
            _ => Error::io(self.path, "read")(error),
        }
    }

    /// Header whose declared size agrees with what the container holds.
    pub(crate) fn header(&self, reader: &mut impl Read) -> Result<Header> {
        let header = Header::read(reader).map_err(|e| self.read_error(e))?;
        if matches!(header.dtype.kind, Kind::Object | Kind::Other) {
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

/// Reads one array whose shape fits `dims`.
pub(crate) fn read_array<T: Element>(
    source: Source<'_>,
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

fn expect_shape(source: &Source<'_>, shape: &[usize], dims: &[Dim]) -> Result<()> {
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

/// Elements as they arrive: memory grows with the bytes that are there, not with the declaration.
fn decode<T: Element>(source: Source<'_>, reader: &mut impl Read, header: &Header) -> Result<Vec<T>> {
    let Dtype { kind, size, .. } = header.dtype;
    let mut left = header.element_count().unwrap_or(0);
    let mut data = Vec::with_capacity(left.min(CHUNK));
    let mut chunk = vec![0; (CHUNK / size * size).min(left.saturating_mul(size))];
    while left > 0 {
        let count = left.min(chunk.len() / size);
        let bytes = &mut chunk[..count * size];
        reader.read_exact(bytes).map_err(|e| source.read_error(e))?;
        for element in bytes.chunks_exact_mut(size) {
            if header.dtype.big_endian {
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

/// Numbers of a type that lie in memory one after another; none for types that are no numbers.
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
    let sound = f64::accepts(dtype) && (1..=8).contains(&dtype.size);
    sound.then(|| bytes.chunks_exact(dtype.size).map(element).collect())?
}

/// Reaching the end makes a zip entry verify its checksum and that nothing more would be unpacked.
fn expect_end(source: Source<'_>, reader: &mut impl Read) -> Result<()> {
    match reader.read(&mut [0]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(source.error("the end of the array", "more bytes")),
        Err(e) if e.kind() == io::ErrorKind::InvalidData => {
            Err(source.error("the end of the array with its checksum", e.to_string()))
        }
        Err(e) => Err(source.read_error(e)),
    }
}

/// Elements of a Fortran-ordered array in C order.
fn c_order<T: Copy>(data: &[T], shape: &[usize]) -> Vec<T> {
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

/// The next index in C order.
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
pub(crate) fn read_text(source: Source<'_>, reader: &mut impl Read) -> Result<Vec<String>> {
    let header = source.header(reader)?;
    let count = header.element_count().unwrap_or(0);
    let Dtype { kind, size, .. } = header.dtype;
    if !matches!(kind, Kind::Text | Kind::Bytes) {
        return Err(source.error("text", header.dtype.to_string()));
    }
    if size == 0 {
        // A header can declare any number of empty strings without a byte behind them.
        return match count {
            0 | 1 => Ok(vec![String::new(); count]),
            _ => Err(source.error("text", "strings without a character")),
        };
    }
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

fn text(dtype: Dtype, bytes: &[u8]) -> String {
    if dtype.kind == Kind::Bytes {
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

/// Reads a `.npy` file whose shape fits `dims`.
///
/// # Errors
/// No such file, another shape or type, fewer or more bytes than the header declares.
pub fn read_npy<T: Element>(path: &Path, dims: &[Dim]) -> Result<Array<T>> {
    let (source, mut reader) = open(path)?;
    read_array(source, &mut reader, dims)
}

/// Reads only the header of a `.npy` file, and checks it against the file's size.
///
/// # Errors
/// No such file, no numpy array, another size than declared.
pub fn read_npy_header(path: &Path) -> Result<Header> {
    let (source, mut reader) = open(path)?;
    source.header(&mut reader)
}

fn open(path: &Path) -> Result<(Source<'_>, BufReader<File>)> {
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let length = file.metadata().map_err(Error::io(path, "read"))?.len();
    let array = path.file_name().and_then(|n| n.to_str()).unwrap_or("array");
    let source = Source { path, array, length };
    Ok((source, BufReader::new(file)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortran_order_is_transposed() {
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
