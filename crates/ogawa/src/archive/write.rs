//! Writing an archive.

use super::{
    HASHES_LENGTH, LAYOUT_VERSION, LIBRARY_VERSION,
    data_type::{DataType, Element, encode_all},
    headers::{MetadataTable, ObjectHeader, PropertyHeader, SampleHeader},
    metadata::Metadata,
    property::SampleLayout,
    time_sampling::TimeSampling,
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
    fn finish<W: Write + Seek>(self, file: &mut ContainerWriter<W>) -> Result<(PropertyHeader, Child)> {
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

/// Property that is being written.
#[derive(Debug)]
pub enum PropertyTree {
    /// Values over time.
    Samples(SampleWriter),
    /// Further properties.
    Compound {
        /// Name, unique among its neighbours.
        name: Box<str>,
        /// Metadata.
        metadata: Metadata,
        /// Properties.
        properties: Vec<PropertyTree>,
    },
}

impl PropertyTree {
    /// Group of properties.
    pub fn compound(name: &str, metadata: Metadata, properties: Vec<Self>) -> Self {
        Self::Compound {
            name: name.into(),
            metadata,
            properties,
        }
    }

    fn name(&self) -> &str {
        match self {
            Self::Samples(samples) => &samples.name,
            Self::Compound { name, .. } => name,
        }
    }

    fn largest_count(&self, sampling: u32) -> u32 {
        match self {
            Self::Samples(samples) if samples.header.sampling == sampling => samples.header.count,
            Self::Samples(_) => 0,
            Self::Compound { properties, .. } => {
                let counts = properties.iter().map(|property| property.largest_count(sampling));
                counts.max().unwrap_or(0)
            }
        }
    }
}

/// Object that is being written.
#[derive(Debug, Default)]
pub struct ObjectTree {
    /// Name, unique among its siblings and without a slash. That of the top object is ignored.
    pub name: Box<str>,
    /// Metadata. Those of the top object are the metadata of the archive.
    pub metadata: Metadata,
    /// Properties.
    pub properties: Vec<PropertyTree>,
    /// Child objects.
    pub children: Vec<ObjectTree>,
}

impl ObjectTree {
    fn largest_count(&self, sampling: u32) -> u32 {
        let properties = self.properties.iter().map(|p| p.largest_count(sampling));
        let children = self.children.iter().map(|c| c.largest_count(sampling));
        properties.chain(children).max().unwrap_or(0)
    }
}

/// Writes all headers and tables of an archive, whose samples are in `file`, and completes it.
///
/// Properties name their times by an index into `samplings`.
///
/// # Errors
/// A name that is empty, has a slash or occurs twice; a property with a sampling that does not
/// exist; the file cannot be written.
pub fn write_archive<W: Write + Seek>(
    mut file: ContainerWriter<W>,
    top: ObjectTree,
    samplings: &[TimeSampling],
) -> Result<W> {
    let archive_metadata = top.metadata.clone();
    let mut encoded_samplings = Vec::new();
    for (index, sampling) in (0..).zip(samplings) {
        sampling.encode(top.largest_count(index), &mut encoded_samplings);
    }
    let mut writer = TreeWriter {
        file: &mut file,
        table: MetadataTable::default(),
        samplings: samplings.len(),
    };
    let (top, _) = writer.object(top)?;
    let table = writer.table.encode();
    let parts = [
        file.data(&[&LAYOUT_VERSION.to_le_bytes()])?,
        file.data(&[&LIBRARY_VERSION.to_le_bytes()])?,
        top,
        file.data(&[archive_metadata.text().as_bytes()])?,
        file.data(&[&encoded_samplings])?,
        file.data(&[&table])?,
    ];
    let root = file.group(parts.into_iter())?;
    file.finish(root)
}

/// Writer of objects and properties, children before their parents.
struct TreeWriter<'a, W> {
    file: &'a mut ContainerWriter<W>,
    table: MetadataTable,
    samplings: usize,
}

impl<W: Write + Seek> TreeWriter<'_, W> {
    /// Writes an object and returns its place and its digest.
    ///
    /// Readers compare digests to find equal objects in an archive. Those of the Alembic library
    /// are of another kind, SpookyHash; nothing compares them between archives.
    fn object(&mut self, object: ObjectTree) -> Result<(Child, Digest)> {
        check_names(object.children.iter().map(|child| &*child.name))?;
        let (properties, properties_digest) = self.compound(object.properties)?;
        let mut children = vec![properties];
        let mut headers = Vec::new();
        // An object without children has zeros here.
        let mut children_digest = Digest::default();
        for child in object.children {
            ObjectHeader::encode(&child.name, &child.metadata, &mut self.table, &mut headers);
            let (place, digest) = self.object(child)?;
            children.push(place);
            children_digest = chain(&children_digest, &digest);
        }
        let mut hashes = [0; HASHES_LENGTH];
        hashes[..16].copy_from_slice(&properties_digest);
        hashes[16..].copy_from_slice(&children_digest);
        children.push(self.file.data(&[&headers, &hashes])?);
        let place = self.file.group(children.into_iter())?;
        Ok((place, digest(&hashes)))
    }

    /// Writes properties and returns their place and their digest.
    fn compound(&mut self, properties: Vec<PropertyTree>) -> Result<(Child, Digest)> {
        check_names(properties.iter().map(PropertyTree::name))?;
        let mut children = Vec::new();
        let mut headers = Vec::new();
        let mut all = Digest::default();
        for property in properties {
            let start = headers.len();
            let (header, place, content) = self.property(property)?;
            header.encode(&mut self.table, &mut headers);
            children.push(place);
            all = chain(&all, &chain(&digest(&headers[start..]), &content));
        }
        if !headers.is_empty() {
            children.push(self.file.data(&[&headers])?);
        }
        Ok((self.file.group(children.into_iter())?, all))
    }

    fn property(&mut self, property: PropertyTree) -> Result<(PropertyHeader, Child, Digest)> {
        match property {
            PropertyTree::Samples(samples) => {
                let sampling = samples.header.sampling;
                if sampling as usize >= self.samplings {
                    let expected = format!("an index below {}", self.samplings);
                    return Err(Error::argument("sampling", expected, sampling));
                }
                let content = samples.digest;
                let (header, place) = samples.finish(self.file)?;
                Ok((header, place, content))
            }
            PropertyTree::Compound {
                name,
                metadata,
                properties,
            } => {
                let (place, content) = self.compound(properties)?;
                let header = PropertyHeader {
                    name,
                    metadata,
                    samples: None,
                };
                Ok((header, place, content))
            }
        }
    }
}

/// Refuses names that are empty, have a slash, or occur twice among neighbours.
fn check_names<'a>(names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut sorted: Vec<&str> = names.collect();
    sorted.sort_unstable();
    let is_invalid = |name: &&str| name.is_empty() || name.contains(['/', '\0']);
    let invalid = sorted.iter().copied().find(is_invalid);
    let twice = sorted.windows(2).find(|pair| pair[0] == pair[1]);
    match (invalid, twice) {
        (None, None) => Ok(()),
        (Some(name), _) => Err(Error::argument("name", "a text without a slash", name)),
        (_, Some(pair)) => Err(Error::argument("name", "different names of neighbours", pair[0])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::{Archive, ObjectId, property::Changes};
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
