//! Contract: surfaces in the engine's form have one texture coordinate a vertex, triangles of the same
//! corners in the other order, and a vertex buffer in the layout of `RenderingServer`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{Vec2, Vec3};
use godot_unic::{surface::Surface, tangents::Tangents};
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

/// Decodes a tangent and the sign of the binormal as the engine's shaders do.
fn decoded_tangent([x, y]: [u16; 2]) -> (Vec3, f32) {
    let signed = f32::from(y) / 65535.0 * 2.0 - 1.0;
    let y = (signed.abs() * 65535.0) as u16;
    (decoded([x, y]), signed.signum())
}

#[test]
fn a_vertex_buffer_has_all_positions_and_then_all_directions() {
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
    let mut tangents = Tangents::new(&surface);
    surface.write_vertices(&mesh.vertices, &normals, &mut tangents, &mut buffer);
    let count = surface.sources.len();
    assert_eq!(buffer.len(), count * 20);
    let (positions, directions) = buffer.split_at(count * 12);
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    for (vertex, bytes) in positions.chunks(12).enumerate() {
        let found = [0, 4, 8].map(|at| number(&bytes[at..at + 4]));
        assert_eq!(found, mesh.vertices[surface.sources[vertex] as usize].to_array());
    }
    for (vertex, bytes) in directions.chunks(8).enumerate() {
        let [a, b, c, d] = [0, 2, 4, 6].map(|at| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
        let expected = normals[surface.sources[vertex] as usize];
        let normal = decoded([a, b]);
        assert!(
            normal.angle_between(expected) < 1e-3,
            "vertex {vertex}: {expected} is {normal}"
        );
        let (tangent, _) = decoded_tangent([c, d]);
        assert!(tangent.dot(expected).abs() < 1e-3, "vertex {vertex}: {tangent}");
    }
}

#[test]
fn tangents_follow_the_texture() {
    for mirrored in [false, true] {
        let mut mesh = mesh();
        // The texture lies on the plane of x and y, or on its mirror image.
        let uvs = mesh
            .vertices
            .iter()
            .map(|p| Vec2::new(if mirrored { -p.x } else { p.x }, p.y));
        mesh.uvs = Some(Uvs {
            coordinates: uvs.collect(),
            faces: mesh.faces.clone(),
        });
        let surface = Surface::new(&mesh);
        let mut tangents = Tangents::new(&surface);
        let mut buffer = Vec::new();
        surface.write_vertices(&mesh.vertices, &[Vec3::Z; 4], &mut tangents, &mut buffer);
        for bytes in buffer[4 * 12..].chunks(8) {
            let [x, y] = [4, 6].map(|at| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
            let (tangent, sign) = decoded_tangent([x, y]);
            let along_u = if mirrored { Vec3::NEG_X } else { Vec3::X };
            assert!(
                tangent.angle_between(along_u) < 1e-3,
                "{tangent}, mirrored: {mirrored}"
            );
            // The binormal points along v, upwards.
            let binormal = sign * Vec3::Z.cross(tangent);
            assert!(
                binormal.angle_between(Vec3::Y) < 1e-3,
                "{binormal}, mirrored: {mirrored}"
            );
        }
    }
}
