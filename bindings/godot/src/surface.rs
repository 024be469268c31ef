//! Vertices and triangles in the engine's form.

use crate::tangents::Tangents;
use glam::{Vec2, Vec3};
use unic_core::mesh::{SeamSplit, TriMesh};

/// Bytes of a position in the engine's vertex buffer.
pub const POSITION_BYTES: usize = 12;
/// Bytes of a normal and a tangent in the engine's vertex buffer: two numbers of an octahedral map each.
pub const DIRECTION_BYTES: usize = 8;

/// Surface in which every vertex has one texture coordinate, as the engine needs it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Vertex of the model for each vertex: copies at texture seams follow those of the model.
    pub sources: Vec<u32>,
    /// Texture coordinates from the upper left corner; none if the model has none.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Triangles, whose corners the engine wants clockwise.
    pub indices: Vec<u32>,
}

impl Surface {
    /// Splits the vertices of a mesh at its texture seams.
    pub fn new(mesh: &TriMesh) -> Self {
        let SeamSplit { sources, uvs, faces } = SeamSplit::new(mesh);
        let from_top = |uvs: Vec<Vec2>| uvs.iter().map(|uv| [uv.x, 1.0 - uv.y]).collect();
        Self {
            sources,
            uvs: uvs.map(from_top),
            indices: faces.iter().flat_map(|&[a, b, c]| [a, c, b]).collect(),
        }
    }

    /// Values of all vertices, copies at seams included.
    pub fn spread<'a>(&'a self, values: &'a [Vec3]) -> impl Iterator<Item = Vec3> + 'a {
        self.sources.iter().map(|&vertex| values[vertex as usize])
    }

    /// Writes positions, unit normals and tangents as the engine's vertex buffer holds them: all
    /// positions, then a normal and a tangent for each vertex. `tangents` is of this surface.
    pub fn write_vertices(
        &self,
        positions: &[Vec3],
        normals: &[Vec3],
        tangents: &mut Tangents,
        out: &mut Vec<u8>,
    ) {
        out.clear();
        out.reserve(self.sources.len() * (POSITION_BYTES + DIRECTION_BYTES));
        for position in self.spread(positions) {
            (position.to_array().iter()).for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
        }
        let along = tangents.update(self, positions, normals);
        for (normal, (tangent, sign)) in self.spread(normals).zip(along) {
            let directions = [quantised(octahedral(normal)), tangent_map(tangent, sign)];
            (directions.as_flattened().iter())
                .for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
        }
    }
}

/// Unit vector as a point of the octahedral map, 0 to 1, that the engine's shaders decode.
fn octahedral(direction: Vec3) -> [f32; 2] {
    let sum = direction.abs().element_sum();
    // A normal of a face without area: any direction is as good as another.
    let n = if sum > 0.0 { direction / sum } else { Vec3::Z };
    let folded = |own: f32, other: f32| (1.0 - other.abs()).copysign(own);
    let [x, y] = match n.z >= 0.0 {
        true => [n.x, n.y],
        false => [folded(n.x, n.y), folded(n.y, n.x)],
    };
    [0.5 * x + 0.5, 0.5 * y + 0.5]
}

/// Tangent with the sign of the binormal, which the engine keeps in the half of the second number.
fn tangent_map(tangent: Vec3, sign: f32) -> [u16; 2] {
    let [x, y] = octahedral(tangent);
    // Zero has no sign.
    let half = 0.5 * y.max(1.0 / 32767.0) + 0.5;
    let map = quantised([x, if sign >= 0.0 { half } else { 1.0 - half }]);
    // The engine takes this value for a compressed vertex; both decode to the same direction.
    if map == [0, 65535] { [65535, 65535] } else { map }
}

/// Numbers of 0 to 1 in 16 bits. The cast limits the range.
fn quantised(numbers: [f32; 2]) -> [u16; 2] {
    numbers.map(|number| (number * 65535.0) as u16)
}

/// Least and largest coordinates; none of no positions.
pub fn bounds(positions: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *positions.first()?;
    let grow = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
    Some(positions.iter().fold((first, first), grow))
}
