//! Arrays of glTF files, with every bound checked.

use super::container::Container;
use crate::error::Result;
use gltf::{
    Accessor,
    accessor::{DataType, Dimensions},
};

/// Elements of an accessor as numbers, in one list.
pub(super) struct Numbers {
    /// Numbers, element after element.
    pub(super) values: Vec<f32>,
    /// Number of elements.
    pub(super) count: usize,
}

impl Container {
    /// Reads an accessor of floats or of normalised integers, which become 0 to 1 or −1 to 1.
    ///
    /// # Errors
    /// Another shape than `dimensions`, integers that are not normalised, sparse data, data outside
    /// its buffer, numbers that are not finite.
    pub(super) fn floats(&self, accessor: &Accessor, dimensions: Dimensions) -> Result<Numbers> {
        let elements = self.elements(accessor, dimensions)?;
        let kind = accessor.data_type();
        if kind != DataType::F32 && !accessor.normalized() {
            return Err(self.wrong(accessor, "floats or normalised integers"));
        }
        let mut values = Vec::with_capacity(elements.count.saturating_mul(elements.components));
        for component in elements.components() {
            let value = match kind {
                DataType::F32 => f32::from_le_bytes(word(component)),
                DataType::I8 => (f32::from(byte(component) as i8) / 127.0).max(-1.0),
                DataType::U8 => f32::from(byte(component)) / 255.0,
                DataType::I16 => (f32::from(short(component) as i16) / 32767.0).max(-1.0),
                DataType::U16 => f32::from(short(component)) / 65535.0,
                DataType::U32 => u32::from_le_bytes(word(component)) as f32 / u32::MAX as f32,
            };
            values.push(value);
        }
        match values.iter().all(|value| value.is_finite()) {
            true => Ok(Numbers {
                values,
                count: elements.count,
            }),
            false => Err(self.wrong(accessor, "finite numbers")),
        }
    }

    /// Reads an accessor of unsigned integers.
    ///
    /// # Errors
    /// Another shape than `dimensions`, other types, sparse data, data outside its buffer.
    pub(super) fn integers(&self, accessor: &Accessor, dimensions: Dimensions) -> Result<Vec<u32>> {
        let elements = self.elements(accessor, dimensions)?;
        let decode: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |component| byte(component).into(),
            DataType::U16 => |component| short(component).into(),
            DataType::U32 => |component| u32::from_le_bytes(word(component)),
            DataType::I8 | DataType::I16 | DataType::F32 => {
                return Err(self.wrong(accessor, "unsigned integers"));
            }
        };
        Ok(elements.components().map(decode).collect())
    }

    fn wrong(&self, accessor: &Accessor, expected: &str) -> crate::error::Error {
        let found = format!("{:?} of {:?}", accessor.dimensions(), accessor.data_type());
        self.error(format!("{expected} in accessor {}", accessor.index()), found)
    }

    /// Finds the bytes of an accessor.
    fn elements(&self, accessor: &Accessor, dimensions: Dimensions) -> Result<Elements<'_>> {
        if accessor.dimensions() != dimensions {
            return Err(self.wrong(accessor, &format!("{dimensions:?}")));
        }
        if accessor.sparse().is_some() {
            return Err(self.error(
                format!("plain data in accessor {}", accessor.index()),
                "sparse data",
            ));
        }
        let found = || format!("{} elements", accessor.count());
        let outside = || {
            self.error(
                format!("accessor {} inside its buffer", accessor.index()),
                found(),
            )
        };
        let view = accessor.view().ok_or_else(outside)?;
        let buffer = (self.buffers.get(view.buffer().index())).ok_or_else(outside)?;
        let component = accessor.data_type().size();
        let components = accessor.dimensions().multiplicity();
        let size = component * components;
        let stride = view.stride().unwrap_or(size).max(size);
        let end_of_view = view.offset().checked_add(view.length());
        let start = view.offset().checked_add(accessor.offset());
        let bytes = (start.zip(end_of_view)).and_then(|(start, end)| buffer.get(start..end));
        let bytes = bytes.ok_or_else(outside)?;
        // The last element needs no padding behind it.
        let needed = match accessor.count() {
            0 => Some(0),
            count => (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)),
        };
        match needed {
            Some(needed) if needed <= bytes.len() => Ok(Elements {
                bytes,
                count: accessor.count(),
                stride,
                component,
                components,
            }),
            _ => Err(outside()),
        }
    }
}

/// Bytes of the elements of an accessor, which lie inside their buffer.
struct Elements<'a> {
    bytes: &'a [u8],
    count: usize,
    stride: usize,
    /// Size of a component, bytes.
    component: usize,
    /// Number of components of an element.
    components: usize,
}

impl Elements<'_> {
    /// Bytes of each component of each element.
    fn components(&self) -> impl Iterator<Item = &[u8]> {
        let size = self.component * self.components;
        (0..self.count)
            .filter_map(move |i| self.bytes.get(i * self.stride..i * self.stride + size))
            .flat_map(|element| element.chunks_exact(self.component))
    }
}

// Components have the length of their type, so that the defaults are never taken.
fn byte(component: &[u8]) -> u8 {
    component.first().copied().unwrap_or_default()
}

fn short(component: &[u8]) -> u16 {
    u16::from_le_bytes(component.first_chunk().copied().unwrap_or_default())
}

fn word(component: &[u8]) -> [u8; 4] {
    component.first_chunk().copied().unwrap_or_default()
}
