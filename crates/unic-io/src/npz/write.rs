//! Writing `.npz` archives.

use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
    npy,
};
use std::{
    io::{self, ErrorKind, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};
use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

/// Size in bytes from which an entry gets zip's 64-bit fields. The 32-bit fields reach 4 GiB; half
/// of that leaves room for data that deflate cannot compress and makes a little longer.
const LARGE_ENTRY: u64 = 1 << 31;

/// Writer of a `.npz` file: deflated, atomic, the same bytes for the same arrays.
///
/// Nothing appears under the file's name before [`NpzWriter::finish`].
#[derive(Debug)]
pub struct NpzWriter {
    path: PathBuf,
    zip: ZipWriter<DiscardAfterFailure>,
}

impl NpzWriter {
    /// Starts an archive.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn create(path: &Path) -> Result<Self> {
        Ok(Self {
            path: path.to_path_buf(),
            zip: ZipWriter::new(DiscardAfterFailure {
                file: AtomicFile::create(path)?,
                position: 0,
                failed: false,
            }),
        })
    }

    /// Adds an array of f32.
    ///
    /// # Errors
    /// A shape that does not hold `data`; the file cannot be written.
    pub fn f32s(&mut self, name: &str, shape: &[usize], data: &[f32]) -> Result<()> {
        self.array(name, "<f4", shape, data)
    }

    /// Adds an array of f64.
    ///
    /// # Errors
    /// Those of [`NpzWriter::f32s`].
    pub fn f64s(&mut self, name: &str, shape: &[usize], data: &[f64]) -> Result<()> {
        self.array(name, "<f8", shape, data)
    }

    /// Adds an array of i32.
    ///
    /// # Errors
    /// Those of [`NpzWriter::f32s`].
    pub fn i32s(&mut self, name: &str, shape: &[usize], data: &[i32]) -> Result<()> {
        self.array(name, "<i4", shape, data)
    }

    /// Adds a one-dimensional array of u32.
    ///
    /// # Errors
    /// Those of [`NpzWriter::f32s`].
    pub fn u32s(&mut self, name: &str, data: &[u32]) -> Result<()> {
        self.array(name, "<u4", &[data.len()], data)
    }

    /// Adds a one-dimensional array of bool.
    ///
    /// # Errors
    /// Those of [`NpzWriter::f32s`].
    pub fn bools(&mut self, name: &str, data: &[bool]) -> Result<()> {
        let bytes: Vec<u8> = data.iter().map(|&b| u8::from(b)).collect();
        self.array(name, "|b1", &[data.len()], &bytes)
    }

    /// Adds a one-dimensional array of text, numpy's type `U`.
    ///
    /// # Errors
    /// Those of [`NpzWriter::f32s`].
    pub fn text(&mut self, name: &str, texts: &[String]) -> Result<()> {
        let longest = texts.iter().map(|t| t.chars().count()).max().unwrap_or(0);
        // numpy refuses to map text of no width; one character is what it writes itself.
        let width = longest.max(1);
        let mut units: Vec<u32> = Vec::with_capacity(texts.len() * width);
        for text in texts {
            let end = units.len() + width;
            units.extend(text.chars().map(u32::from));
            // Each text fills `width` code units; zeros at its end are padding.
            units.resize(end, 0);
        }
        let header = npy::header_bytes(&format!("<U{width}"), &[texts.len()]);
        self.entry(name, &header, bytemuck::cast_slice(&units))
    }

    /// Adds an array of f32 whose little-endian bytes come from a reader, without holding them in
    /// memory.
    ///
    /// # Errors
    /// More or fewer bytes than the shape holds; the file cannot be written.
    pub(crate) fn f32s_from(&mut self, name: &str, shape: &[usize], bytes: &mut impl Read) -> Result<()> {
        let expected = 4 * shape.iter().product::<usize>() as u64;
        self.start(name, expected)?;
        let path = self.path.clone();
        let failed = |e| Error::io(&path, "write")(e);
        (self.zip.write_all(&npy::header_bytes("<f4", shape))).map_err(failed)?;
        let found = io::copy(bytes, &mut self.zip).map_err(failed)?;
        if found == expected {
            return Ok(());
        }
        Err(Error::content(
            &path,
            format!("{expected} bytes of frames"),
            found.to_string(),
        ))
    }

    /// Writes the directory and gives the file its final name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<()> {
        let path = self.path;
        let written = self.zip.finish().map_err(|e| write_error(&path, e))?;
        // The directory of a discarded archive was "written" without an error.
        if written.failed {
            let earlier = io::Error::other("an earlier write failed");
            return Err(Error::io(&path, "write")(earlier));
        }
        written.file.finish()
    }

    fn array<T: bytemuck::NoUninit>(
        &mut self,
        name: &str,
        code: &str,
        shape: &[usize],
        data: &[T],
    ) -> Result<()> {
        if shape.iter().product::<usize>() != data.len() {
            let expected = format!("as many elements as shape {} holds", npy::shape_text(shape));
            return Err(Error::Array {
                path: self.path.clone(),
                array: name.into(),
                expected,
                found: data.len().to_string(),
            });
        }
        self.entry(name, &npy::header_bytes(code, shape), bytemuck::cast_slice(data))
    }

    fn entry(&mut self, name: &str, header: &[u8], data: &[u8]) -> Result<()> {
        self.start(name, data.len() as u64)?;
        // Written one after the other: a joint buffer would copy the array.
        for bytes in [header, data] {
            self.zip
                .write_all(bytes)
                .map_err(Error::io(&self.path, "write"))?;
        }
        Ok(())
    }

    fn start(&mut self, name: &str, length: u64) -> Result<()> {
        // The default time stamp is a constant, so that equal arrays give equal bytes.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .large_file(length >= LARGE_ENTRY);
        (self.zip.start_file(format!("{name}.npy"), options)).map_err(|e| write_error(&self.path, e))
    }
}

fn write_error(path: &Path, error: ZipError) -> Error {
    Error::io(path, "write")(match error {
        ZipError::Io(error) => error,
        other => other.into(),
    })
}

/// A file that discards everything after the first failed operation.
///
/// The failure itself is returned to the caller. A `ZipWriter` that is dropped afterwards tries to
/// write its directory. If that failed too, it would print the known failure to stderr once more.
#[derive(Debug)]
struct DiscardAfterFailure {
    file: AtomicFile,
    /// Position in the file, as if no operation had failed. `ZipWriter` computes lengths from it.
    position: u64,
    failed: bool,
}

impl DiscardAfterFailure {
    /// Runs an operation on the file; returns `otherwise` if an earlier one failed.
    fn attempt<T>(
        &mut self,
        otherwise: T,
        action: impl FnOnce(&mut AtomicFile) -> io::Result<T>,
    ) -> io::Result<T> {
        if self.failed {
            return Ok(otherwise);
        }
        let result = action(&mut self.file);
        // An interrupted call is repeated by its caller and is no failure.
        let is_fatal = |e: &io::Error| e.kind() != ErrorKind::Interrupted;
        self.failed = result.as_ref().is_err_and(is_fatal);
        result
    }
}

impl Write for DiscardAfterFailure {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.attempt(bytes.len(), |file| file.write(bytes))?;
        self.position += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt((), AtomicFile::flush)
    }
}

impl Seek for DiscardAfterFailure {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let otherwise = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::Current(way) => self.position.saturating_add_signed(way),
            SeekFrom::End(_) => self.position,
        };
        self.position = self.attempt(otherwise, |file| file.seek(to))?;
        Ok(self.position)
    }
}
