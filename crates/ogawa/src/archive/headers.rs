//! Headers of objects and properties.
//!
//! The first word of a property's header holds, from the lowest bit: kind (2 bits: 0 compound,
//! 1 scalar, 2 or 3 array), width of counts (2 bits), plain type (4 bits), a time sampling follows,
//! first and last change follow, all samples have one length, all samples are equal, extent
//! (8 bits), index of the metadata (8 bits).

use super::{
    INLINE_METADATA,
    data_type::{DataType, Pod},
    fields::Fields,
    metadata::Metadata,
    property::{Changes, SampleLayout},
};
use crate::error::{Error, Result};

const HAS_SAMPLING: u32 = 0x100;
const HAS_CHANGES: u32 = 0x200;
const HOMOGENEOUS: u32 = 0x400;
const CONSTANT: u32 = 0x800;

/// Name and metadata of a child object.
pub(super) struct ObjectHeader {
    pub(super) name: Box<str>,
    pub(super) metadata: Metadata,
}

/// Header of a property. A compound has no samples.
pub(super) struct PropertyHeader {
    pub(super) name: Box<str>,
    pub(super) metadata: Metadata,
    pub(super) samples: Option<SampleHeader>,
}

/// Type, number and changes of samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleHeader {
    pub(super) layout: SampleLayout,
    pub(super) data_type: DataType,
    pub(super) count: u32,
    pub(super) changes: Changes,
    pub(super) sampling: u32,
    /// Whether all samples have the same number of elements.
    pub(super) is_homogeneous: bool,
}

impl ObjectHeader {
    pub(super) fn decode(fields: &mut Fields<'_>, table: &[Metadata]) -> Result<Self> {
        let len = fields.u32()?;
        let name = fields.name(len)?.into();
        let offset = fields.offset();
        let metadata = match fields.u8()? {
            INLINE_METADATA => {
                let len = fields.u32()?;
                inline_metadata(fields, len)?
            }
            index => indexed_metadata(table, index, offset)?,
        };
        Ok(Self { name, metadata })
    }

    pub(super) fn encode(name: &str, metadata: &Metadata, table: &mut MetadataTable, into: &mut Vec<u8>) {
        into.extend_from_slice(&(name.len() as u32).to_le_bytes());
        into.extend_from_slice(name.as_bytes());
        let index = table.index(metadata);
        into.push(index);
        if index == INLINE_METADATA {
            into.extend_from_slice(&(metadata.text().len() as u32).to_le_bytes());
            into.extend_from_slice(metadata.text().as_bytes());
        }
    }
}

impl PropertyHeader {
    pub(super) fn decode(fields: &mut Fields<'_>, table: &[Metadata]) -> Result<Self> {
        let offset = fields.offset();
        let info = fields.u32()?;
        let hint = (info >> 2) & 3;
        let samples = match info & 3 {
            0 => None,
            1 => Some(SampleHeader::decode(fields, info, SampleLayout::Scalar)?),
            _ => Some(SampleHeader::decode(fields, info, SampleLayout::Array)?),
        };
        let len = fields.sized(hint)?;
        let name = fields.name(len)?.into();
        let metadata = match (info >> 20) as u8 {
            INLINE_METADATA => {
                let len = fields.sized(hint)?;
                inline_metadata(fields, len)?
            }
            index => indexed_metadata(table, index, offset)?,
        };
        Ok(Self {
            name,
            metadata,
            samples,
        })
    }

    pub(super) fn encode(&self, table: &mut MetadataTable, into: &mut Vec<u8>) {
        let index = table.index(&self.metadata);
        let (count, sampling) = self.samples.map_or((0, 0), |s| (s.count, s.sampling));
        let lengths = [self.name.len() as u32, self.metadata.text().len() as u32];
        let hint = width_hint(lengths.into_iter().chain([count, sampling]));
        let info = hint << 2 | u32::from(index) << 20 | self.samples.map_or(0, |s| s.info());
        into.extend_from_slice(&info.to_le_bytes());
        if let Some(samples) = self.samples {
            push_sized(into, count, hint);
            if let (true, Some((first, last))) = (info & HAS_CHANGES != 0, samples.changes) {
                push_sized(into, first, hint);
                push_sized(into, last, hint);
            }
            if sampling != 0 {
                push_sized(into, sampling, hint);
            }
        }
        push_sized(into, self.name.len() as u32, hint);
        into.extend_from_slice(self.name.as_bytes());
        if index == INLINE_METADATA {
            push_sized(into, self.metadata.text().len() as u32, hint);
            into.extend_from_slice(self.metadata.text().as_bytes());
        }
    }
}

impl SampleHeader {
    fn decode(fields: &mut Fields<'_>, info: u32, layout: SampleLayout) -> Result<Self> {
        // The header begins with the word of bits that has been read.
        let offset = fields.offset() - 4;
        let hint = (info >> 2) & 3;
        let number = (info >> 4) & 15;
        let Some(pod) = Pod::decode(number) else {
            return Err(Error::damaged(offset, "a type from 0 to 13", number.to_string()));
        };
        let extent = (info >> 12) as u8;
        if extent == 0 {
            return Err(Error::damaged(offset, "an extent of at least 1", "0"));
        }
        let count = fields.sized(hint)?;
        let changes = match info & (HAS_CHANGES | CONSTANT) {
            0 => (1, count.saturating_sub(1)),
            CONSTANT => (0, 0),
            _ => (fields.sized(hint)?, fields.sized(hint)?),
        };
        let changes = match changes {
            (0, 0) => None,
            _ if count < 2 => None,
            (first, last) if first <= last && last < count => Some(changes),
            (first, last) => {
                let expected = format!("ascending indices of changes below {count}");
                return Err(Error::damaged(offset, expected, format!("{first} and {last}")));
            }
        };
        let sampling = match info & HAS_SAMPLING {
            0 => 0,
            _ => fields.sized(hint)?,
        };
        Ok(Self {
            layout,
            data_type: DataType::new(pod, extent),
            count,
            changes,
            sampling,
            is_homogeneous: info & HOMOGENEOUS != 0,
        })
    }

    /// Bits of the first word that depend on the samples.
    fn info(&self) -> u32 {
        let kind = match self.layout {
            SampleLayout::Scalar => 1,
            SampleLayout::Array => 2,
        };
        let changes = match self.changes {
            None => CONSTANT,
            // These are the changes of samples that all differ, which go without saying.
            Some((1, last)) if last + 1 == self.count => 0,
            Some(_) => HAS_CHANGES,
        };
        let sampling = if self.sampling == 0 { 0 } else { HAS_SAMPLING };
        let data_type = self.data_type.pod.encode() << 4 | u32::from(self.data_type.extent) << 12;
        let lengths = if self.is_homogeneous { HOMOGENEOUS } else { 0 };
        kind | data_type | changes | sampling | lengths
    }
}

/// Width of counts that is enough for all of them: 1, 2 or 4 bytes for 0, 1 and 2.
fn width_hint(counts: impl Iterator<Item = u32>) -> u32 {
    match counts.max().unwrap_or_default() {
        0..0x100 => 0,
        0x100..0x1_0000 => 1,
        _ => 2,
    }
}

fn push_sized(into: &mut Vec<u8>, count: u32, hint: u32) {
    let bytes = count.to_le_bytes();
    into.extend_from_slice(&bytes[..1 << hint]);
}

fn inline_metadata(fields: &mut Fields<'_>, len: u32) -> Result<Metadata> {
    // Programs write names of files and users here, not always in UTF-8.
    Ok(Metadata::new(&String::from_utf8_lossy(
        fields.bytes(len as usize)?,
    )))
}

fn indexed_metadata(table: &[Metadata], index: u8, offset: u64) -> Result<Metadata> {
    match table.get(usize::from(index)) {
        Some(metadata) => Ok(metadata.clone()),
        None => {
            let expected = format!("an index of metadata below {}", table.len());
            Err(Error::damaged(offset, expected, index.to_string()))
        }
    }
}

/// Reads the table of metadata. Entry 0 is empty and not in the file.
pub(super) fn decode_metadata_table(mut fields: Fields<'_>) -> Result<Vec<Metadata>> {
    let mut table = vec![Metadata::default()];
    while !fields.is_empty() {
        let len = fields.u8()?;
        table.push(inline_metadata(&mut fields, u32::from(len))?);
    }
    Ok(table)
}

/// Table of metadata that is being written.
#[derive(Debug, Default)]
pub(super) struct MetadataTable(Vec<Metadata>);

impl MetadataTable {
    /// Index of metadata in the table, which may grow.
    fn index(&mut self, metadata: &Metadata) -> u8 {
        /// Largest index of the table; the next one marks metadata behind a header.
        const LAST: usize = INLINE_METADATA as usize - 1;
        let len = metadata.text().len();
        if len == 0 {
            return 0;
        }
        let found = self.0.iter().position(|known| known == metadata);
        match found {
            Some(position) => position as u8 + 1,
            None if len <= usize::from(u8::MAX) && self.0.len() < LAST => {
                self.0.push(metadata.clone());
                self.0.len() as u8
            }
            None => INLINE_METADATA,
        }
    }

    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for metadata in &self.0 {
            bytes.push(metadata.text().len() as u8);
            bytes.extend_from_slice(metadata.text().as_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(header: &PropertyHeader) -> PropertyHeader {
        let mut table = MetadataTable::default();
        let mut bytes = Vec::new();
        header.encode(&mut table, &mut bytes);
        let encoded = table.encode();
        let table = decode_metadata_table(Fields::new(&encoded, 0)).unwrap();
        let mut fields = Fields::new(&bytes, 0);
        let decoded = PropertyHeader::decode(&mut fields, &table).unwrap();
        assert!(fields.is_empty());
        decoded
    }

    #[test]
    fn headers_with_counts_of_every_width_are_read_back() {
        let long = "k=".to_owned() + &"v".repeat(300);
        for (count, changes) in [
            (0, None),
            (1, None),
            (9, Some((1, 8))),
            (9, Some((2, 4))),
            (300, Some((7, 299))),
            (70_000, Some((1, 69_999))),
        ] {
            for text in ["", "a=b", &long] {
                let header = PropertyHeader {
                    name: "P".into(),
                    metadata: Metadata::new(text),
                    samples: Some(SampleHeader {
                        layout: SampleLayout::Array,
                        data_type: DataType::new(Pod::F32, 3),
                        count,
                        changes,
                        sampling: count % 2,
                        is_homogeneous: count != 9,
                    }),
                };
                let read = round_trip(&header);
                let samples = read.samples.unwrap();
                assert_eq!((read.name, read.metadata.text()), (header.name, text));
                assert_eq!((samples.count, samples.changes), (count, changes));
                assert_eq!(samples.sampling, count % 2);
                assert_eq!(samples.is_homogeneous, count != 9);
            }
        }
    }

    #[test]
    fn the_table_of_metadata_has_room_for_254_texts() {
        let mut table = MetadataTable::default();
        for i in 0..300 {
            let index = table.index(&Metadata::new(&i.to_string()));
            assert_eq!(usize::from(index), if i < 254 { i + 1 } else { 255 });
        }
        assert_eq!(table.index(&Metadata::new("253")), 254);
    }
}
