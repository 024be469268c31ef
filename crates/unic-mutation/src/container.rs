//! What keeps the parts of a file together, taken apart and put together again.

use super::{change, random::Random};
use std::io::{Cursor, Read, Write};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// What keeps the parts of a file together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// Nothing.
    Plain,
    /// A zip archive: its checksums hide damaged parts from the reader behind them.
    Zip,
    /// Safetensors: a header whose length stands before it, then numbers.
    Safetensors,
}

/// The file with random damage, half of it inside a sound container.
pub(super) fn damaged(container: Container, sound: &[u8], random: &mut Random) -> Vec<u8> {
    let mut parts = Parts::of(container, sound);
    if parts.len() > 1 && random.once_in(2) {
        for _ in 0..=random.below(2) {
            parts.damage(random);
        }
        return parts.bytes();
    }
    let mut bytes = sound.to_vec();
    change::damage(&mut bytes, random);
    bytes
}

/// The parts of a file by name.
#[derive(Clone)]
pub(super) struct Parts {
    pub(super) container: Container,
    pub(super) parts: Vec<(String, Vec<u8>)>,
}

impl Parts {
    /// Of a sound file.
    pub(super) fn of(container: Container, sound: &[u8]) -> Self {
        let parts = match container {
            Container::Plain => vec![(String::new(), sound.to_vec())],
            Container::Zip => unzipped(sound),
            Container::Safetensors => {
                let length = u64::from_le_bytes(sound[..8].try_into().unwrap()) as usize;
                let (header, data) = sound[8..].split_at(length);
                [("header", header), ("data", data)]
                    .map(|(name, part)| (name.to_owned(), part.to_vec()))
                    .to_vec()
            }
        };
        Self { container, parts }
    }

    pub(super) fn len(&self) -> usize {
        self.parts.len()
    }

    pub(super) fn contents(&self) -> impl Iterator<Item = &[u8]> {
        self.parts.iter().map(|(_, content)| content.as_slice())
    }

    /// The same with another content of one part.
    pub(super) fn with(&self, part: usize, content: &[u8]) -> Self {
        let mut other = self.clone();
        other.parts[part].1 = content.to_vec();
        other
    }

    /// The whole file, its lengths and checksums right.
    pub(super) fn bytes(&self) -> Vec<u8> {
        match self.container {
            Container::Plain => self.contents().collect::<Vec<_>>().concat(),
            Container::Zip => zipped(&self.parts),
            Container::Safetensors => {
                let length = self.parts.first().map_or(0, |(_, header)| header.len()) as u64;
                [&length.to_le_bytes()[..]]
                    .into_iter()
                    .chain(self.contents())
                    .collect::<Vec<_>>()
                    .concat()
            }
        }
    }

    fn damage(&mut self, random: &mut Random) {
        let (a, b) = (random.below(self.len()), random.below(self.len()));
        match random.below(8) {
            0 if self.container == Container::Zip => drop(self.parts.remove(a)),
            1 if a != b => {
                let content = self.parts[a].1.clone();
                self.parts[a].1 = std::mem::replace(&mut self.parts[b].1, content);
            }
            _ => {
                if let Some((_, content)) = self.parts.get_mut(a) {
                    change::damage(content, random);
                }
            }
        }
    }
}

fn unzipped(sound: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(sound)).unwrap();
    (0..archive.len())
        .map(|i| {
            let mut entry = archive.by_index(i).unwrap();
            let mut content = Vec::new();
            entry.read_to_end(&mut content).unwrap();
            (entry.name().unwrap().to_string(), content)
        })
        .collect()
}

fn zipped(parts: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (i, (name, content)) in parts.iter().enumerate() {
        let method = [CompressionMethod::Stored, CompressionMethod::Deflated][i % 2];
        let options = SimpleFileOptions::default().compression_method(method);
        zip.start_file(name.as_str(), options).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}
