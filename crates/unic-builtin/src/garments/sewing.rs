//! Construction of garments from grids of cloth that are sewn together.

use super::{Attachment, Fabric, GarmentError, GarmentMesh, Part};
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use unic_core::mesh::{TriMesh, Uvs};

/// Builds a garment from grids of cloth.
///
/// ```
/// use glam::{Vec2, Vec3};
/// use unic_builtin::garments::{Fabric, GridShape, Sewing, Wrap};
///
/// let mut sewing = Sewing::default();
/// let skirt = sewing.part("skirt", Fabric::Cotton);
/// let shape = GridShape { columns: 40, rows: 20, wrap: Wrap::Closed };
/// let tube = sewing.grid(
///     skirt,
///     shape,
///     |u, v| Vec3::new((u * 6.283_185).sin() * 0.2, v * 0.5, (u * 6.283_185).cos() * 0.2),
///     |u, v| Vec2::new(u * 1.257, v * 0.5),
/// );
/// sewing.attach("waist", &tube.row(20));
/// let garment = sewing.finish()?;
/// assert_eq!(garment.mesh.vertices.len(), 40 * 21);
/// # Ok::<(), unic_builtin::garments::GarmentError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Sewing {
    vertices: Vec<Vec3>,
    part_of_vertex: Vec<u32>,
    faces: Vec<[u32; 3]>,
    face_uvs: Vec<[Vec2; 3]>,
    parts: Vec<Part>,
    attachments: Vec<Attachment>,
    /// Vertex that each vertex is sewn to, or the vertex itself: a union-find forest.
    sewn_to: Vec<u32>,
}

/// Vertex of a garment with its pattern coordinates in one piece of cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternVertex {
    /// Index of the vertex in the [`Sewing`].
    pub vertex: u32,
    /// Pattern coordinates, metres.
    pub pattern: Vec2,
}

/// Size of a grid of cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridShape {
    /// Number of squares along u. An even number makes the alternating diagonals mirror-symmetric.
    pub columns: usize,
    /// Number of squares along v.
    pub rows: usize,
    /// Panel or tube.
    pub wrap: Wrap,
}

/// Topology of a grid along u.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// A panel: `columns + 1` vertices per row.
    Open,
    /// A tube: `columns` vertices per row. The last square ends at the first vertex.
    Closed,
}

/// Vertices of a grid in a [`Sewing`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    first: u32,
    shape: GridShape,
}

impl GridShape {
    /// Number of vertices of one row.
    pub fn row_len(self) -> usize {
        match self.wrap {
            Wrap::Open => self.columns + 1,
            Wrap::Closed => self.columns,
        }
    }
}

impl Grid {
    /// Vertex at a column and row; columns of a tube wrap around.
    pub fn at(self, column: usize, row: usize) -> u32 {
        let len = self.shape.row_len();
        self.first + (row * len + column % len) as u32
    }

    /// Vertices of a row (v constant) by ascending u.
    pub fn row(self, row: usize) -> Vec<u32> {
        (0..self.shape.row_len()).map(|i| self.at(i, row)).collect()
    }

    /// Vertices of a column (u constant) by ascending v.
    pub fn column(self, column: usize) -> Vec<u32> {
        (0..=self.shape.rows).map(|j| self.at(column, j)).collect()
    }

    /// Size of the grid.
    pub fn shape(self) -> GridShape {
        self.shape
    }
}

impl Sewing {
    /// Adds a part and returns its index, by which vertices refer to it.
    pub fn part(&mut self, name: &str, fabric: Fabric) -> u32 {
        let name = name.to_owned();
        self.parts.push(Part { name, fabric });
        self.parts.len() as u32 - 1
    }

    /// Adds a grid of cloth.
    ///
    /// `place(u, v)` gives positions in bind-pose space and `pattern(u, v)` pattern coordinates,
    /// both in metres, for u and v in 0..=1. The front of the cloth is on the side of u × v.
    /// Diagonals alternate, so that no shear direction is preferred. For a tube, `pattern` is
    /// called with u = 1 at the seam, but `place` is not.
    pub fn grid(
        &mut self,
        part: u32,
        shape: GridShape,
        place: impl Fn(f32, f32) -> Vec3,
        pattern: impl Fn(f32, f32) -> Vec2,
    ) -> Grid {
        let share = |i: usize, j: usize| (i as f32 / shape.columns as f32, j as f32 / shape.rows as f32);
        let grid = Grid {
            first: self.vertices.len() as u32,
            shape,
        };
        for j in 0..=shape.rows {
            for i in 0..shape.row_len() {
                let (u, v) = share(i, j);
                self.vertex(part, place(u, v));
            }
        }
        let uv = |(i, j)| {
            let (u, v) = share(i, j);
            pattern(u, v)
        };
        for j in 0..shape.rows {
            for i in 0..shape.columns {
                for corners in square(i, j) {
                    self.face(corners.map(|(i, j)| grid.at(i, j)), corners.map(uv));
                }
            }
        }
        grid
    }

    /// Adds a vertex of a part at a position in bind-pose space, metres, and returns its index.
    pub fn vertex(&mut self, part: u32, position: Vec3) -> u32 {
        let index = self.vertices.len() as u32;
        self.vertices.push(position);
        self.part_of_vertex.push(part);
        self.sewn_to.push(index);
        index
    }

    /// Adds a triangle, counter-clockwise seen from outside, with the pattern coordinates of its
    /// corners in metres.
    pub fn face(&mut self, corners: [u32; 3], pattern: [Vec2; 3]) {
        self.faces.push(corners);
        self.face_uvs.push(pattern);
    }

    /// Position of a vertex in bind-pose space, metres.
    ///
    /// # Panics
    /// Panics if the garment has no such vertex.
    pub fn position(&self, vertex: u32) -> Vec3 {
        self.vertices[vertex as usize]
    }

    /// Joins two edges vertex by vertex.
    ///
    /// Each pair becomes one vertex half way between both, which belongs to the part of the first
    /// edge. Both edges keep their pattern coordinates.
    ///
    /// # Errors
    /// [`GarmentError::Seam`] for edges of different numbers of vertices.
    pub fn sew(&mut self, first: &[u32], second: &[u32]) -> Result<(), GarmentError> {
        if first.len() != second.len() {
            return Err(GarmentError::Seam {
                left: first.len(),
                right: second.len(),
            });
        }
        for (&a, &b) in first.iter().zip(second) {
            let (a, b) = (self.root(a), self.root(b));
            if a != b {
                let middle = self.position(a).midpoint(self.position(b));
                self.vertices[a as usize] = middle;
                self.sewn_to[b as usize] = a;
            }
        }
        Ok(())
    }

    /// Adds a strip of triangles between two rows of vertices in the same direction.
    ///
    /// The rows may have different numbers of vertices; `second` lies on the side to which v grows.
    /// In a closed strip both rows end with their first vertex.
    pub fn strip(&mut self, first: &[PatternVertex], second: &[PatternVertex]) {
        let (mut i, mut j) = (0, 0);
        while i + 1 < first.len() || j + 1 < second.len() {
            // The row that is behind, measured as a share of its own length, advances. The middles
            // of the next edges are compared in integers, multiplied by both lengths.
            let (along_first, along_second) =
                ((2 * i + 1) * (second.len() - 1), (2 * j + 1) * (first.len() - 1));
            let first_goes = j + 1 == second.len() || (i + 1 < first.len() && along_first <= along_second);
            let (a, b) = (first[i], second[j]);
            let c = if first_goes { first[i + 1] } else { second[j + 1] };
            self.face([a.vertex, c.vertex, b.vertex], [a.pattern, c.pattern, b.pattern]);
            i += usize::from(first_goes);
            j += usize::from(!first_goes);
        }
    }

    /// Vertices added so far to a part, ascending.
    pub fn vertices_of(&self, part: u32) -> Vec<u32> {
        let vertices = self.part_of_vertex.iter().enumerate();
        vertices
            .filter(|(_, p)| **p == part)
            .map(|(v, _)| v as u32)
            .collect()
    }

    /// Names vertices that may be held on the body.
    pub fn attach(&mut self, name: &str, vertices: &[u32]) {
        self.attachments.push(Attachment {
            name: name.to_owned(),
            vertices: vertices.to_vec(),
        });
    }

    /// Returns the garment, with sewn vertices merged and vertices without faces removed.
    ///
    /// # Errors
    /// [`GarmentError::Mesh`] for positions that are not finite or corners out of range.
    pub fn finish(mut self) -> Result<GarmentMesh, GarmentError> {
        let roots: Vec<u32> = (0..self.vertices.len() as u32).map(|v| self.root(v)).collect();
        let mut number = vec![u32::MAX; roots.len()];
        for corner in self.faces.iter().flatten() {
            if let Some(&root) = roots.get(*corner as usize) {
                number[root as usize] = 0;
            }
        }
        let kept: Vec<usize> = (0..roots.len()).filter(|&v| number[v] == 0).collect();
        kept.iter().enumerate().for_each(|(n, &v)| number[v] = n as u32);
        // Corners out of range become u32::MAX, which the check of the mesh reports.
        let renumbered = |v: u32| roots.get(v as usize).map_or(u32::MAX, |&r| number[r as usize]);
        for attachment in &mut self.attachments {
            attachment.vertices.iter_mut().for_each(|v| *v = renumbered(*v));
            attachment.vertices.retain(|v| *v != u32::MAX);
            attachment.vertices.sort_unstable();
            attachment.vertices.dedup();
        }
        let mesh = TriMesh {
            vertices: kept.iter().map(|&v| self.vertices[v]).collect(),
            faces: self.faces.iter().map(|f| f.map(renumbered)).collect(),
            uvs: Some(shared_uvs(&self.face_uvs)),
        };
        mesh.check()?;
        Ok(GarmentMesh {
            mesh,
            parts: self.parts,
            part_of_vertex: kept.iter().map(|&v| self.part_of_vertex[v]).collect(),
            attachments: self.attachments,
        })
    }

    /// Vertex that a vertex has become by sewing.
    fn root(&self, mut vertex: u32) -> u32 {
        while self.sewn_to[vertex as usize] != vertex {
            vertex = self.sewn_to[vertex as usize];
        }
        vertex
    }
}

/// Triangles of a square of a grid. The direction of the diagonal alternates with the parity.
fn square(i: usize, j: usize) -> [[(usize, usize); 3]; 2] {
    let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
    if (i + j).is_multiple_of(2) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    }
}

/// Texture coordinates with one entry for each distinct pair.
fn shared_uvs(corners: &[[Vec2; 3]]) -> Uvs {
    let mut index = HashMap::new();
    let mut coordinates = Vec::new();
    // Keys are bit patterns, because floats have no hash.
    let mut number = |uv: Vec2| {
        *index.entry(uv.to_array().map(f32::to_bits)).or_insert_with(|| {
            coordinates.push(uv);
            coordinates.len() as u32 - 1
        })
    };
    let faces = corners.iter().map(|face| face.map(&mut number)).collect();
    Uvs { coordinates, faces }
}
