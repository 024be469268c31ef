//! Writing groups and data.

use super::{Child, FROZEN, MAGIC, VERSION};
use crate::error::{Error, Result};
use std::io::{Seek, SeekFrom, Write};

/// Writer of an Ogawa file. Children are written before their groups.
///
/// The file counts as unfinished until [`ContainerWriter::finish`].
#[derive(Debug)]
pub struct ContainerWriter<W> {
    sink: W,
    /// Number of bytes written so far.
    len: u64,
}

impl<W: Write + Seek> ContainerWriter<W> {
    /// Writes the header to an empty file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(sink: W) -> Result<Self> {
        let mut writer = Self { sink, len: 0 };
        writer.write(MAGIC)?;
        writer.write(&[0])?;
        writer.write(&VERSION)?;
        writer.write(&[0; 8])?;
        Ok(writer)
    }

    /// Writes data that consist of several parts. Data without a byte take no space.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn data(&mut self, parts: &[&[u8]]) -> Result<Child> {
        let len: u64 = parts.iter().map(|part| part.len() as u64).sum();
        if len == 0 {
            return Ok(Child::EMPTY_DATA);
        }
        let offset = self.len;
        self.write(&len.to_le_bytes())?;
        parts.iter().try_for_each(|part| self.write(part))?;
        Ok(Child::Data(offset))
    }

    /// Writes a group of children. A group without children takes no space.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn group(&mut self, children: impl ExactSizeIterator<Item = Child>) -> Result<Child> {
        if children.len() == 0 {
            return Ok(Child::EMPTY_GROUP);
        }
        let offset = self.len;
        self.write(&(children.len() as u64).to_le_bytes())?;
        for child in children {
            self.write(&child.encode().to_le_bytes())?;
        }
        Ok(Child::Group(offset))
    }

    /// Writes the offset of the root group and the mark of a finished file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self, root: Child) -> Result<W> {
        let end = self.len;
        self.seek(8)?;
        self.write(&root.encode().to_le_bytes())?;
        // The mark comes last: a file that is cut off by a crash stays unfinished.
        self.seek(5)?;
        self.write(&[FROZEN])?;
        self.seek(end)?;
        self.sink.flush().map_err(Error::io("write"))?;
        Ok(self.sink)
    }

    fn seek(&mut self, offset: u64) -> Result<()> {
        (self.sink.seek(SeekFrom::Start(offset))).map_err(Error::io("write"))?;
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.sink.write_all(bytes).map_err(Error::io("write"))?;
        self.len += bytes.len() as u64;
        Ok(())
    }
}
