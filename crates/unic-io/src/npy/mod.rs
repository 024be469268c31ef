//! Numpy's array format `.npy`: header, element types, reading and writing.
//!
//! Specification: NEP 1 (`numpy.lib.format`), versions 1.0 to 3.0. Arrays of Python objects
//! (pickles) and structured types are refused.

mod element;
mod header;
mod read;
mod write;

pub use element::Element;
pub(crate) use header::shape_text;
pub use header::{Dtype, DtypeKind, Header};
pub use read::{Array, Dim, read_npy, read_npy_header};
pub(crate) use read::{ArraySource, decoded, read_array, read_text};
pub use write::write_npy;
pub(crate) use write::{header_bytes, padded_header_bytes};
