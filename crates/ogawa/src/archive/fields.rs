//! Fields of a header, read one after the other.

use crate::error::{Error, Result, excerpt};

/// Bytes of a header and the place in the file that they come from.
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
    /// Offset of the next byte in the file.
    offset: u64,
}

impl<'a> Fields<'a> {
    pub(super) fn new(bytes: &'a [u8], offset: u64) -> Self {
        Self { bytes, offset }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    pub(super) fn u8(&mut self) -> Result<u8> {
        Ok(u8::from_le_bytes(self.array()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// Reads a count whose width is 1, 2 or 4 bytes for the hints 0, 1 and 2.
    pub(super) fn sized(&mut self, hint: u32) -> Result<u32> {
        match hint {
            0 => self.u8().map(u32::from),
            1 => Ok(u32::from(u16::from_le_bytes(self.array()?))),
            2 => self.u32(),
            _ => Err(Error::damaged(
                self.offset,
                "a width of counts from 0 to 2",
                hint.to_string(),
            )),
        }
    }

    pub(super) fn bytes(&mut self, len: usize) -> Result<&'a [u8]> {
        let Some((taken, rest)) = self.bytes.split_at_checked(len) else {
            let expected = format!("{len} bytes of a header");
            return Err(Error::damaged(
                self.offset,
                expected,
                self.bytes.len().to_string(),
            ));
        };
        self.bytes = rest;
        self.offset += len as u64;
        Ok(taken)
    }

    pub(super) fn text(&mut self, len: u32) -> Result<&'a str> {
        let offset = self.offset;
        let bytes = self.bytes(len as usize)?;
        std::str::from_utf8(bytes)
            .map_err(|_| Error::damaged(offset, "text in UTF-8", excerpt(&String::from_utf8_lossy(bytes))))
    }

    /// Reads the name of an object or a property: not empty and without a slash.
    pub(super) fn name(&mut self, len: u32) -> Result<&'a str> {
        let offset = self.offset;
        let name = self.text(len)?;
        match name.is_empty() || name.contains('/') {
            true => Err(Error::damaged(
                offset,
                "a name without a slash",
                format!("`{}`", excerpt(name)),
            )),
            false => Ok(name),
        }
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }
}
