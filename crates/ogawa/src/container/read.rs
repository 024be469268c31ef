//! Reading groups and data.

use super::{Child, Data, FROZEN, Group, HEADER_LENGTH, MAGIC, VERSION};
use crate::error::{Error, Result};
use std::io::{Read, Seek, SeekFrom};

/// Place of the offset of the root group, bytes.
const ROOT_ENTRY: u64 = 8;

/// Ogawa file that is open for reading. Children are read on demand.
///
/// Every offset and count is compared with the length of the file before it is used.
#[derive(Debug)]
pub struct Container<R> {
    source: R,
    len: u64,
    root: u64,
}

impl<R: Read + Seek> Container<R> {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// No Ogawa file, an unfinished one, another version, or a failure to read.
    pub fn new(mut source: R) -> Result<Self> {
        let len = source.seek(SeekFrom::End(0)).map_err(Error::io("read"))?;
        if len < HEADER_LENGTH {
            return Err(Error::damaged(
                len,
                "an Ogawa file of at least 16 bytes",
                "the end of the file",
            ));
        }
        let mut container = Self { source, len, root: 0 };
        let mut header = [0; HEADER_LENGTH as usize];
        container.read_at(0, &mut header)?;
        let [o, g, a, w, a2, frozen, major, minor, root @ ..] = header;
        if [o, g, a, w, a2] != *MAGIC {
            return Err(Error::damaged(0, "`Ogawa`", "another file format"));
        }
        if frozen != FROZEN {
            return Err(Error::damaged(
                5,
                "the mark of a finished file, 255",
                frozen.to_string(),
            ));
        }
        if [major, minor] != VERSION {
            return Err(Error::damaged(6, "version 0.1", format!("{major}.{minor}")));
        }
        container.root = u64::from_le_bytes(root);
        Ok(container)
    }

    /// Length of the file, bytes.
    pub fn file_len(&self) -> u64 {
        self.len
    }

    /// Opens the root group.
    ///
    /// # Errors
    /// A group beyond the end of the file, or a failure to read.
    pub fn root(&mut self) -> Result<Group> {
        match Child::decode(self.root) {
            Child::Group(offset) => self.group_at(offset, ROOT_ENTRY),
            Child::Data(_) => Err(Error::damaged(
                ROOT_ENTRY,
                "the offset of a group",
                "the offset of data",
            )),
        }
    }

    /// Opens a child that must be a group.
    ///
    /// # Errors
    /// Data instead of a group, a group beyond the end of the file, or a failure to read.
    pub fn group(&mut self, parent: Group, index: u64) -> Result<Group> {
        match self.child(parent, index)? {
            Child::Group(offset) => self.group_at(offset, entry_offset(parent, index)),
            Child::Data(_) => Err(Error::damaged(entry_offset(parent, index), "a group", "data")),
        }
    }

    /// Opens a child that must be data.
    ///
    /// # Errors
    /// A group instead of data, data beyond the end of the file, or a failure to read.
    pub fn data(&mut self, parent: Group, index: u64) -> Result<Data> {
        match self.child(parent, index)? {
            Child::Data(offset) => self.data_at(offset, entry_offset(parent, index)),
            Child::Group(_) => Err(Error::damaged(entry_offset(parent, index), "data", "a group")),
        }
    }

    /// Reads the entry of a child.
    ///
    /// # Errors
    /// Fewer children than `index` + 1, or a failure to read.
    pub fn child(&mut self, parent: Group, index: u64) -> Result<Child> {
        if index >= parent.len {
            let expected = format!("a group of at least {} children", index.saturating_add(1));
            return Err(Error::damaged(parent.offset, expected, parent.len.to_string()));
        }
        let mut entry = [0; 8];
        self.read_at(entry_offset(parent, index), &mut entry)?;
        Ok(Child::decode(u64::from_le_bytes(entry)))
    }

    /// Reads all bytes of `data` from byte `from` on, and replaces the content of `into` by them.
    ///
    /// # Errors
    /// Fewer bytes than `from`, or a failure to read.
    pub fn read(&mut self, data: Data, from: u64, into: &mut Vec<u8>) -> Result<()> {
        into.clear();
        let Some(len) = data.len.checked_sub(from) else {
            let expected = format!("at least {from} bytes");
            return Err(Error::damaged(data.offset, expected, data.len.to_string()));
        };
        // `data_at` compares the length with that of the file, so that no more is allocated.
        let Ok(len) = usize::try_from(len) else {
            return Err(Error::damaged(
                data.offset,
                "data that fit into memory",
                len.to_string(),
            ));
        };
        into.resize(len, 0);
        self.read_at(data.offset + from, into)
    }

    /// Group at an offset that stands in the file at `entry`.
    fn group_at(&mut self, offset: u64, entry: u64) -> Result<Group> {
        if offset == 0 {
            return Ok(Group::default());
        }
        let len = self.count_at(offset, entry)?;
        if len > (self.len - offset - 8) / 8 {
            return Err(Error::damaged(
                offset,
                "a count of children that end within the file",
                len.to_string(),
            ));
        }
        Ok(Group { offset, len })
    }

    /// Data at an offset that stands in the file at `entry`.
    fn data_at(&mut self, offset: u64, entry: u64) -> Result<Data> {
        if offset == 0 {
            return Ok(Data::default());
        }
        let len = self.count_at(offset, entry)?;
        if len > self.len - offset - 8 {
            let found = len.to_string();
            return Err(Error::damaged(
                offset,
                "a count of bytes that end within the file",
                found,
            ));
        }
        Ok(Data {
            offset: offset + 8,
            len,
        })
    }

    /// Reads the count at the beginning of a child; returns only if its 8 bytes are within the file.
    fn count_at(&mut self, offset: u64, entry: u64) -> Result<u64> {
        // `new` refuses files of fewer than 16 bytes, so that the difference is not negative.
        if offset < HEADER_LENGTH || offset > self.len - 8 {
            let expected = format!("an offset from {HEADER_LENGTH} to {}", self.len - 8);
            return Err(Error::damaged(entry, expected, offset.to_string()));
        }
        let mut bytes = [0; 8];
        self.read_at(offset, &mut bytes)?;
        Ok(u64::from_le_bytes(bytes))
    }

    fn read_at(&mut self, offset: u64, into: &mut [u8]) -> Result<()> {
        (self.source.seek(SeekFrom::Start(offset))).map_err(Error::io("read"))?;
        self.source.read_exact(into).map_err(Error::io("read"))
    }
}

/// Offset of the entry of a child.
fn entry_offset(parent: Group, index: u64) -> u64 {
    // Called with indices below the count of a group that lies within the file.
    parent.offset + 8 + 8 * index
}
