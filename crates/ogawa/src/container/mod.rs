//! Ogawa container: a tree of groups and data in one file.
//!
//! All numbers are little-endian, and all offsets count from the start of the file.
//!
//! | offset | type | content |
//! |---|---|---|
//! | 0 | 5 bytes | `Ogawa` |
//! | 5 | u8 | 0xff in a finished file, 0 before |
//! | 6 | u16, big-endian | version, 1 |
//! | 8 | u64 | offset of the root group |
//!
//! A group is a u64 count of children and one u64 for each child: its offset, with the highest bit
//! set for data. Data are a u64 count of bytes and the bytes. Offset 0 means an empty child.

mod read;
mod write;

pub use read::Container;
pub use write::ContainerWriter;

pub(crate) const MAGIC: &[u8; 5] = b"Ogawa";
pub(crate) const FROZEN: u8 = 0xff;
pub(crate) const VERSION: [u8; 2] = [0, 1];
/// Length of the header, bytes.
pub(crate) const HEADER_LENGTH: u64 = 16;

/// Bit of a child's entry that marks data.
const DATA_BIT: u64 = 1 << 63;

/// Entry of a group: the kind and the offset of a child, bytes. Offset 0 is an empty child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// A group of further children.
    Group(u64),
    /// Bytes.
    Data(u64),
}

impl Child {
    /// Child that holds no bytes and takes no space.
    pub const EMPTY_DATA: Self = Self::Data(0);
    /// Group without children, which takes no space.
    pub const EMPTY_GROUP: Self = Self::Group(0);

    pub(crate) fn decode(entry: u64) -> Self {
        match entry & DATA_BIT {
            0 => Self::Group(entry),
            _ => Self::Data(entry & !DATA_BIT),
        }
    }

    pub(crate) fn encode(self) -> u64 {
        match self {
            Self::Group(offset) => offset,
            Self::Data(offset) => offset | DATA_BIT,
        }
    }
}

/// Group whose count of children lies within the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Group {
    pub(crate) offset: u64,
    pub(crate) len: u64,
}

impl Group {
    /// Number of children.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether the group has no children.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Offset of the group in the file, bytes; 0 for an empty group that takes no space.
    pub fn offset(&self) -> u64 {
        self.offset
    }
}

/// Bytes that lie within the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Data {
    pub(crate) offset: u64,
    pub(crate) len: u64,
}

impl Data {
    /// Number of bytes.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there are no bytes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Offset of the first byte in the file.
    pub fn offset(&self) -> u64 {
        self.offset
    }
}
