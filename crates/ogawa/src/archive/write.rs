//! Writing an archive.

use super::{
    HASHES_LENGTH, LAYOUT_VERSION, LIBRARY_VERSION,
    headers::{MetadataTable, ObjectHeader, PropertyHeader},
    metadata::Metadata,
    sample_writer::SampleWriter,
    time_sampling::TimeSampling,
};
use crate::{
    container::{Child, ContainerWriter},
    digest::{Digest, chain, digest},
    error::{Error, Result},
};
use std::io::{Seek, Write};

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
            Self::Samples(samples) => samples.name(),
            Self::Compound { name, .. } => name,
        }
    }

    fn largest_count(&self, sampling: u32) -> u32 {
        match self {
            Self::Samples(samples) if samples.sampling() == sampling => samples.count(),
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
                let sampling = samples.sampling();
                if sampling as usize >= self.samplings {
                    let expected = format!("an index below {}", self.samplings);
                    return Err(Error::argument("sampling", expected, sampling));
                }
                let content = samples.digest();
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
