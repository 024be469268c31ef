//! Files of motion databases.

use crate::{
    atomic,
    error::{Error, Result},
    foreign_formats::refuse_foreign,
};
use memmap2::Mmap;
use std::{fs::File, path::Path};
use unic_core::motion_matching::{Database, DatabaseFileError};

/// Reads a motion database. The file is mapped, and its arrays are copied once.
///
/// # Errors
/// A file that cannot be read or is no motion database of this version.
pub fn read_motion_database(path: &Path) -> Result<Database> {
    refuse_foreign(path, "a motion database")?;
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    // SAFETY: the map is read before this function returns. Another process that changes the file
    // meanwhile changes the numbers that are read, whose checks come after they are copied; the
    // header is compared with the checksum.
    let map = unsafe { Mmap::map(&file) }.map_err(Error::io(path, "map"))?;
    Database::from_bytes(&map).map_err(|source| refused(path, source))
}

/// Writes a motion database. The file appears complete or not at all.
///
/// # Errors
/// A file that cannot be written.
pub fn write_motion_database(path: &Path, database: &Database) -> Result<()> {
    let bytes = database.to_bytes().map_err(|source| refused(path, source))?;
    atomic::write(path, &bytes)
}

fn refused(path: &Path, source: DatabaseFileError) -> Error {
    Error::MotionDatabase {
        path: path.to_path_buf(),
        source,
    }
}
