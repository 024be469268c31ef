//! Reading `.npz` archives.

use crate::{
    error::{Error, Result},
    formats::refuse_foreign,
    npy::{self, Array, Dim, Element, Header, Source},
};
use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};
use zip::{ZipArchive, read::ZipFile, result::ZipError};

/// Deflate never packs better than 1,032 to 1; a size beyond that is a lie.
const DEFLATE_LIMIT: u64 = 1032;

/// Arrays up to this many bytes may be packed as well as deflate can: masks, motions that stand still.
const SMALL: u64 = 64 << 20;

/// Larger arrays unpack to at most this many bytes for each byte that they are packed into. Skinning weights
/// with a column for each joint, the emptiest numbers that anyone stores, reach 13 at 24 joints and 47 at 300.
const LARGE_LIMIT: u64 = 100;

/// A `.npz` file open for reading; arrays are read when asked for.
#[derive(Debug)]
pub struct Npz {
    path: PathBuf,
    /// Bytes of the whole file.
    length: u64,
    names: Vec<String>,
    archive: ZipArchive<BufReader<File>>,
}

impl Npz {
    /// Reads the directory of an archive.
    ///
    /// # Errors
    /// No such file, no zip archive.
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(Error::io(path, "open"))?;
        let length = file.metadata().map_err(Error::io(path, "read"))?.len();
        let archive = match ZipArchive::new(BufReader::new(file)) {
            Ok(archive) => archive,
            Err(error) => {
                refuse_foreign(path, "an npz archive")?;
                return Err(archive_error(path, error));
            }
        };
        let names = (archive.file_names())
            .filter_map(|name| Some(name.ok()?.strip_suffix(".npy")?.to_string()))
            .collect();
        Ok(Self {
            path: path.to_path_buf(),
            length,
            names,
            archive,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the arrays, in the order of the archive.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether there is an array of this name.
    pub fn contains(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// The first of several names that the archive holds.
    pub fn first_of<'a>(&self, names: &[&'a str]) -> Option<&'a str> {
        names.iter().copied().find(|name| self.contains(name))
    }

    /// Type and shape of an array, without reading its elements.
    ///
    /// # Errors
    /// No such array, a header that is damaged or contradicts the archive, and more than 64 MiB that are packed
    /// more than 100 to 1.
    pub fn header(&mut self, name: &str) -> Result<Header> {
        self.with_entry(name, |source, entry| source.header(entry))
    }

    /// Reads an array whose shape fits `dims`.
    ///
    /// # Errors
    /// No such array, another shape or type, damaged data; as [`Npz::header`].
    pub fn array<T: Element>(&mut self, name: &str, dims: &[Dim]) -> Result<Array<T>> {
        self.with_entry(name, |source, entry| npy::read_array(source, entry, dims))
    }

    /// The same for numbers, none of them NaN or infinite.
    ///
    /// # Errors
    /// As [`Npz::array`], and the first number that is not finite.
    pub fn finite<T: Element + Into<f64>>(&mut self, name: &str, dims: &[Dim]) -> Result<Array<T>> {
        let array = self.array::<T>(name, dims)?;
        match array.data.iter().position(|&x| !x.into().is_finite()) {
            None => Ok(array),
            Some(at) => Err(self.array_error(
                name,
                "finite numbers",
                format!("{} at element {at}", array.data[at].into()),
            )),
        }
    }

    /// A single finite number, whatever its shape: `()`, `(1,)`, `(1, 1)`.
    ///
    /// # Errors
    /// As [`Npz::finite`], and more than one number.
    pub fn number(&mut self, name: &str) -> Result<f64> {
        let rank = self.header(name)?.shape.len();
        let array = self.finite::<f64>(name, &vec![Dim::Is(1); rank])?;
        Ok(array.data[0])
    }

    /// Text, one string an element.
    ///
    /// # Errors
    /// No such array, another type, damaged data; as [`Npz::header`].
    pub fn text(&mut self, name: &str) -> Result<Vec<String>> {
        self.with_entry(name, |source, entry| npy::read_text(source, entry))
    }

    /// An error about one of this file's arrays.
    pub(crate) fn array_error(
        &self,
        array: &str,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Error {
        Error::Array {
            path: self.path.clone(),
            array: array.into(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn with_entry<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(Source<'_>, &mut ZipFile<'_, BufReader<File>>) -> Result<T>,
    ) -> Result<T> {
        if !self.contains(name) {
            let held = self.names.join(", ");
            return Err(Error::content(
                &self.path,
                format!("an array `{name}`"),
                format!("only {}", if held.is_empty() { "none" } else { &held }),
            ));
        }
        let mut entry =
            (self.archive.by_name(&format!("{name}.npy"))).map_err(|e| archive_error(&self.path, e))?;
        let source = Source {
            path: &self.path,
            array: name,
            length: entry.size(),
        };
        // The directory may claim more packed bytes than there are.
        check_packing(source, entry.compressed_size().min(self.length))?;
        let value = read(source, &mut entry)?;
        Ok(value)
    }
}

/// Refuses an array that would unpack to far more than it is packed into, before any of it is unpacked.
///
/// Readers would hold two gigabytes for a file of two megabytes. What is behind the declared size is never
/// unpacked: the entry's reader fails there.
fn check_packing(source: Source<'_>, packed: u64) -> Result<()> {
    let unpacked = source.length;
    let found = || format!("{unpacked} bytes packed into {packed}");
    let deflated = packed.saturating_mul(DEFLATE_LIMIT).saturating_add(DEFLATE_LIMIT);
    if unpacked > deflated {
        return Err(source.error("a size that deflate can reach", found()));
    }
    if unpacked > SMALL.max(packed.saturating_mul(LARGE_LIMIT)) {
        let expected = format!(
            "at most {LARGE_LIMIT} bytes for each packed byte (such an array can be stored uncompressed)"
        );
        return Err(source.error(expected, found()));
    }
    Ok(())
}

fn archive_error(path: &Path, error: ZipError) -> Error {
    match error {
        ZipError::Io(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, "read")(source)
        }
        other => Error::content(path, "an npz archive (zip)", one_line(&other.to_string())),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
