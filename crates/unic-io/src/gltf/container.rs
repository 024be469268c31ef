//! Files of glTF: the JSON document and its buffers.

use crate::{
    atomic::parent_folder,
    error::{Error, Result},
};
use gltf::{
    Document,
    buffer::Source,
    json::{self, Root, mesh::Semantic, validation::Checked},
};
use std::path::{Component, Path, PathBuf};

/// First bytes of a binary file.
const MAGIC: &[u8] = b"glTF";
/// Length of the header of a binary file and of a chunk's header, bytes.
const HEADER_LENGTH: usize = 12;
const CHUNK_HEADER_LENGTH: usize = 8;
const JSON_CHUNK: &[u8] = b"JSON";
const BINARY_CHUNK: &[u8] = b"BIN\0";

/// Start of a URI whose data is part of it.
const DATA_URI: &str = "data:";

/// A document with the bytes of its buffers.
#[derive(Debug)]
pub(super) struct Container {
    pub(super) path: PathBuf,
    pub(super) document: Document,
    /// Bytes of each buffer.
    pub(super) buffers: Vec<Vec<u8>>,
    /// Bytes of the document and its buffers: what memory may be in proportion to.
    pub(super) length: usize,
}

/// Reads the JSON document of a file, without its buffers.
///
/// # Errors
/// No such file, damaged headers.
pub(super) fn document_bytes(path: &Path) -> Result<Vec<u8>> {
    let bytes = std::fs::read(path).map_err(Error::io(path, "open"))?;
    match bytes.starts_with(MAGIC) {
        true => Ok(chunks(path, &bytes)?.0.to_vec()),
        false => Ok(bytes),
    }
}

impl Container {
    /// Reads a `.glb` or `.gltf` file, with buffers in files beside it.
    ///
    /// # Errors
    /// No such file, damaged JSON, indices out of range, extensions that are required and not known,
    /// buffers that are missing or too short.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path, "open"))?;
        let (json, binary) = match bytes.starts_with(MAGIC) {
            true => chunks(path, &bytes)?,
            false => (bytes.as_slice(), None),
        };
        // The document alone: the crate's own reader of binary files copies the buffer.
        let invalid = |found: String| Error::content(path, "a glTF document", found);
        let root: Root =
            json::deserialize::from_slice(json).map_err(|e| invalid(one_line(&e.to_string())))?;
        check_indices(&root).map_err(invalid)?;
        let document = Document::from_json(root).map_err(|e| invalid(sentence(&e)))?;
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                Source::Bin => binary.unwrap_or_default().to_vec(),
                Source::Uri(uri) => resource(path, uri)?,
            };
            if bytes.len() < buffer.length() {
                let expected = format!("{} bytes in buffer {}", buffer.length(), buffer.index());
                return Err(Error::content(path, expected, bytes.len().to_string()));
            }
            buffers.push(bytes);
        }
        Ok(Self {
            path: path.to_path_buf(),
            length: json.len() + buffers.iter().map(Vec::len).sum::<usize>(),
            document,
            buffers,
        })
    }

    /// Returns an error about the content of the file.
    pub(super) fn error(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::content(&self.path, expected, found)
    }
}

/// One line about an error of crate `gltf`, whose own text has quotations and several lines.
fn sentence(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Validation(faults) => match faults.first() {
            Some((place, fault)) => format!("{place}: {fault}"),
            None => "an invalid one".to_owned(),
        },
        other => one_line(&other.to_string()),
    }
}

fn one_line(text: &str) -> String {
    text.lines().collect::<Vec<_>>().join(", ")
}

/// Checks what crate `gltf` 1.4.1 takes for granted: the accessor of positions before its own
/// checks, and the targets of animations after them. `Err` holds the fault.
fn check_indices(root: &Root) -> std::result::Result<(), String> {
    let positions = Checked::Valid(Semantic::Positions);
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let is_outside =
        |index: usize, count: usize| (index >= count).then(|| format!("index {index} of {count}"));
    let position = |primitive: &json::mesh::Primitive| {
        let accessor = primitive.attributes.get(&positions)?;
        is_outside(accessor.value(), root.accessors.len())
    };
    if let Some(fault) = primitives.find_map(position) {
        return Err(format!("positions at {fault}"));
    }
    let mut channels = root.animations.iter().flat_map(|animation| &animation.channels);
    let target = |channel: &json::animation::Channel| match &channel.target.path {
        Checked::Invalid => Some("an unknown property".to_owned()),
        Checked::Valid(_) => is_outside(channel.target.node.value(), root.nodes.len()),
    };
    match channels.find_map(target) {
        Some(fault) => Err(format!("an animation of {fault}")),
        None => Ok(()),
    }
}

/// Splits a binary file into the JSON and the first binary chunk.
fn chunks<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let error = |found: &str| Error::content(path, "a binary glTF file of version 2", found);
    let word = |at: usize| -> Option<u32> {
        let word = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*word))
    };
    match word(4) {
        Some(2) => {}
        Some(other) => return Err(error(&format!("version {other}"))),
        None => return Err(error("a file that is cut short")),
    }
    // The total length in the header is ignored: each chunk has its own.
    let chunk = |at: usize| -> Option<(&'a [u8], &'a [u8])> {
        let length = usize::try_from(word(at)?).ok()?;
        let start = at.checked_add(CHUNK_HEADER_LENGTH)?;
        let name = bytes.get(at.checked_add(4)?..start)?;
        Some((name, bytes.get(start..start.checked_add(length)?)?))
    };
    let Some((JSON_CHUNK, json)) = chunk(HEADER_LENGTH) else {
        return Err(error("no complete JSON chunk"));
    };
    let next = HEADER_LENGTH + CHUNK_HEADER_LENGTH + json.len();
    match chunk(next) {
        Some((BINARY_CHUNK, binary)) => Ok((json, Some(binary))),
        // Chunks of other kinds are of extensions.
        Some(_) => Ok((json, None)),
        None if next >= bytes.len() => Ok((json, None)),
        None => Err(error("a binary chunk that is cut short")),
    }
}

/// Reads a buffer outside the document: a file beside it, or base64 in the URI.
fn resource(path: &Path, uri: &str) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix(DATA_URI) {
        let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
        let decoded = encoded.and_then(decode_base64);
        return decoded.ok_or_else(|| Error::content(path, "a buffer in base64", "other data"));
    }
    let name = percent_decoded(uri);
    // A file that comes from elsewhere must not make the program read other files.
    let is_beside = Path::new(&name)
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !is_beside || name.contains(':') {
        return Err(Error::content(path, "buffers in files beside it", name));
    }
    let buffer = parent_folder(path).join(name);
    std::fs::read(&buffer).map_err(Error::io(&buffer, "open"))
}

/// Replaces `%20` and the like by their bytes.
fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let code = (bytes.get(at + 1..at + 3))
            .and_then(|digits| std::str::from_utf8(digits).ok())
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match (byte, code) {
            (b'%', Some(code)) => {
                decoded.push(code);
                at += 3;
            }
            _ => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

/// Decodes base64 (RFC 4648, section 4); None if the text has other characters.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for group in text.chunks(4) {
        let mut bits = 0_u32;
        for &character in group {
            bits = bits << 6 | u32::from(base64_digit(character)?);
        }
        // A last group of two or three characters has one or two bytes.
        bits <<= 6 * (4 - group.len());
        decoded.extend_from_slice(bits.to_be_bytes().get(1..group.len())?);
    }
    Some(decoded)
}

fn base64_digit(character: u8) -> Option<u8> {
    match character {
        b'A'..=b'Z' => Some(character - b'A'),
        b'a'..=b'z' => Some(character - b'a' + 26),
        b'0'..=b'9' => Some(character - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc_is_decoded() {
        for (text, expected) in [
            ("", &b""[..]),
            ("Zg==", b"f"),
            ("Zm8=", b"fo"),
            ("Zm9v", b"foo"),
            ("Zm9vYg==", b"foob"),
            ("Zm9vYmE=", b"fooba"),
            ("Zm9vYmFy", b"foobar"),
            ("+/8=", b"\xfb\xff"),
        ] {
            assert_eq!(decode_base64(text).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(decode_base64("Zm9*"), None);
    }

    #[test]
    fn names_of_buffers_stay_beside_the_file() {
        assert_eq!(percent_decoded("a%20b%zz%2"), "a b%zz%2");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gltf");
        std::fs::write(folder.path().join("b c.bin"), b"xyz").unwrap();
        assert_eq!(resource(&path, "b%20c.bin").unwrap(), b"xyz");
        for uri in [
            "../b.bin",
            "/etc/passwd",
            "file:///etc/passwd",
            "c:b.bin",
            "%2e%2e/b",
        ] {
            let message = resource(&path, uri).unwrap_err().to_string();
            assert!(message.contains("beside it"), "{message}");
        }
    }
}
