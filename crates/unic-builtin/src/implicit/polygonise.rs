//! Marching tetrahedra on a lattice of cubes.

use super::Field;
use glam::{UVec3, Vec3};
use std::collections::HashMap;

/// A lattice of cubes over a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Corner of the box with the least coordinates, metres.
    pub(crate) origin: Vec3,
    /// Opposite corner; rounded up to whole blocks.
    pub(crate) end: Vec3,
    /// Side of a cube, metres.
    pub(crate) step: f32,
}

/// Cubes along the side of a block that is looked into or passed over as a whole.
const BLOCK: u32 = 8;

/// Bound of the gradient's length: a smooth union of bounds of distances exceeds one a little.
const STEEPEST: f32 = 1.5;

/// Kuhn's six tetrahedra of a cube: each goes from corner 0 to corner 7 along one order of the axes.
/// The corners' bits are x, y, z; all six are positively oriented.
const TETRAHEDRA: [[u32; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];

/// For the corners inside as a bit set below 8: an even order of the corners with the lone corner, or
/// the pair of them, first; and whether those first ones are outside. Above 7 the complement's holds.
const ORDERS: [([usize; 4], bool); 8] = [
    ([0, 1, 2, 3], false),
    ([0, 1, 2, 3], false),
    ([1, 0, 3, 2], false),
    ([0, 1, 2, 3], false),
    ([2, 0, 1, 3], false),
    ([0, 2, 3, 1], false),
    ([1, 2, 0, 3], false),
    ([3, 0, 2, 1], true),
];

/// The zero set of `field` within the lattice: triangles, counter-clockwise seen from where the field
/// is positive, on vertices shared between neighbours. It is a manifold wherever it does not meet the
/// lattice's border.
pub(crate) fn polygonise(field: &Field, lattice: Lattice) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let side = lattice.step * BLOCK as f32;
    let blocks = ((lattice.end - lattice.origin) / side).ceil().as_uvec3();
    let mut marching = Marching {
        field,
        lattice,
        nodes: blocks * BLOCK + UVec3::ONE,
        vertices: Vec::new(),
        faces: Vec::new(),
        vertex_on: HashMap::new(),
    };
    for z in 0..blocks.z {
        for y in 0..blocks.y {
            for x in 0..blocks.x {
                let first = UVec3::new(x, y, z) * BLOCK;
                let centre = marching.node(first) + Vec3::splat(side * 0.5);
                let reach = STEEPEST * side * 0.5 * 3f32.sqrt();
                if field(centre).abs() <= reach {
                    marching.block(first);
                }
            }
        }
    }
    (marching.vertices, marching.faces)
}

struct Marching<'a> {
    field: &'a Field<'a>,
    lattice: Lattice,
    nodes: UVec3,
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// The vertex on a lattice edge, by the numbers of its two nodes.
    vertex_on: HashMap<(u32, u32), u32>,
}

/// A corner of a tetrahedron: number of its node, place, value.
type Corner = (u32, Vec3, f32);

impl Marching<'_> {
    fn node(&self, node: UVec3) -> Vec3 {
        self.lattice.origin + node.as_vec3() * self.lattice.step
    }

    fn number(&self, node: UVec3) -> u32 {
        node.x + self.nodes.x * (node.y + self.nodes.y * node.z)
    }

    fn block(&mut self, first: UVec3) {
        let side = BLOCK + 1;
        let offset = |i: u32| UVec3::new(i % side, i / side % side, i / (side * side));
        let values: Vec<f32> = (0..side * side * side)
            .map(|i| (self.field)(self.node(first + offset(i))))
            .collect();
        let value = |at: UVec3| values[(at.x + side * (at.y + side * at.z)) as usize];
        for i in 0..BLOCK * BLOCK * BLOCK {
            let cell = UVec3::new(i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK));
            let corners = [0u32, 1, 2, 3, 4, 5, 6, 7].map(|c| {
                let at = cell + UVec3::new(c & 1, c >> 1 & 1, c >> 2);
                (self.number(first + at), self.node(first + at), value(at))
            });
            if corners.iter().any(|c| c.2 < 0.0) && corners.iter().any(|c| c.2 >= 0.0) {
                for tetrahedron in TETRAHEDRA {
                    self.tetrahedron(tetrahedron.map(|c| corners[c as usize]));
                }
            }
        }
    }

    fn tetrahedron(&mut self, corners: [Corner; 4]) {
        let inside = (0..4).fold(0, |mask, i| mask | usize::from(corners[i].2 < 0.0) << i);
        let (order, turned) = ORDERS[inside.min(15 - inside)];
        // Corner 3 is never among the inside ones of the table: their complement is looked up turned.
        let outward = turned == (inside > 7);
        let cross = |i: usize, j: usize| (corners[order[i]], corners[order[j]]);
        let mut on = |(a, b)| self.vertex(a, b);
        let faces = match inside.count_ones() {
            1 | 3 => vec![[on(cross(0, 1)), on(cross(0, 2)), on(cross(0, 3))]],
            2 => {
                let [p, q, r, s] = [cross(0, 2), cross(0, 3), cross(1, 3), cross(1, 2)].map(on);
                vec![[p, q, r], [p, r, s]]
            }
            _ => return,
        };
        let faced = |[a, b, c]: [u32; 3]| if outward { [a, b, c] } else { [a, c, b] };
        self.faces.extend(faces.into_iter().map(faced));
    }

    fn vertex(&mut self, a: Corner, b: Corner) -> u32 {
        let (a, b) = if a.0 < b.0 { (a, b) } else { (b, a) };
        let vertices = &mut self.vertices;
        *self.vertex_on.entry((a.0, b.0)).or_insert_with(|| {
            // Off the nodes, so that no triangle collapses.
            let t = (a.2 / (a.2 - b.2)).clamp(0.02, 0.98);
            vertices.push(a.1.lerp(b.1, t));
            vertices.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::topology::edges;

    #[test]
    fn a_torus_is_closed_and_faces_outward() {
        let torus = |p: Vec3| (p.truncate().length() - 0.3).hypot(p.z) - 0.1;
        let lattice = Lattice {
            origin: Vec3::splat(-0.5),
            end: Vec3::splat(0.5),
            step: 0.031,
        };
        let (vertices, faces) = polygonise(&torus, lattice);
        let genus_0_or_1 = vertices.len() as i64 + faces.len() as i64 - edges(&faces).len() as i64;
        assert_eq!(genus_0_or_1, 0);
        assert_eq!(2 * edges(&faces).len(), 3 * faces.len());
        let volume: f32 = (faces.iter())
            .map(|f| f.map(|v| vertices[v as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        let exact = 2.0 * std::f32::consts::PI.powi(2) * 0.3 * 0.01;
        assert!((volume / exact - 1.0).abs() < 0.05, "{volume} against {exact}");
    }
}
