//! Writing the samples of a property.

use super::{
    data_type::{DataType, Element, encode_all},
    headers::{PropertyHeader, SampleHeader},
    metadata::Metadata,
    property::SampleLayout,
};
use crate::{
    container::{Child, ContainerWriter},
    digest::{Digest, chain, digest},
    error::{Error, Result},
};
use std::io::{Seek, Write};

/// Property whose samples are written one at a time.
///
/// Samples that equal the one before are not written again. Memory holds 8 bytes for each sample.
#[derive(Debug)]
pub struct SampleWriter {
    name: Box<str>,
    metadata: Metadata,
    header: SampleHeader,
    /// Places of the samples up to the last change.
    stored: Vec<Child>,
    latest: Option<Stored>,
    /// Digest of all samples.
    digest: Digest,
    scratch: Vec<u8>,
}

/// Sample in the file.
#[derive(Clone, Copy, Debug)]
struct Stored {
    place: Child,
    key: Digest,
    bytes: usize,
}

impl SampleWriter {
    /// Property of elements of type `T`, with the times of a sampling of the archive.
    pub fn new<T: Element>(name: &str, layout: SampleLayout, sampling: u32, metadata: Metadata) -> Self {
        Self::of_type(name, layout, T::TYPE, sampling, metadata)
    }

    /// Property of elements of a type that is known when the program runs.
    pub fn of_type(
        name: &str,
        layout: SampleLayout,
        data_type: DataType,
        sampling: u32,
        metadata: Metadata,
    ) -> Self {
        Self {
            name: name.into(),
            metadata,
            header: SampleHeader {
                layout,
                data_type,
                count: 0,
                changes: None,
                sampling,
                is_homogeneous: true,
            },
            stored: Vec::new(),
            latest: None,
            digest: Digest::default(),
            scratch: Vec::new(),
        }
    }

    /// Number of samples so far.
    pub fn count(&self) -> u32 {
        self.header.count
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn sampling(&self) -> u32 {
        self.header.sampling
    }

    /// Digest of all samples so far.
    pub(super) fn digest(&self) -> Digest {
        self.digest
    }

    /// Adds a sample.
    ///
    /// # Errors
    /// Elements of another plain type; another number of elements than one in a scalar; more
    /// samples than the format can count; the file cannot be written.
    pub fn push<T: Element, W: Write + Seek>(
        &mut self,
        file: &mut ContainerWriter<W>,
        elements: &[T],
    ) -> Result<()> {
        let mut bytes = std::mem::take(&mut self.scratch);
        encode_all(elements, &mut bytes);
        let pushed = match T::TYPE.pod == self.header.data_type.pod {
            true => self.push_bytes(file, &bytes),
            false => Err(Error::argument(
                "elements",
                self.header.data_type.to_string(),
                T::TYPE,
            )),
        };
        self.scratch = bytes;
        pushed
    }

    fn push_bytes<W: Write + Seek>(&mut self, file: &mut ContainerWriter<W>, bytes: &[u8]) -> Result<()> {
        self.check_size(bytes.len())?;
        let count = self.header.count.checked_add(1);
        let Some(count) = count.filter(|&count| count < u32::MAX) else {
            return Err(Error::argument("samples", "at most 4294967294 of them", "more"));
        };
        let key = digest(bytes);
        self.digest = chain(&self.digest, &key);
        match self.latest {
            Some(latest) if (latest.key, latest.bytes) == (key, bytes.len()) => {}
            latest => {
                let place = match bytes {
                    // An empty array has no key either.
                    [] => Child::EMPTY_DATA,
                    _ => file.data(&[&key, bytes])?,
                };
                self.store(latest, place);
                let bytes = bytes.len();
                self.header.is_homogeneous &= latest.is_none_or(|latest| latest.bytes == bytes);
                self.latest = Some(Stored { place, key, bytes });
            }
        }
        self.header.count = count;
        Ok(())
    }

    /// Notes a sample that differs from the one before.
    fn store(&mut self, before: Option<Stored>, place: Child) {
        let index = self.header.count;
        self.header.changes = match (self.header.changes, before) {
            (_, None) => None,
            (None, Some(_)) => Some((index, index)),
            (Some((first, last)), Some(before)) => {
                // Samples between two changes are repeated in the table.
                (last + 1..index).for_each(|_| self.stored.push(before.place));
                Some((first, index))
            }
        };
        self.stored.push(place);
    }

    /// Repeats the latest sample until there are `count`. Changes nothing without a sample.
    pub fn repeat_until(&mut self, count: u32) {
        if self.latest.is_some() {
            self.header.count = self.header.count.max(count);
        }
    }

    fn check_size(&self, bytes: usize) -> Result<()> {
        let data_type = self.header.data_type;
        let expected = match (data_type.size(), self.header.layout) {
            (Some(size), SampleLayout::Scalar) if bytes != size => "one",
            (Some(size), SampleLayout::Array) if !bytes.is_multiple_of(size) => "any number",
            _ => return Ok(()),
        };
        let expected = format!("{expected} of type {data_type}");
        Err(Error::argument("elements", expected, format!("{bytes} bytes")))
    }

    /// Writes the table of samples.
    pub(super) fn finish<W: Write + Seek>(
        self,
        file: &mut ContainerWriter<W>,
    ) -> Result<(PropertyHeader, Child)> {
        let child = match self.header.layout {
            SampleLayout::Scalar => file.group(self.stored.into_iter())?,
            SampleLayout::Array => {
                // The dimensions of an array of one rank follow from its size, and are left empty.
                let len = 2 * self.stored.len();
                let pairs = (0..len).map(|i| match i % 2 {
                    0 => self.stored[i / 2],
                    _ => Child::EMPTY_DATA,
                });
                file.group(pairs)?
            }
        };
        let header = PropertyHeader {
            name: self.name,
            metadata: self.metadata,
            samples: Some(self.header),
        };
        Ok((header, child))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::{
        Archive, ObjectId, ObjectTree, PropertyTree, TimeSampling, property::Changes, write_archive,
    };
    use std::io::Cursor;

    /// Writes and reads back the samples of one property.
    fn round_trip(values: &[i32]) -> (Vec<i32>, Changes, usize) {
        let mut file = ContainerWriter::new(Cursor::new(Vec::new())).unwrap();
        let mut writer = SampleWriter::new::<i32>("v", SampleLayout::Scalar, 0, Metadata::default());
        values.iter().for_each(|v| writer.push(&mut file, &[*v]).unwrap());
        let stored = writer.stored.len();
        let top = ObjectTree {
            properties: vec![PropertyTree::Samples(writer)],
            ..ObjectTree::default()
        };
        let bytes = write_archive(file, top, &[TimeSampling::default()])
            .unwrap()
            .into_inner();
        let mut archive = Archive::from_bytes(&bytes).unwrap();
        let samples = *archive
            .object(ObjectId::TOP)
            .property("v")
            .unwrap()
            .samples()
            .unwrap();
        let mut read = Vec::new();
        let values = (0..samples.count())
            .map(|i| {
                archive.read(&samples, i, &mut read).unwrap();
                read[0]
            })
            .collect();
        (values, samples.changes, stored)
    }

    #[test]
    fn equal_samples_are_stored_once_at_both_ends() {
        for (values, changes, stored) in [
            (vec![], None, 0),
            (vec![5], None, 1),
            (vec![5, 5, 5], None, 1),
            (vec![1, 2, 3], Some((1, 2)), 3),
            (vec![1, 1, 2, 2, 2], Some((2, 2)), 2),
            (vec![1, 1, 2, 2, 1, 1], Some((2, 4)), 4),
        ] {
            assert_eq!(round_trip(&values), (values, changes, stored));
        }
    }
}
