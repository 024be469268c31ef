//! Reading `.npz` archives.

use crate::{
    error::{Error, Result},
    foreign_formats::refuse_foreign,
    npy::{self, Array, ArraySource, Dim, Element, Header},
};
use glam::Vec3;
use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};
use zip::{ZipArchive, read::ZipFile, result::ZipError};

/// Highest compression ratio of deflate. A larger declared ratio is false.
const DEFLATE_RATIO: u64 = 1032;

/// Size in bytes up to which an array may have any ratio that deflate reaches: masks and motions
/// without movement compress that well.
const SMALL_ARRAY: u64 = 64 << 20;

/// Highest compression ratio of larger arrays. Skinning weights with a column for each joint are
/// the sparsest numbers in use: their ratio is 13 at 24 joints and 47 at 300.
const LARGE_ARRAY_RATIO: u64 = 100;

/// A `.npz` file open for reading. Each array is read on demand.
#[derive(Debug)]
pub struct Npz {
    path: PathBuf,
    /// Size of the file, bytes.
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
        // Other files in the archive are ignored, as numpy does.
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

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the arrays, in the order of the archive.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns whether there is an array of this name.
    pub fn contains(&self, name: &str) -> bool {
        self.names.iter().any(|n| n == name)
    }

    /// Returns the first of several names that the archive holds.
    pub fn first_present<'a>(&self, names: &[&'a str]) -> Option<&'a str> {
        names.iter().copied().find(|name| self.contains(name))
    }

    /// Reads the type and shape of an array, without its elements.
    ///
    /// # Errors
    /// No such array; a header that is damaged or contradicts the archive; an array of more than
    /// 64 MiB with a compression ratio above 100.
    pub fn header(&mut self, name: &str) -> Result<Header> {
        self.with_entry(name, |source, entry| source.header(entry))
    }

    /// Reads an array of the shape `dims`.
    ///
    /// # Errors
    /// Another shape or type, damaged data; those of [`Npz::header`].
    pub fn array<T: Element>(&mut self, name: &str, dims: &[Dim]) -> Result<Array<T>> {
        self.with_entry(name, |source, entry| npy::read_array(source, entry, dims))
    }

    /// Reads an array of finite numbers.
    ///
    /// # Errors
    /// A number that is not finite; those of [`Npz::array`].
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

    /// Reads a finite array of shape (`count`, 3) as points or vectors.
    ///
    /// # Errors
    /// Those of [`Npz::finite`].
    pub fn vectors(&mut self, name: &str, count: Dim) -> Result<Vec<Vec3>> {
        let array = self.finite::<f32>(name, &[count, Dim::Is(3)])?;
        Ok(bytemuck::cast_slice(&array.data).to_vec())
    }

    /// Reads a single finite number from an array of shape `()`, `(1,)`, `(1, 1)`, ...
    ///
    /// # Errors
    /// More than one number; those of [`Npz::finite`].
    pub fn number(&mut self, name: &str) -> Result<f64> {
        // Any number of dimensions, all of extent 1.
        let rank = self.header(name)?.shape.len();
        let array = self.finite::<f64>(name, &vec![Dim::Is(1); rank])?;
        Ok(array.data[0])
    }

    /// Reads an array of text, one string for each element.
    ///
    /// # Errors
    /// Another type, damaged data; those of [`Npz::header`].
    pub fn text(&mut self, name: &str) -> Result<Vec<String>> {
        self.with_entry(name, |source, entry| npy::read_text(source, entry))
    }

    /// Returns an error about one of this file's arrays.
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

    /// Opens the entry of an array, checks its compression ratio and hands it to `read`.
    fn with_entry<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(ArraySource<'_>, &mut ZipFile<'_, BufReader<File>>) -> Result<T>,
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
        let source = ArraySource {
            path: &self.path,
            array: name,
            length: entry.size(),
        };
        // The directory may declare more packed bytes than the file has.
        check_compression(source, entry.compressed_size().min(self.length))?;
        let value = read(source, &mut entry)?;
        Ok(value)
    }
}

/// Refuses an array of an implausible compression ratio (a zip bomb), before any of it is unpacked.
///
/// A file of two megabytes could otherwise take two gigabytes of memory. Bytes behind the declared
/// size are never unpacked: the entry's reader fails there.
fn check_compression(source: ArraySource<'_>, packed: u64) -> Result<()> {
    let unpacked = source.length;
    let found = || format!("{unpacked} bytes packed into {packed}");
    // One ratio more, because the size of tiny entries is rounded up to whole bytes.
    let deflated = packed.saturating_mul(DEFLATE_RATIO).saturating_add(DEFLATE_RATIO);
    if unpacked > deflated {
        return Err(source.error("a size that deflate can reach", found()));
    }
    if unpacked > SMALL_ARRAY.max(packed.saturating_mul(LARGE_ARRAY_RATIO)) {
        let expected = format!(
            "at most {LARGE_ARRAY_RATIO} bytes for each packed byte (such an array can be stored uncompressed)"
        );
        return Err(source.error(expected, found()));
    }
    Ok(())
}

fn archive_error(path: &Path, error: ZipError) -> Error {
    match error {
        // A truncated archive is damaged content and no failure of the system.
        ZipError::Io(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, "read")(source)
        }
        // Messages of the crate `zip` may have several lines.
        other => Error::content(path, "an npz archive (zip)", one_line(&other.to_string())),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
