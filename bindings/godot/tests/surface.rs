//! Contract: surfaces in the engine's form have one texture coordinate a vertex, triangles of the same
//! corners in the other order, and a vertex buffer in the layout of `RenderingServer`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{Vec2, Vec3};
use godot_unic::surface::Surface;
use unic_core::mesh::{TriMesh, Uvs};

/// Two triangles with a common edge, which is a seam of the texture at one of its ends.
fn mesh() -> TriMesh {
    let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let mut mesh = TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let coordinates = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.25]];
    mesh.uvs = Some(Uvs {
        coordinates: coordinates.map(Vec2::from_array).to_vec(),
        faces: vec![[0, 1, 2], [0, 4, 3]],
    });
    mesh
}

#[test]
fn seams_split_vertices() {
    let mesh = mesh();
    let surface = Surface::new(&mesh);
    assert_eq!(surface.sources, [0, 1, 2, 3, 2]);
    assert_eq!(surface.indices, [0, 2, 1, 0, 3, 4]);
    let uvs = surface.uvs.unwrap();
    assert_eq!(uvs, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0], [0.5, 0.75]]);
}

#[test]
fn meshes_without_texture_keep_their_vertices() {
    let mesh = TriMesh { uvs: None, ..mesh() };
    let surface = Surface::new(&mesh);
    assert_eq!(surface.sources, [0, 1, 2, 3]);
    assert_eq!(surface.indices, [0, 2, 1, 0, 3, 2]);
    assert_eq!(surface.uvs, None);
}

/// Decodes a normal as the engine's shaders do.
fn decoded([x, y]: [u16; 2]) -> Vec3 {
    let f = [x, y].map(|number| f32::from(number) / 65535.0 * 2.0 - 1.0);
    let mut n = Vec3::new(f[0], f[1], 1.0 - f[0].abs() - f[1].abs());
    let t = (-n.z).clamp(0.0, 1.0);
    n.x += if n.x >= 0.0 { -t } else { t };
    n.y += if n.y >= 0.0 { -t } else { t };
    n.normalize()
}

#[test]
fn a_vertex_buffer_has_all_positions_and_then_all_normals() {
    let mesh = mesh();
    let surface = Surface::new(&mesh);
    let normals = [
        Vec3::new(0.3, -0.5, 0.2),
        Vec3::new(-0.4, 0.1, -0.9),
        Vec3::NEG_Z,
        Vec3::new(0.0, -1.0, -0.01),
    ]
    .map(Vec3::normalize);
    let mut buffer = vec![1, 2, 3];
    surface.write_vertices(&mesh.vertices, &normals, &mut buffer);
    let count = surface.sources.len();
    assert_eq!(buffer.len(), count * 16);
    let (positions, encoded) = buffer.split_at(count * 12);
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    for (vertex, bytes) in positions.chunks(12).enumerate() {
        let found = [0, 4, 8].map(|at| number(&bytes[at..at + 4]));
        assert_eq!(found, mesh.vertices[surface.sources[vertex] as usize].to_array());
    }
    for (vertex, bytes) in encoded.chunks(4).enumerate() {
        let halves = [0, 2].map(|at| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
        let expected = normals[surface.sources[vertex] as usize];
        let angle = decoded(halves).angle_between(expected);
        assert!(angle < 1e-3, "vertex {vertex}: {expected} is {}", decoded(halves));
    }
}
