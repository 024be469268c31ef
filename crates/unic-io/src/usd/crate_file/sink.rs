//! Bytes of a crate file in the order of their places.

use super::value::{ArrayType, Value};
use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use std::{
    io::{Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

const MAGIC: &[u8; 8] = b"PXR-USDC";
/// Version 0.8.0; the last five bytes are not in use.
const VERSION: [u8; 8] = [0, 8, 0, 0, 0, 0, 0, 0];
/// Bytes before the first value.
const START_BYTES: u64 = 88;
/// Place of the place of the table of contents.
const CONTENTS_OFFSET: u64 = 16;

/// A crate file that is being written. It appears when it is complete.
#[derive(Debug)]
pub(super) struct Sink {
    path: PathBuf,
    file: AtomicFile,
    /// Place of the next byte.
    place: u64,
}

impl Sink {
    /// Starts a file with room for its start.
    pub(super) fn create(path: &Path) -> Result<Self> {
        let mut sink = Self {
            path: path.to_path_buf(),
            file: AtomicFile::create(path)?,
            place: 0,
        };
        sink.bytes(MAGIC)?;
        sink.bytes(&VERSION)?;
        sink.bytes(&[0; (START_BYTES - CONTENTS_OFFSET) as usize])?;
        Ok(sink)
    }

    /// Place of the next byte.
    pub(super) fn place(&self) -> u64 {
        self.place
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        (self.file.write_all(bytes)).map_err(Error::io(&self.path, "write"))?;
        self.place += bytes.len() as u64;
        Ok(())
    }

    /// Writes numbers, little-endian as in memory.
    pub(super) fn numbers<T: bytemuck::NoUninit>(&mut self, numbers: &[T]) -> Result<()> {
        self.bytes(bytemuck::cast_slice(numbers))
    }

    /// Writes zeros up to a place that is a multiple of 8.
    pub(super) fn align(&mut self) -> Result<()> {
        let zeros = self.place.next_multiple_of(8) - self.place;
        self.bytes(&[0; 8][..zeros as usize])
    }

    /// Writes an array. Its elements have the layout of `of`.
    pub(super) fn array<T: bytemuck::NoUninit>(&mut self, of: ArrayType, elements: &[T]) -> Result<Value> {
        if elements.is_empty() {
            return Ok(Value::empty(of));
        }
        self.align()?;
        let place = self.place;
        self.numbers(&[elements.len() as u64])?;
        self.numbers(elements)?;
        Ok(Value::array(of, place))
    }

    pub(super) fn double(&mut self, value: f64) -> Result<Value> {
        self.align()?;
        let place = self.place;
        self.numbers(&[value])?;
        Ok(Value::double(place))
    }

    pub(super) fn doubles(&mut self, values: &[f64]) -> Result<Value> {
        self.align()?;
        let place = self.place;
        self.numbers(&[values.len() as u64])?;
        self.numbers(values)?;
        Ok(Value::doubles(place))
    }

    /// Writes a list of tokens by their indices.
    pub(super) fn tokens(&mut self, tokens: &[u32]) -> Result<Value> {
        self.align()?;
        let place = self.place;
        self.numbers(&[tokens.len() as u64])?;
        self.numbers(tokens)?;
        Ok(Value::tokens(place))
    }

    /// Writes time samples: the values at `times`, both of which are in the file.
    pub(super) fn time_samples(&mut self, times: Value, values: &[Value]) -> Result<Value> {
        // The distance to what follows nested values, of which there are none.
        const NEXT: u64 = 8;
        self.align()?;
        let place = self.place;
        self.numbers(&[NEXT, times.0, NEXT, values.len() as u64])?;
        let values: Vec<u64> = values.iter().map(|value| value.0).collect();
        self.numbers(&values)?;
        Ok(Value::time_samples(place))
    }

    /// Gives the file its name. The table of contents is at `contents`.
    pub(super) fn finish(mut self, contents: u64) -> Result<()> {
        (self.file.seek(SeekFrom::Start(CONTENTS_OFFSET))).map_err(Error::io(&self.path, "write"))?;
        self.numbers(&[contents])?;
        self.file.finish()
    }
}
