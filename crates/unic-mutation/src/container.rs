//! Container formats: splitting a file into its parts and assembling it again.

use super::{change, random::Random};
use std::io::{Cursor, Read, Write};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// Container format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// No container: the file is one part.
    Plain,
    /// Zip archive, whose checksums hide damaged parts from the reader of the parts.
    Zip,
    /// Safetensors: the length of a header, the header, then numbers.
    Safetensors,
}

/// Damages a file at random; in half of the files, the damage is inside a valid container.
pub(super) fn damaged(container: Container, valid: &[u8], random: &mut Random) -> Vec<u8> {
    let mut parts = Parts::of(container, valid);
    if parts.len() > 1 && random.once_in(2) {
        for _ in 0..=random.below(2) {
            parts.damage(random);
        }
        return parts.bytes();
    }
    let mut bytes = valid.to_vec();
    change::damage(&mut bytes, random);
    bytes
}

/// A named part of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) name: String,
    pub(super) content: Vec<u8>,
}

/// Parts of a file, in their order.
#[derive(Clone)]
pub(super) struct Parts {
    pub(super) container: Container,
    pub(super) parts: Vec<Part>,
}

impl Parts {
    /// Splits a valid file.
    pub(super) fn of(container: Container, valid: &[u8]) -> Self {
        let part = |name: &str, content: &[u8]| Part {
            name: name.to_owned(),
            content: content.to_vec(),
        };
        let parts = match container {
            Container::Plain => vec![part("", valid)],
            Container::Zip => unzipped(valid),
            Container::Safetensors => {
                let length = u64::from_le_bytes(valid[..8].try_into().unwrap()) as usize;
                let (header, data) = valid[8..].split_at(length);
                vec![part("header", header), part("data", data)]
            }
        };
        Self { container, parts }
    }

    pub(super) fn len(&self) -> usize {
        self.parts.len()
    }

    pub(super) fn contents(&self) -> impl Iterator<Item = &[u8]> {
        self.parts.iter().map(|part| part.content.as_slice())
    }

    /// Same parts with another content of one of them.
    pub(super) fn with(&self, part: usize, content: &[u8]) -> Self {
        let mut other = self.clone();
        other.parts[part].content = content.to_vec();
        other
    }

    /// Assembles the file with correct lengths and checksums.
    pub(super) fn bytes(&self) -> Vec<u8> {
        match self.container {
            Container::Plain => self.contents().collect::<Vec<_>>().concat(),
            Container::Zip => zipped(&self.parts),
            Container::Safetensors => {
                let length = self.parts.first().map_or(0, |header| header.content.len()) as u64;
                [&length.to_le_bytes()[..]]
                    .into_iter()
                    .chain(self.contents())
                    .collect::<Vec<_>>()
                    .concat()
            }
        }
    }

    /// Removes a part, exchanges the contents of two parts, or damages one.
    fn damage(&mut self, random: &mut Random) {
        let (a, b) = (random.below(self.len()), random.below(self.len()));
        match random.below(8) {
            0 if self.container == Container::Zip => drop(self.parts.remove(a)),
            1 if a != b => {
                let content = self.parts[a].content.clone();
                self.parts[a].content = std::mem::replace(&mut self.parts[b].content, content);
            }
            _ => {
                // No part is left if all have been removed.
                if let Some(part) = self.parts.get_mut(a) {
                    change::damage(&mut part.content, random);
                }
            }
        }
    }
}

fn unzipped(valid: &[u8]) -> Vec<Part> {
    let mut archive = ZipArchive::new(Cursor::new(valid)).unwrap();
    (0..archive.len())
        .map(|i| {
            let mut entry = archive.by_index(i).unwrap();
            let mut content = Vec::new();
            entry.read_to_end(&mut content).unwrap();
            Part {
                name: entry.name().unwrap().to_string(),
                content,
            }
        })
        .collect()
}

fn zipped(parts: &[Part]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (i, Part { name, content }) in parts.iter().enumerate() {
        // Both methods in turn: readers may treat stored and compressed parts differently.
        let method = [CompressionMethod::Stored, CompressionMethod::Deflated][i % 2];
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(name.as_str(), options).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}
