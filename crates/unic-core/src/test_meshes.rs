//! Meshes, strategies and oracles for tests.

use crate::{mesh::TriMesh, subdivide::subdivided};
use glam::Vec3;
use proptest::prelude::*;

/// Strategy for points of the cube from −`reach` to `reach`.
pub(crate) fn point(reach: f32) -> impl Strategy<Value = Vec3> {
    let axis = || -reach..=reach;
    (axis(), axis(), axis()).prop_map(Vec3::from)
}

/// Cube from −1 to 1, closed, with outward faces: 8 vertices, 12 faces.
pub(crate) fn cube() -> TriMesh {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    let vertices = (0..8)
        .map(|i| Vec3::new(sign(i & 1), sign(i & 2), sign(i & 4)))
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    TriMesh::new(vertices, faces).unwrap()
}

/// Sphere, closed, with outward faces: an octahedron that is subdivided `level + 1` times.
pub(crate) fn sphere(level: usize, radius: f32) -> TriMesh {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let faces = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    let mut mesh = TriMesh::new(axes.to_vec(), faces).unwrap();
    for _ in 0..=level {
        mesh = subdivided(&mesh).mesh;
        mesh.vertices.iter_mut().for_each(|v| *v = v.normalize());
    }
    mesh.vertices.iter_mut().for_each(|v| *v *= radius);
    mesh
}

/// Sheet of `width` × `height` squares of side `side`, in the xz plane, facing up.
pub(crate) fn sheet(width: u32, height: u32, side: f32) -> TriMesh {
    let at = |x: u32, z: u32| z * (width + 1) + x;
    let place = |i: u32| Vec3::new((i % (width + 1)) as f32, 0.0, (i / (width + 1)) as f32) * side;
    let squares = (0..height).flat_map(|z| (0..width).map(move |x| (x, z)));
    let faces = squares.flat_map(|(x, z)| {
        let [a, b, c, d] = [at(x, z), at(x, z + 1), at(x + 1, z + 1), at(x + 1, z)];
        [[a, b, c], [a, c, d]]
    });
    let vertices = (0..(width + 1) * (height + 1)).map(place).collect();
    TriMesh::new(vertices, faces.collect()).unwrap()
}

/// Winding number of a closed mesh around `p`: 1 inside, 0 outside. The sum of solid angles in f64
/// (Van Oosterom & Strackee 1983).
pub(crate) fn winding_number(mesh: &TriMesh, p: Vec3) -> f64 {
    let solid_angle = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize].as_dvec3() - p.as_dvec3());
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    mesh.faces.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
