//! Header of a `.npy` stream: a Python dictionary literal of three keys.

use std::{
    fmt::{self, Display},
    io::{self, Read},
};

/// Longest header that is read, bytes. Numpy's own limit is 10,000 characters by default.
const MAX_HEADER: usize = 1 << 16;

/// Largest number of dimensions, numpy's own limit.
const MAX_DIMENSIONS: usize = 64;

/// Declaration at the start of a `.npy` stream: element type, order and shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// Type of the elements.
    pub dtype: Dtype,
    /// Fortran order: the first index varies fastest.
    pub fortran_order: bool,
    /// Extent of each dimension; empty for a single number.
    pub shape: Vec<usize>,
    /// Length of the header in bytes: the offset of the first element.
    pub length: usize,
}

/// Type of an element: kind, size and byte order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dtype {
    /// Class of type.
    pub kind: DtypeKind,
    /// Size of an element, bytes.
    pub size: usize,
    /// Byte order: the most significant byte comes first.
    pub big_endian: bool,
}

/// Class of an element's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DtypeKind {
    /// `b`: one byte, 0 or 1.
    Bool,
    /// `i`: signed, 1 to 8 bytes.
    Signed,
    /// `u`: unsigned, 1 to 8 bytes.
    Unsigned,
    /// `f`: IEEE 754, 2, 4 or 8 bytes.
    Float,
    /// `U`: text in UTF-32 code units, padded with zeros.
    Text,
    /// `S`: bytes, padded with zeros.
    Bytes,
    /// `O`: pickled Python objects, which are never read.
    Object,
    /// Complex numbers, dates, structures and all other types of numpy.
    Other,
}

impl Header {
    /// Number of elements; `None` when it does not fit.
    pub fn element_count(&self) -> Option<usize> {
        (self.shape.iter()).try_fold(1_usize, |n, &extent| n.checked_mul(extent))
    }

    /// Size of all elements in bytes; `None` when it does not fit.
    pub fn data_length(&self) -> Option<u64> {
        let bytes = self.element_count()?.checked_mul(self.dtype.size)?;
        u64::try_from(bytes).ok()
    }

    /// Reads and parses a header.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidData`] with what was expected and found; errors of the reader.
    pub(crate) fn read(reader: &mut impl Read) -> io::Result<Self> {
        let mut start = [0; 8];
        reader.read_exact(&mut start)?;
        if &start[..6] != b"\x93NUMPY" {
            return Err(invalid("no numpy array (it does not begin with \\x93NUMPY)"));
        }
        let Preamble {
            text_length,
            prefix_length,
        } = Preamble::read(reader, start[6])?;
        // Checked before the allocation: version 2 can declare 4 GiB.
        if text_length > MAX_HEADER {
            return Err(invalid(format!("a header of {text_length} bytes")));
        }
        let mut text = vec![0; text_length];
        reader.read_exact(&mut text)?;
        // Versions 1 and 2 are Latin-1, version 3 is UTF-8. Only structured types, which are
        // refused, have names beyond ASCII.
        let text = String::from_utf8_lossy(&text);
        Self::parse(&text, prefix_length + text_length)
            .ok_or_else(|| invalid(format!("the header {:?}", text.trim())))
    }

    /// Parses `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }`, keys in any order;
    /// `length` is that of the whole header.
    fn parse(text: &str, length: usize) -> Option<Self> {
        let descr = value_of(text, "descr")?;
        let fortran = value_of(text, "fortran_order")?;
        let fortran_order = if fortran.starts_with("True") {
            true
        } else if fortran.starts_with("False") {
            false
        } else {
            return None;
        };
        let shape = parse_shape(value_of(text, "shape")?)?;
        Some(Self {
            dtype: Dtype::parse(descr)?,
            fortran_order,
            shape,
            length,
        })
    }
}

fn invalid(found: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, found.into())
}

/// Lengths of the parts of a header, bytes.
struct Preamble {
    /// Length of the dictionary's text.
    text_length: usize,
    /// Length of magic, version and length field.
    prefix_length: usize,
}

impl Preamble {
    /// Reads the length field, which is wider from version 2 on.
    fn read(reader: &mut impl Read, version: u8) -> io::Result<Self> {
        match version {
            1 => {
                let mut length = [0; 2];
                reader.read_exact(&mut length)?;
                Ok(Self {
                    text_length: usize::from(u16::from_le_bytes(length)),
                    prefix_length: 10,
                })
            }
            2 | 3 => {
                let mut length = [0; 4];
                reader.read_exact(&mut length)?;
                Ok(Self {
                    text_length: u32::from_le_bytes(length) as usize,
                    prefix_length: 12,
                })
            }
            other => Err(invalid(format!("version {other} of numpy's format"))),
        }
    }
}

/// Returns the text behind a key and its colon, up to the end of the header.
fn value_of<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    // A search instead of a parser of Python literals: numpy writes each key once, and values that
    // could repeat one belong to structured types.
    let quoted = |quote: char| format!("{quote}{key}{quote}");
    let after = (text.split_once(&quoted('\''))).or_else(|| text.split_once(&quoted('"')))?;
    Some(after.1.trim_start().strip_prefix(':')?.trim_start())
}

fn parse_shape(value: &str) -> Option<Vec<usize>> {
    let (inside, _) = value.strip_prefix('(')?.split_once(')')?;
    // The comma of `(3,)` leaves an empty part.
    let extents = inside.split(',').map(str::trim).filter(|e| !e.is_empty());
    let shape: Option<Vec<usize>> = extents
        // Python 2 wrote long integers as `3L`.
        .map(|e| e.trim_end_matches('L').parse().ok())
        .collect();
    shape.filter(|s| s.len() <= MAX_DIMENSIONS)
}

impl Dtype {
    /// Parses a quoted type code such as `'<f4'`; a list is a structured type.
    fn parse(value: &str) -> Option<Self> {
        let quote = value.chars().next()?;
        // A list of fields is a structured type.
        if quote == '[' {
            return Some(Self::opaque(DtypeKind::Other));
        }
        if quote != '\'' && quote != '"' {
            return None;
        }
        let (code, _) = value[1..].split_once(quote)?;
        let digits = code.find(|c: char| c.is_ascii_digit()).unwrap_or(code.len());
        let (letters, digits) = code.split_at(digits);
        let kind = match letters.chars().next_back()? {
            'b' => DtypeKind::Bool,
            'i' => DtypeKind::Signed,
            'u' => DtypeKind::Unsigned,
            'f' => DtypeKind::Float,
            'U' => DtypeKind::Text,
            'S' | 'a' => DtypeKind::Bytes,
            'O' => return Some(Self::opaque(DtypeKind::Object)),
            _ => return Some(Self::opaque(DtypeKind::Other)),
        };
        let count: usize = digits.parse().ok()?;
        let size = match kind {
            DtypeKind::Text => count.checked_mul(4)?,
            _ => count,
        };
        let dtype = Self {
            kind,
            size,
            // `<`, `|` and no letter at all are little-endian on the machines that this crate
            // supports.
            big_endian: letters.starts_with('>'),
        };
        dtype.has_valid_size().then_some(dtype)
    }

    /// A type whose elements are never read.
    fn opaque(kind: DtypeKind) -> Self {
        Self {
            kind,
            size: 0,
            big_endian: false,
        }
    }

    /// Returns whether the kind can have elements of this size.
    fn has_valid_size(&self) -> bool {
        match self.kind {
            DtypeKind::Bool => self.size == 1,
            DtypeKind::Signed | DtypeKind::Unsigned => matches!(self.size, 1 | 2 | 4 | 8),
            // Long doubles (12 or 16 bytes) differ from machine to machine and are refused later.
            DtypeKind::Float => self.size > 0,
            _ => true,
        }
    }

    /// Numpy's code for the type, such as `<f4`.
    pub fn code(&self) -> String {
        // Types of single bytes have no byte order.
        let order = match (self.size, self.big_endian) {
            (0 | 1, _) => '|',
            (_, true) => '>',
            (_, false) => '<',
        };
        let (letter, count) = match self.kind {
            DtypeKind::Bool => ('b', self.size),
            DtypeKind::Signed => ('i', self.size),
            DtypeKind::Unsigned => ('u', self.size),
            DtypeKind::Float => ('f', self.size),
            DtypeKind::Text => ('U', self.size / 4),
            DtypeKind::Bytes => ('S', self.size),
            DtypeKind::Object => return "O".into(),
            DtypeKind::Other => return "V".into(),
        };
        format!("{order}{letter}{count}")
    }
}

impl Display for Dtype {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = self.size * 8;
        match self.kind {
            DtypeKind::Bool => write!(f, "bool"),
            DtypeKind::Signed => write!(f, "int{bits}"),
            DtypeKind::Unsigned => write!(f, "uint{bits}"),
            DtypeKind::Float => write!(f, "float{bits}"),
            DtypeKind::Text => write!(f, "text"),
            DtypeKind::Bytes => write!(f, "byte strings"),
            DtypeKind::Object => write!(f, "pickled Python objects"),
            DtypeKind::Other => write!(f, "a structured or complex type"),
        }
    }
}

/// Formats a shape as Python prints it: `(150, 72)`, `(3,)`, `()`.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [only] => format!("({only},)"),
        _ => {
            let extents: Vec<String> = shape.iter().map(usize::to_string).collect();
            format!("({})", extents.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header_of(text: &str) -> io::Result<Header> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        Header::read(&mut bytes.as_slice())
    }

    #[test]
    fn keys_are_found_in_any_order() {
        let header = header_of("{'shape': (3L, 4), \"fortran_order\": True, 'descr': '>i2'}\n");
        let header = header.unwrap();
        assert_eq!((header.shape, header.fortran_order), (vec![3, 4], true));
        assert_eq!(header.dtype.code(), ">i2");
    }

    #[test]
    fn malformed_headers_are_refused() {
        for text in [
            "",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': 1, 'shape': (1,)}",
            "{'descr': '<i3', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': 'é', 'fortran_order': False, 'shape': (1,)",
            "{'fortran_order': False, 'shape': (1,)}",
        ] {
            let read = header_of(text);
            let opaque = matches!(&read, Ok(h) if h.dtype.kind == DtypeKind::Other);
            assert!(read.is_err() || opaque, "{text}");
        }
    }

    #[test]
    fn overflowing_shapes_have_no_size() {
        let huge = header_of("{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)}");
        assert_eq!(huge.unwrap().data_length(), None);
    }

    #[test]
    fn objects_and_structures_are_recognised() {
        for (code, kind) in [
            ("'|O'", DtypeKind::Object),
            ("[('a', '<f4')]", DtypeKind::Other),
            ("'<c16'", DtypeKind::Other),
            ("'<M8[ns]'", DtypeKind::Other),
        ] {
            let text = format!("{{'descr': {code}, 'fortran_order': False, 'shape': (1,)}}");
            assert_eq!(header_of(&text).unwrap().dtype.kind, kind);
        }
    }
}
