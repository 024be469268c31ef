//! Numpy's arrays among the objects of a pickle.

use super::machine::{Pickle, PickleNode};
use crate::npy::{Dtype, DtypeKind, decoded};
use std::borrow::Cow;

/// An array of numbers in C order, converted to f64.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Numbers {
    pub(crate) shape: Vec<usize>,
    pub(crate) data: Vec<f64>,
}

impl Numbers {
    /// Converts from Fortran's order, column by column, to C order.
    fn by_rows(self) -> Option<Self> {
        match *self.shape.as_slice() {
            [] | [_] => Some(self),
            [rows, columns] => {
                let places = (0..rows).flat_map(|row| (0..columns).map(move |column| column * rows + row));
                Some(Self {
                    data: places.map(|place| self.data[place]).collect(),
                    shape: self.shape,
                })
            }
            _ => None,
        }
    }
}

impl Pickle<'_> {
    /// Reads the numpy array of an object; `None` if it is no array of numbers. Arrays in Fortran's
    /// order have at most two dimensions.
    ///
    /// Protocols below 5 make arrays by `_reconstruct` and a state, protocol 5 by `_frombuffer`.
    pub(crate) fn numbers(&self, index: usize) -> Option<Numbers> {
        let PickleNode::Object {
            class,
            arguments,
            state,
        } = self.node(index)
        else {
            return None;
        };
        let PickleNode::Global(class) = self.node(*class) else {
            return None;
        };
        // The module's name differs between numpy 1 (`numpy.core`) and 2 (`numpy._core`): only the
        // last part counts.
        let (dtype, shape, bytes, is_by_columns) = match (class.rsplit('.').next()?, state) {
            ("_reconstruct", Some(state)) => match *self.list(*state)? {
                [_, shape, dtype, fortran, bytes] => {
                    (dtype, shape, bytes, self.node(fortran) != &PickleNode::Int(0))
                }
                _ => return None,
            },
            ("_frombuffer", _) => match *self.list(*arguments)? {
                [bytes, dtype, shape, order] => (dtype, shape, bytes, self.text(order)? != "C"),
                _ => return None,
            },
            _ => return None,
        };
        let dtype = self.dtype(dtype)?;
        let shape = self.shape(shape)?;
        let bytes = self.raw(bytes)?;
        let count = shape
            .iter()
            .try_fold(1usize, |n, &extent| n.checked_mul(extent))?;
        // The bytes must be exactly those of the shape: a damaged shape must not cause an
        // allocation.
        let fits = dtype.size > 0 && count.checked_mul(dtype.size)? == bytes.len();
        let data = fits.then(|| decoded(dtype, &bytes))??;
        let numbers = Numbers { shape, data };
        match is_by_columns {
            true => numbers.by_rows(),
            false => Some(numbers),
        }
    }

    /// Returns the state of an object, by which it is filled after it is made.
    pub(crate) fn state(&self, index: usize) -> Option<usize> {
        match self.node(index) {
            PickleNode::Object { state, .. } => *state,
            _ => None,
        }
    }

    fn list(&self, index: usize) -> Option<&[usize]> {
        match self.node(index) {
            PickleNode::List(items) => Some(items),
            _ => None,
        }
    }

    /// Reads a shape: a list of extents.
    pub(crate) fn shape(&self, index: usize) -> Option<Vec<usize>> {
        let extent = |&item: &usize| match self.node(item) {
            PickleNode::Int(extent) => usize::try_from(*extent).ok(),
            _ => None,
        };
        self.list(index)?.iter().map(extent).collect()
    }

    /// Reads an object such as `numpy.dtype("f8", False, True)`, whose state begins with a version
    /// and the byte order.
    fn dtype(&self, index: usize) -> Option<Dtype> {
        let PickleNode::Object { arguments, state, .. } = self.node(index) else {
            return None;
        };
        let name = self.text(*self.list(*arguments)?.first()?)?;
        let order = match state {
            Some(state) => self.text(*self.list(*state)?.get(1)?)?,
            None => "<",
        };
        let (kind, size) = name.split_at_checked(1)?;
        Some(Dtype {
            kind: match kind {
                "f" => DtypeKind::Float,
                "i" => DtypeKind::Signed,
                "u" => DtypeKind::Unsigned,
                "b" => DtypeKind::Bool,
                _ => return None,
            },
            size: size.parse().ok()?,
            big_endian: order == ">",
        })
    }

    /// Reads bytes. In protocol 2, which has no opcode for them, Python 3 writes them as Latin-1
    /// text.
    fn raw(&self, index: usize) -> Option<Cow<'_, [u8]>> {
        match self.node(index) {
            PickleNode::Bytes(range) => Some(Cow::Borrowed(&self.bytes[range.clone()])),
            PickleNode::Object { arguments, .. } => {
                let text = self.text(*self.list(*arguments)?.first()?)?;
                let bytes: Result<Vec<u8>, _> = text.chars().map(|c| u8::try_from(u32::from(c))).collect();
                Some(Cow::Owned(bytes.ok()?))
            }
            _ => None,
        }
    }
}
