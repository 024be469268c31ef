//! Marching tetrahedra on a lattice of cubes.

use super::Field;
use glam::{UVec3, Vec3};
use std::collections::HashMap;

/// Lattice of cubes over a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// LatticeCorner of the box with the least coordinates, metres.
    pub(crate) origin: Vec3,
    /// Opposite corner, metres; it is rounded up to whole blocks.
    pub(crate) end: Vec3,
    /// Side of a cube, metres.
    pub(crate) step: f32,
}

/// Cubes along the side of a block. A block that cannot contain the surface is skipped.
const BLOCK: u32 = 8;

/// Upper bound on the length of a field's gradient. Approximate distances exceed 1 a little.
const STEEPEST: f32 = 1.5;

/// Kuhn's six tetrahedra of a cube, as corners whose bits are x, y and z.
///
/// Each leads from corner 0 to corner 7 along one order of the axes, so that the faces of
/// neighbouring cubes match. All six are positively oriented.
const TETRAHEDRA: [[u32; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];

/// Order of a tetrahedron's corners in which one formula gives its triangles.
struct CornerOrder {
    /// Even permutation of the corners. It begins with the lone corner on one side of the surface,
    /// or with a pair of corners on one side.
    corners: [usize; 4],
    /// True if the permutation begins with corners outside.
    is_outside_first: bool,
}

const fn order(corners: [usize; 4], is_outside_first: bool) -> CornerOrder {
    CornerOrder {
        corners,
        is_outside_first,
    }
}

/// Corner orders by the bit set of the corners inside, for sets below 8; the others are the
/// complements of these.
const ORDERS: [CornerOrder; 8] = [
    order([0, 1, 2, 3], false),
    order([0, 1, 2, 3], false),
    order([1, 0, 3, 2], false),
    order([0, 1, 2, 3], false),
    order([2, 0, 1, 3], false),
    order([0, 2, 3, 1], false),
    order([1, 2, 0, 3], false),
    order([3, 0, 2, 1], true),
];

/// Triangulates the zero set of `field` within the lattice by marching tetrahedra.
///
/// Triangles are counter-clockwise seen from where the field is positive, and share their vertices
/// with neighbours. The mesh is a manifold wherever it does not meet the border of the lattice.
pub(crate) fn polygonise(field: &Field, lattice: Lattice) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let side = lattice.step * BLOCK as f32;
    let blocks = ((lattice.end - lattice.origin) / side).ceil().as_uvec3();
    let mut marching = MarchingTetrahedra {
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
                // From the centre to a corner of the block the field changes by no more than this.
                let reach = STEEPEST * side * 0.5 * 3f32.sqrt();
                if field(centre).abs() <= reach {
                    marching.block(first);
                }
            }
        }
    }
    (marching.vertices, marching.faces)
}

/// Triangulation in progress.
struct MarchingTetrahedra<'a> {
    field: &'a Field<'a>,
    lattice: Lattice,
    /// Number of lattice nodes along each axis.
    nodes: UVec3,
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// Vertex on a lattice edge, by the numbers of the edge's two nodes.
    vertex_on: HashMap<(u32, u32), u32>,
}

/// Corner of a tetrahedron.
#[derive(Clone, Copy)]
struct LatticeCorner {
    /// Number of the lattice node.
    node: u32,
    /// Position, metres.
    position: Vec3,
    /// Value of the field, metres.
    value: f32,
}

impl MarchingTetrahedra<'_> {
    /// Position of a lattice node, metres.
    fn node(&self, node: UVec3) -> Vec3 {
        self.lattice.origin + node.as_vec3() * self.lattice.step
    }

    /// Number of a lattice node, x fastest.
    fn number(&self, node: UVec3) -> u32 {
        node.x + self.nodes.x * (node.y + self.nodes.y * node.z)
    }

    /// Triangulates the cubes of the block that begins at the node `first`.
    fn block(&mut self, first: UVec3) {
        // The field is the costly part: it is evaluated once for each node of the block.
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
                LatticeCorner {
                    node: self.number(first + at),
                    position: self.node(first + at),
                    value: value(at),
                }
            });
            if corners.iter().any(|c| c.value < 0.0) && corners.iter().any(|c| c.value >= 0.0) {
                for tetrahedron in TETRAHEDRA {
                    self.tetrahedron(tetrahedron.map(|c| corners[c as usize]));
                }
            }
        }
    }

    fn tetrahedron(&mut self, corners: [LatticeCorner; 4]) {
        let inside = (0..4).fold(0, |mask, i| mask | usize::from(corners[i].value < 0.0) << i);
        // Sets above 7 contain corner 3. Their complement has the same triangles, turned around.
        let order = &ORDERS[inside.min(15 - inside)];
        let outward = order.is_outside_first == (inside > 7);
        let cross = |i: usize, j: usize| (corners[order.corners[i]], corners[order.corners[j]]);
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

    /// Vertex on the lattice edge between two corners on different sides of the surface.
    fn vertex(&mut self, a: LatticeCorner, b: LatticeCorner) -> u32 {
        // The same order from every tetrahedron at the edge, for the same vertex.
        let (a, b) = if a.node < b.node { (a, b) } else { (b, a) };
        let vertices = &mut self.vertices;
        *self.vertex_on.entry((a.node, b.node)).or_insert_with(|| {
            // Vertices stay off the nodes, so that no triangle collapses to a point.
            let t = (a.value / (a.value - b.value)).clamp(0.02, 0.98);
            vertices.push(a.position.lerp(b.position, t));
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
        let euler_characteristic = vertices.len() as i64 + faces.len() as i64 - edges(&faces).len() as i64;
        assert_eq!(euler_characteristic, 0, "that of a torus");
        assert_eq!(2 * edges(&faces).len(), 3 * faces.len());
        let volume: f32 = (faces.iter())
            .map(|f| f.map(|v| vertices[v as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        let exact = 2.0 * std::f32::consts::PI.powi(2) * 0.3 * 0.01;
        assert!((volume / exact - 1.0).abs() < 0.05, "{volume} against {exact}");
    }
}
