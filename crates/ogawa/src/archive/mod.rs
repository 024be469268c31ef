//! Alembic archive: a tree of objects with properties that have samples over time.
//!
//! The root group of the container has six children: the version of the layout (i32, 0), the
//! version of the library (i32), the group of the top object, the metadata of the archive, the time
//! samplings, and a table of metadata that headers refer to by index.
//!
//! | group | children |
//! |---|---|
//! | object | its compound property, one group for each child object, the headers of the children |
//! | compound property | one group for each property, the headers of the properties |
//! | scalar property | data for each stored sample: a 16-byte key, then the values |
//! | array property | two data for each stored sample: key and values, then the dimensions |
//!
//! A property stores sample 0 and the samples from the first to the last change.

mod data_type;
mod fields;
mod headers;
mod metadata;
mod object;
mod property;
mod read;
mod sample_writer;
mod time_sampling;
mod tree;
mod write;

pub use data_type::{DataType, Element, Pod};
pub use metadata::Metadata;
pub(crate) use object::find;
pub use object::{Object, ObjectId};
pub use property::{Content, Property, SampleLayout, Samples};
pub use read::Archive;
pub use sample_writer::SampleWriter;
pub use time_sampling::TimeSampling;
pub use write::{ObjectTree, PropertyTree, write_archive};

/// Version of the layout of objects and properties in the container.
pub(crate) const LAYOUT_VERSION: i32 = 0;
/// Version of the library whose files ours are like, as major · 10000 + minor · 100 + patch.
pub(crate) const LIBRARY_VERSION: i32 = 10800;
/// Smallest version of the library that writes this layout.
pub(crate) const MIN_LIBRARY_VERSION: i32 = 9999;
/// Length of the digests at the end of the headers of child objects, bytes.
pub(crate) const HASHES_LENGTH: usize = 32;
/// Length of the key in front of a sample's values, bytes.
pub(crate) const KEY_LENGTH: usize = 16;
/// Index of metadata that follow the header instead of standing in the table.
pub(crate) const INLINE_METADATA: u8 = 0xff;
