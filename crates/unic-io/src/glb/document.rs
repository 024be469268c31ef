//! The JSON chunk, and the file around both chunks.

use super::{
    binary::{Binary, Chunk, Usage},
    body::SkinnedMesh,
    json::*,
    shapes::MorphedMesh,
    tracks::Tracks,
};
use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use serde_json::{Value, json};
use std::{
    io::{self, Write},
    path::Path,
};

/// Everything that a file is made of.
pub(super) struct Document {
    pub(super) name: String,
    pub(super) fps: f32,
    pub(super) body: SkinnedMesh,
    pub(super) garment: MorphedMesh,
    pub(super) tracks: Tracks,
}

impl Document {
    /// Writes the file under its own name.
    ///
    /// # Errors
    /// The file cannot be written, or would be larger than the format can say.
    pub(super) fn write(self, path: &Path, mut binary: Binary) -> Result<()> {
        let animation = self.animation(&mut binary)?;
        let mut chunk = binary.finish()?;
        let root = self.root(animation, &mut chunk);
        let mut document = serde_json::to_vec(&root).map_err(|e| Error::io(path, "write")(e.into()))?;
        document.resize(document.len().next_multiple_of(4), b' ');
        let header = header(path, document.len() as u64, chunk.length)?;
        let mut file = AtomicFile::create(path)?;
        write_chunks(&mut file, &header, &document, &mut chunk).map_err(Error::io(path, "write"))?;
        file.finish()
    }

    /// Joint j is node j; these two come after the joints.
    fn body_node(&self) -> Index {
        self.tracks.joint_count()
    }

    fn garment_node(&self) -> Index {
        self.body_node() + 1
    }

    fn animation(&self, binary: &mut Binary) -> Result<Animation> {
        let frames = self.tracks.len();
        let times: Vec<f32> = (0..frames).map(|t| t as f32 / self.fps).collect();
        let times = binary.write_times(&times)?;
        let mut curves = self.tracks.write(times, binary)?;
        if frames > 1 {
            let weights = binary.write(Usage::Data, &one_hot(frames))?;
            curves.add(self.garment_node(), Property::Weights, times, weights);
        }
        Ok(Animation {
            name: self.name.clone(),
            channels: curves.channels,
            samplers: curves.samplers,
            extras: json!({ "framesPerSecond": self.fps }),
        })
    }

    fn root(self, animation: Animation, chunk: &mut Chunk) -> Root {
        let nodes = self.nodes();
        Root {
            asset: json!({
                "version": "2.0",
                "generator": concat!("unic ", env!("CARGO_PKG_VERSION")),
            }),
            scene: 0,
            scenes: vec![Scene {
                nodes: vec![self.tracks.root_node(), self.body_node(), self.garment_node()],
                name: self.name,
            }],
            nodes,
            skins: vec![Skin {
                name: "skeleton".into(),
                inverse_bind_matrices: self.body.inverse_bind_matrices,
                skeleton: self.tracks.root_node(),
                joints: (0..self.tracks.joint_count()).collect(),
            }],
            meshes: vec![body_mesh(self.body), garment_mesh(self.garment)],
            materials: materials(),
            animations: vec![animation],
            accessors: std::mem::take(&mut chunk.accessors),
            buffer_views: std::mem::take(&mut chunk.views),
            buffers: vec![Buffer {
                byte_length: chunk.length,
            }],
        }
    }

    fn nodes(&self) -> Vec<Node> {
        let mut nodes = self.tracks.nodes();
        nodes.push(Node {
            name: "body".into(),
            mesh: Some(0),
            skin: Some(0),
            ..Default::default()
        });
        nodes.push(Node {
            name: "garment".into(),
            mesh: Some(1),
            ..Default::default()
        });
        nodes
    }
}

/// Weights of the targets, frame by frame: none in the first frame, then each target in its own.
fn one_hot(frames: usize) -> Vec<f32> {
    let row = |frame: usize| (1..frames).map(move |target| f32::from(u8::from(target == frame)));
    (0..frames).flat_map(row).collect()
}

fn body_mesh(body: SkinnedMesh) -> Mesh {
    Mesh {
        name: "body".into(),
        primitives: [Primitive {
            attributes: body.attributes,
            indices: body.indices,
            material: 0,
            targets: Vec::new(),
        }],
        extras: None,
    }
}

fn garment_mesh(garment: MorphedMesh) -> Mesh {
    let name = |target: usize| format!("frame_{target:04}");
    let names: Vec<String> = (1..=garment.targets.len()).map(name).collect();
    Mesh {
        name: "garment".into(),
        extras: (!names.is_empty()).then(|| json!({ "targetNames": names })),
        primitives: [Primitive {
            attributes: garment.attributes,
            indices: garment.indices,
            material: 1,
            targets: garment.targets,
        }],
    }
}

/// Of body and garment; both sides of cloth are seen. Colours are linear.
fn materials() -> Vec<Value> {
    let matt = |colour: [f32; 4], roughness: f32| json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": roughness });
    vec![
        json!({ "name": "body", "pbrMetallicRoughness": matt([0.64, 0.42, 0.31, 1.0], 0.6) }),
        json!({
            "name": "garment",
            "pbrMetallicRoughness": matt([0.05, 0.15, 0.39, 1.0], 0.9),
            "doubleSided": true,
        }),
    ]
}

/// Headers of the file and its two chunks.
struct Header {
    file: [u32; 3],
    json: [u32; 2],
    binary: [u32; 2],
}

/// Bytes of all headers.
const HEADERS: u64 = 12 + 8 + 8;

fn header(path: &Path, json: u64, binary: u64) -> Result<Header> {
    let total = HEADERS + json + binary;
    let word = |length: u64| {
        u32::try_from(length)
            .map_err(|_| Error::content(path, "at most 4 GiB in a GLB", format!("{total} bytes")))
    };
    Ok(Header {
        file: [u32::from_le_bytes(*b"glTF"), 2, word(total)?],
        json: [word(json)?, u32::from_le_bytes(*b"JSON")],
        binary: [word(binary)?, u32::from_le_bytes(*b"BIN\0")],
    })
}

fn write_chunks(out: &mut impl Write, header: &Header, document: &[u8], chunk: &mut Chunk) -> io::Result<()> {
    out.write_all(bytemuck::bytes_of(&header.file))?;
    out.write_all(bytemuck::bytes_of(&header.json))?;
    out.write_all(document)?;
    out.write_all(bytemuck::bytes_of(&header.binary))?;
    io::copy(&mut chunk.file, out)?;
    Ok(())
}
