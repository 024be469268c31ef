//! Writing the JSON chunk and the file around both chunks.

use super::{
    binary::{BinaryChunk, BinaryWriter, BufferUsage},
    body::SkinnedMesh,
    json::*,
    morphs::MorphedMesh,
    tracks::JointTracks,
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

/// The parts of a file besides its binary chunk.
pub(super) struct Document {
    pub(super) name: String,
    pub(super) fps: f32,
    pub(super) body: SkinnedMesh,
    pub(super) garment: MorphedMesh,
    pub(super) tracks: JointTracks,
}

impl Document {
    /// Writes the file, atomically.
    ///
    /// # Errors
    /// The file cannot be written, or would be larger than 4 GiB.
    pub(super) fn write(self, path: &Path, mut binary: BinaryWriter) -> Result<()> {
        let animation = self.animation(&mut binary)?;
        let mut chunk = binary.finish()?;
        let root = self.root(animation, &mut chunk);
        write_file(path, &root, chunk)
    }

    /// Index of the body's node. Joint j is node j; the body and the garment come after the joints.
    fn body_node(&self) -> Index {
        self.tracks.joint_count()
    }

    /// Index of the garment's node.
    fn garment_node(&self) -> Index {
        self.body_node() + 1
    }

    fn animation(&self, binary: &mut BinaryWriter) -> Result<Animation> {
        let frames = self.tracks.len();
        // Divided and not accumulated, so that the error does not grow with the frame.
        let times: Vec<f32> = (0..frames).map(|t| t as f32 / self.fps).collect();
        let times = binary.write_times(&times)?;
        let mut curves = self.tracks.write(times, binary)?;
        // A clip of one frame has no morph target, and then the specification allows no weights.
        if frames > 1 {
            let weights = binary.write(BufferUsage::Data, &one_hot(frames))?;
            curves.add(self.garment_node(), Property::Weights, times, weights);
        }
        Ok(Animation {
            name: self.name.clone(),
            channels: curves.channels,
            samplers: curves.samplers,
            extras: json!({ "framesPerSecond": self.fps }),
        })
    }

    fn root(self, animation: Animation, chunk: &mut BinaryChunk) -> Root {
        let nodes = self.nodes();
        Root {
            asset: asset(),
            scene: 0,
            scenes: vec![Scene {
                // The body is beside the skeleton and not below it: glTF ignores the transform of a
                // skinned node.
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

/// Writes a document with its binary chunk, atomically.
///
/// # Errors
/// The file cannot be written, or would be larger than 4 GiB.
pub(super) fn write_file(path: &Path, root: &Root, mut chunk: BinaryChunk) -> Result<()> {
    let mut document = serde_json::to_vec(root).map_err(|e| Error::io(path, "write")(e.into()))?;
    // The binary chunk begins at a multiple of four; the specification pads JSON with spaces.
    document.resize(document.len().next_multiple_of(4), b' ');
    let header = header(path, document.len() as u64, chunk.length)?;
    let mut file = AtomicFile::create(path)?;
    write_chunks(&mut file, &header, &document, &mut chunk).map_err(Error::io(path, "write"))?;
    file.finish()
}

/// Returns the program and version that a file names.
pub(super) fn asset() -> Value {
    json!({
        "version": "2.0",
        "generator": concat!("unic ", env!("CARGO_PKG_VERSION")),
    })
}

/// Returns the weights of all targets, frame after frame: zero in the first frame, and in every
/// further frame one for its own target.
fn one_hot(frames: usize) -> Vec<f32> {
    // The first frame is the mesh itself and has no target.
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

/// Materials of body and garment; both sides of the garment are drawn. Colours are linear.
pub(super) fn materials() -> Vec<Value> {
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
struct ChunkHeaders {
    /// Magic, version and total length.
    file: [u32; 3],
    /// Length and type of the JSON chunk.
    json: [u32; 2],
    /// Length and type of the binary chunk.
    binary: [u32; 2],
}

/// Length of all headers, bytes.
const HEADERS: u64 = 12 + 8 + 8;

/// Makes the headers of chunks of these lengths, bytes.
///
/// # Errors
/// A file of more than 4 GiB.
fn header(path: &Path, json: u64, binary: u64) -> Result<ChunkHeaders> {
    let total = HEADERS + json + binary;
    // Lengths are 32-bit words in the format.
    let word = |length: u64| {
        u32::try_from(length)
            .map_err(|_| Error::content(path, "at most 4 GiB in a GLB", format!("{total} bytes")))
    };
    Ok(ChunkHeaders {
        file: [u32::from_le_bytes(*b"glTF"), 2, word(total)?],
        json: [word(json)?, u32::from_le_bytes(*b"JSON")],
        binary: [word(binary)?, u32::from_le_bytes(*b"BIN\0")],
    })
}

fn write_chunks(
    out: &mut impl Write,
    header: &ChunkHeaders,
    document: &[u8],
    chunk: &mut BinaryChunk,
) -> io::Result<()> {
    out.write_all(bytemuck::bytes_of(&header.file))?;
    out.write_all(bytemuck::bytes_of(&header.json))?;
    out.write_all(document)?;
    out.write_all(bytemuck::bytes_of(&header.binary))?;
    io::copy(&mut chunk.file, out)?;
    Ok(())
}
