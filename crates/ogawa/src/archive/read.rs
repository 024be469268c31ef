//! Reading an archive.

use super::{
    KEY_LENGTH, LAYOUT_VERSION, MIN_LIBRARY_VERSION,
    data_type::{DataType, Element, Pod},
    fields::Fields,
    headers::decode_metadata_table,
    metadata::Metadata,
    object::{Object, ObjectId},
    property::{SampleLayout, Samples},
    time_sampling::TimeSampling,
    tree::TreeReader,
};
use crate::{
    container::{Container, Data, Group},
    error::{Error, Result},
};
use std::{
    fs::File,
    io::{BufReader, Cursor, Read, Seek},
    path::Path,
};

/// Number of children of the root group.
const ROOT_CHILDREN: u64 = 6;

/// Archive that is open for reading. All headers are in memory; samples are read on demand.
#[derive(Debug)]
pub struct Archive<R> {
    container: Container<R>,
    objects: Vec<Object>,
    samplings: Vec<TimeSampling>,
    library_version: i32,
    /// Bytes of the sample that is being read.
    scratch: Vec<u8>,
}

impl Archive<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// No such file, and the errors of [`Archive::new`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let file = File::open(path).map_err(Error::io("open"))?;
        Self::new(BufReader::new(file))
    }
}

impl<'a> Archive<Cursor<&'a [u8]>> {
    /// Opens an archive in memory.
    ///
    /// # Errors
    /// The errors of [`Archive::new`].
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self> {
        Self::new(Cursor::new(bytes))
    }
}

impl<R: Read + Seek> Archive<R> {
    /// Opens an archive and reads all headers.
    ///
    /// # Errors
    /// No Alembic file in an Ogawa container, an unfinished or damaged one, or a failure to read.
    pub fn new(source: R) -> Result<Self> {
        let mut container = Container::new(source)?;
        let root = container.root()?;
        if root.len() < ROOT_CHILDREN {
            let expected = format!("an Alembic archive of {ROOT_CHILDREN} parts");
            return Err(Error::damaged(root.offset(), expected, root.len().to_string()));
        }
        let layout = version(&mut container, root, 0)?;
        let library_version = version(&mut container, root, 1)?;
        if layout != LAYOUT_VERSION || library_version < MIN_LIBRARY_VERSION {
            let expected = format!("layout {LAYOUT_VERSION} of library {MIN_LIBRARY_VERSION} or later");
            let found = format!("layout {layout} of library {library_version}");
            return Err(Error::damaged(root.offset(), expected, found));
        }
        let top = container.group(root, 2)?;
        let mut bytes = Vec::new();
        read_part(&mut container, root, 3, &mut bytes)?;
        let metadata = Metadata::new(&String::from_utf8_lossy(&bytes));
        let offset = read_part(&mut container, root, 4, &mut bytes)?;
        let samplings = decode_samplings(Fields::new(&bytes, offset))?;
        let offset = read_part(&mut container, root, 5, &mut bytes)?;
        let table = decode_metadata_table(Fields::new(&bytes, offset))?;
        let objects = TreeReader::new(&mut container, &table, samplings.len()).read(top, metadata)?;
        Ok(Self {
            container,
            objects,
            samplings,
            library_version,
            scratch: bytes,
        })
    }

    /// Metadata of the archive, such as the program that wrote it under `_ai_Application`.
    pub fn metadata(&self) -> &Metadata {
        &self.object(ObjectId::TOP).metadata
    }

    /// Version of the Alembic library that the file names, as major · 10000 + minor · 100 + patch.
    pub fn library_version(&self) -> i32 {
        self.library_version
    }

    /// Time samplings that properties refer to by index.
    pub fn time_samplings(&self) -> &[TimeSampling] {
        &self.samplings
    }

    /// All objects, parents before their children. The top object comes first.
    pub fn objects(&self) -> impl Iterator<Item = (ObjectId, &Object)> {
        let ids = (0..self.objects.len()).map(ObjectId);
        ids.zip(&self.objects)
    }

    /// Object of an index that comes from this archive.
    ///
    /// # Panics
    /// The index comes from another archive that has more objects.
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.0]
    }

    /// Names of an object and its ancestors, as `/garment/garmentShape`; `/` for the top object.
    pub fn full_name(&self, id: ObjectId) -> String {
        let path: Vec<&Object> = self.ancestry(id).map(|id| self.object(id)).collect();
        match path.len() {
            0 => "/".into(),
            _ => path.iter().rev().flat_map(|object| ["/", &object.name]).collect(),
        }
    }

    /// An object and its ancestors without the top object, from the object upwards.
    pub(crate) fn ancestry(&self, id: ObjectId) -> impl Iterator<Item = ObjectId> {
        std::iter::successors(Some(id), |&id| self.object(id).parent).filter(|&id| id != ObjectId::TOP)
    }

    /// Time of a sample, seconds.
    pub fn time(&self, samples: &Samples, index: u32) -> f64 {
        let sampling = self.samplings.get(samples.sampling as usize);
        sampling.map_or(0.0, |sampling| sampling.time(index))
    }

    /// Index of the sample nearest to a time, seconds; 0 if there are no samples.
    pub fn nearest(&self, samples: &Samples, time: f64) -> u32 {
        let sampling = self.samplings.get(samples.sampling as usize);
        sampling.map_or(0, |sampling| sampling.nearest(time, samples.count))
    }

    /// Reads a sample and replaces the content of `into` by its elements.
    ///
    /// # Errors
    /// Another type, no sample of this index, damaged data, or a failure to read.
    pub fn read<T: Element>(&mut self, samples: &Samples, index: u32, into: &mut Vec<T>) -> Result<()> {
        into.clear();
        let (wanted, found) = (T::TYPE, samples.data_type);
        if wanted.pod != found.pod || ![1, found.extent].contains(&wanted.extent) {
            let expected = format!("samples of type {wanted}");
            return Err(Error::damaged(
                samples.group.offset(),
                expected,
                found.to_string(),
            ));
        }
        // Types of elements are numbers, which have a size.
        let size = wanted.size().unwrap_or(1);
        self.read_values(samples, index)?;
        into.extend(self.scratch.chunks_exact(size).map(T::decode));
        Ok(())
    }

    /// Reads a sample of texts.
    ///
    /// # Errors
    /// Another type, no sample of this index, damaged data, or a failure to read.
    pub fn read_texts(&mut self, samples: &Samples, index: u32) -> Result<Vec<String>> {
        if samples.data_type.pod != Pod::Text {
            let expected = format!("samples of type {:?}", Pod::Text);
            let found = samples.data_type.to_string();
            return Err(Error::damaged(samples.group.offset(), expected, found));
        }
        self.read_values(samples, index)?;
        let texts = self.scratch.split_inclusive(|&byte| byte == 0);
        Ok(texts
            .map(|text| String::from_utf8_lossy(text.strip_suffix(&[0]).unwrap_or(text)).into_owned())
            .collect())
    }

    /// Key of a sample: a digest of its values. Samples without a value have none.
    ///
    /// # Errors
    /// No sample of this index, damaged data, or a failure to read.
    pub fn key(&mut self, samples: &Samples, index: u32) -> Result<Option<[u8; KEY_LENGTH]>> {
        let data = self.sample_data(samples, index)?;
        self.container.read(data, 0, &mut self.scratch)?;
        Ok(self.scratch.first_chunk().copied())
    }

    /// Reads the bytes behind the key into `scratch`, and compares their number with the type.
    fn read_values(&mut self, samples: &Samples, index: u32) -> Result<()> {
        let data = self.sample_data(samples, index)?;
        if data.is_empty() {
            self.scratch.clear();
        } else {
            self.container.read(data, KEY_LENGTH as u64, &mut self.scratch)?;
        }
        let len = self.scratch.len();
        let is_valid = match (samples.data_type.size(), samples.layout) {
            (None, _) => true,
            (Some(size), SampleLayout::Scalar) => len == size,
            (Some(size), SampleLayout::Array) => len.is_multiple_of(size),
        };
        match is_valid {
            true => Ok(()),
            false => Err(wrong_size(data, samples.data_type, len)),
        }
    }

    /// Number of bytes of a sample's values.
    pub(crate) fn value_bytes(&mut self, samples: &Samples, index: u32) -> Result<u64> {
        let data = self.sample_data(samples, index)?;
        Ok(data.len().saturating_sub(KEY_LENGTH as u64))
    }

    fn sample_data(&mut self, samples: &Samples, index: u32) -> Result<Data> {
        if index >= samples.count {
            let expected = match samples.count {
                0 => "no sample, for there is none".into(),
                count => format!("a sample below {count}"),
            };
            return Err(Error::argument("index", expected, index));
        }
        self.container.data(samples.group, samples.child(index))
    }
}

fn wrong_size(data: Data, data_type: DataType, len: usize) -> Error {
    let expected = format!("elements of type {data_type}");
    Error::damaged(data.offset(), expected, format!("{len} bytes"))
}

/// Reads a part of the root group and returns its offset.
fn read_part<R: Read + Seek>(
    container: &mut Container<R>,
    root: Group,
    index: u64,
    into: &mut Vec<u8>,
) -> Result<u64> {
    let data = container.data(root, index)?;
    container.read(data, 0, into)?;
    Ok(data.offset())
}

fn version<R: Read + Seek>(container: &mut Container<R>, root: Group, index: u64) -> Result<i32> {
    let data = container.data(root, index)?;
    let mut bytes = Vec::new();
    container.read(data, 0, &mut bytes)?;
    match <[u8; 4]>::try_from(bytes.as_slice()) {
        Ok(bytes) => Ok(i32::from_le_bytes(bytes)),
        Err(_) => {
            let found = format!("{} bytes", bytes.len());
            Err(Error::damaged(data.offset(), "a version of 4 bytes", found))
        }
    }
}

fn decode_samplings(mut fields: Fields<'_>) -> Result<Vec<TimeSampling>> {
    let mut samplings = Vec::new();
    while !fields.is_empty() {
        samplings.push(TimeSampling::decode(&mut fields)?);
    }
    Ok(samplings)
}
