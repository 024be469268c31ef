//! A minimal GLB reader: chunks, accessors, channels.

use glam::Vec3;
use serde_json::Value;

/// A parsed file.
pub(crate) struct Glb {
    pub(crate) json: Value,
    pub(crate) binary: Vec<u8>,
}

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

impl Glb {
    /// Parses a file and checks its headers: §4.4 of the specification.
    pub(crate) fn parse(bytes: &[u8]) -> Self {
        assert_eq!(
            (&bytes[..4], word(bytes, 4), word(bytes, 8)),
            (&b"glTF"[..], 2, bytes.len())
        );
        let (json_length, json_end) = (word(bytes, 12), 20 + word(bytes, 12));
        assert_eq!((&bytes[16..20], json_length % 4), (&b"JSON"[..], 0));
        let binary_length = word(bytes, json_end);
        assert_eq!(
            (&bytes[json_end + 4..json_end + 8], binary_length % 4),
            (&b"BIN\0"[..], 0)
        );
        assert_eq!(json_end + 8 + binary_length, bytes.len());
        Self {
            json: serde_json::from_slice(&bytes[20..json_end]).unwrap(),
            binary: bytes[json_end + 8..].to_vec(),
        }
    }

    /// Accessor of an attribute.
    pub(crate) fn attribute(&self, mesh: usize, name: &str) -> Option<usize> {
        let attributes = &self.json["meshes"][mesh]["primitives"][0]["attributes"];
        attributes.get(name).map(number)
    }

    /// Node, path and output accessor of every channel of the animation.
    pub(crate) fn channels(&self) -> Vec<(usize, String, usize)> {
        let animation = &self.json["animations"][0];
        let channel = |channel: &Value| {
            let sampler = &animation["samplers"][number(&channel["sampler"])];
            let target = &channel["target"];
            let path = target["path"].as_str().unwrap().to_owned();
            (number(&target["node"]), path, number(&sampler["output"]))
        };
        animation["channels"]
            .as_array()
            .unwrap()
            .iter()
            .map(channel)
            .collect()
    }

    /// Elements of an accessor, converted to f32. All integers of the tests are exact in f32.
    pub(crate) fn rows(&self, accessor: usize) -> Vec<Vec<f32>> {
        let accessor = &self.json["accessors"][accessor];
        let view = &self.json["bufferViews"][number(&accessor["bufferView"])];
        let start = number(&view["byteOffset"]) + offset(accessor);
        let (size, component) = (element_size(accessor), component_size(accessor));
        let bytes = &self.binary[start..start + size * number(&accessor["count"])];
        let value = |bytes: &[u8]| match number(&accessor["componentType"]) {
            5121 => f32::from(bytes[0]),
            5123 => f32::from(u16::from_le_bytes(bytes.try_into().unwrap())),
            5125 => word(bytes, 0) as f32,
            _ => f32::from_le_bytes(bytes.try_into().unwrap()),
        };
        let row = |row: &[u8]| row.chunks_exact(component).map(value).collect();
        bytes.chunks_exact(size).map(row).collect()
    }

    pub(crate) fn vectors(&self, accessor: usize) -> Vec<Vec3> {
        self.rows(accessor)
            .iter()
            .map(|row| Vec3::from_slice(row))
            .collect()
    }
}

pub(crate) fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

pub(crate) fn indices(value: &Value) -> Vec<usize> {
    value.as_array().into_iter().flatten().map(number).collect()
}

/// Offset of an accessor in its view.
pub(crate) fn offset(accessor: &Value) -> usize {
    accessor.get("byteOffset").map_or(0, number)
}

fn component_size(accessor: &Value) -> usize {
    match number(&accessor["componentType"]) {
        5121 => 1,
        5123 => 2,
        5125 | 5126 => 4,
        other => panic!("component type {other}"),
    }
}

pub(crate) fn element_size(accessor: &Value) -> usize {
    let components = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        other => panic!("type {other}"),
    };
    components * component_size(accessor)
}
