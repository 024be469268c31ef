//! Writing one mesh without an animation.

use super::{
    binary::{BinaryWriter, BufferUsage},
    document::{asset, materials, write_file},
    file_mesh::FileMesh,
    json::{Buffer, Mesh, Node, Primitive, Root, Scene},
    surface::SurfaceBuffers,
};
use crate::{error::Result, frames::check_vertex_count};
use glam::{Vec2, Vec3};
use std::path::Path;
use unic_core::mesh::TriMesh;

/// Index of the garment's material.
const GARMENT_MATERIAL: usize = 1;

/// Writes a mesh as a GLB, atomically, with a texel for each vertex as `TEXCOORD_1`.
///
/// `positions` (V), metres, stand for those of the mesh. `texels` (V) are texture coordinates, v
/// down. The copies of a vertex along seams of the mesh's own texture share its texel.
///
/// # Errors
/// Another number of positions or texels than vertices; a mesh without triangles or with indices out
/// of range; a file that cannot be written.
pub fn write_mesh_with_texels(
    path: &Path,
    mesh: &TriMesh,
    positions: &[Vec3],
    texels: &[Vec2],
) -> Result<()> {
    check_vertex_count(path, mesh.vertices.len(), positions)?;
    check_vertex_count(path, mesh.vertices.len(), texels)?;
    let file_mesh = FileMesh::new(path, mesh)?;
    let mut binary = BinaryWriter::create(path)?;
    let mut surface = SurfaceBuffers::default();
    surface.compute(positions, &file_mesh);
    let mut written = surface.write(&file_mesh, &mut binary)?;
    let spread: Vec<Vec2> = file_mesh.split.spread(texels).collect();
    let texels = binary.write(BufferUsage::Vertices, &spread)?;
    written.attributes.insert("TEXCOORD_1".into(), texels);
    let mut chunk = binary.finish()?;
    let root = Root {
        asset: asset(),
        scene: 0,
        scenes: vec![Scene {
            name: "garment".into(),
            nodes: vec![0],
        }],
        nodes: vec![Node {
            name: "garment".into(),
            mesh: Some(0),
            ..Node::default()
        }],
        meshes: vec![Mesh {
            name: "garment".into(),
            primitives: [Primitive {
                attributes: written.attributes,
                indices: written.indices,
                material: GARMENT_MATERIAL,
                targets: Vec::new(),
            }],
            extras: None,
        }],
        materials: materials(),
        skins: Vec::new(),
        animations: Vec::new(),
        accessors: std::mem::take(&mut chunk.accessors),
        buffer_views: std::mem::take(&mut chunk.views),
        buffers: vec![Buffer {
            byte_length: chunk.length,
        }],
    };
    write_file(path, &root, chunk)
}
