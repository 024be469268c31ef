//! Connectivity of meshes: edges, welded vertices, connected components.
//!
//! For tools, simulation and metrics.

use glam::Vec3;
use std::collections::HashMap;

/// Largest distance between vertices that are welded, metres.
///
/// It is larger than what rounding and text files do to duplicated seam vertices, and far below the
/// length of any edge.
pub const WELD_DISTANCE: f32 = 1e-6;

/// Lists the edges of a mesh, each once: pairs of vertices with the lower index first, sorted. An
/// edge from a vertex to itself is left out.
pub fn edges(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = (faces.iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a != b)
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Returns for each vertex the first vertex at the same place, within [`WELD_DISTANCE`]. For a
/// first vertex this is itself.
///
/// Garments are often cut into panels whose seams hold every vertex twice; welding closes them. A
/// vertex that is not finite is welded to none.
pub fn weld(vertices: &[Vec3]) -> Vec<u32> {
    let mut grid = WeldGrid::default();
    let index = |(i, &v): (usize, &Vec3)| grid.first_at(vertices, i as u32, v);
    vertices.iter().enumerate().map(index).collect()
}

/// Spatial hash of the first vertex at each place.
#[derive(Default)]
struct WeldGrid {
    /// Last first vertex that was added to each cell.
    cells: HashMap<[i64; 3], u32>,
    /// First vertex that was added before to the same cell: a linked list.
    before: HashMap<u32, u32>,
}

impl WeldGrid {
    /// Width of a cell, metres: several weld distances, so that few points need more than one cell.
    const CELL: f64 = 8.0 * WELD_DISTANCE as f64;

    /// Returns the first vertex at the place of vertex `index`, and adds it if it is the first.
    fn first_at(&mut self, vertices: &[Vec3], index: u32, place: Vec3) -> u32 {
        if !place.is_finite() {
            return index;
        }
        let reach = f64::from(WELD_DISTANCE);
        // In f64: in f32 a shift of 1 µm is rounded away beyond 20 m.
        let cell = |shift: f64| {
            place
                .as_dvec3()
                .to_array()
                .map(|x| ((x + shift) / Self::CELL).floor() as i64)
        };
        // A place near a cell's wall may match a vertex in the neighbouring cell.
        let (low, high) = (cell(-reach), cell(reach));
        let mut found = index;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    found = found.min(self.first_in([x, y, z], vertices, place).unwrap_or(index));
                }
            }
        }
        if found == index
            && let Some(before) = self.cells.insert(cell(0.0), index)
        {
            self.before.insert(index, before);
        }
        found
    }

    /// Returns the lowest vertex of a cell within the weld distance of a place.
    fn first_in(&self, cell: [i64; 3], vertices: &[Vec3], place: Vec3) -> Option<u32> {
        let chain = std::iter::successors(self.cells.get(&cell), |i| self.before.get(i));
        let same = |i: &&u32| vertices[**i as usize].distance(place) <= WELD_DISTANCE;
        chain.filter(same).min().copied()
    }
}

/// Connected components of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Number of each vertex's component, from 0 on.
    pub of_vertex: Vec<u32>,
    /// Number of components.
    pub count: usize,
}

/// Finds the connected components of a mesh. They are numbered in the order of their first
/// vertices; a vertex without faces is a component by itself.
///
/// Panels that only touch are connected when `faces` name welded vertices, see [`weld`].
///
/// # Panics
/// When a face names a vertex beyond `vertex_count`.
pub fn components(vertex_count: usize, faces: &[[u32; 3]]) -> Components {
    let mut parent: Vec<u32> = (0..vertex_count as u32).collect();
    for &[a, b, c] in faces {
        for other in [b, c] {
            let (x, y) = (root(&mut parent, a), root(&mut parent, other));
            // The lower index is the root, so that roots are first vertices.
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    // Roots are lowest indices, so a vertex's root has its number before the vertex is reached.
    let mut labels = vec![0; vertex_count];
    let mut count = 0;
    for vertex in 0..vertex_count {
        let first = root(&mut parent, vertex as u32) as usize;
        if first == vertex {
            labels[vertex] = count;
            count += 1;
        } else {
            labels[vertex] = labels[first];
        }
    }
    Components {
        of_vertex: labels,
        count: count as usize,
    }
}

/// Finds the root of a vertex's tree, and shortens the path to it for later calls.
fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        let above = parent[vertex as usize];
        parent[vertex as usize] = parent[above as usize];
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, point, sheet};
    use proptest::{collection::vec, prelude::*};

    #[test]
    fn a_cube_has_the_edges_of_eulers_formula() {
        let cube = cube();
        let edges = edges(&cube.faces);
        assert_eq!(cube.vertices.len() + cube.faces.len() - edges.len(), 2);
        assert!(edges.is_sorted() && edges.iter().all(|[a, b]| a < b));
        assert!(super::edges(&[[4, 4, 4]]).is_empty());
    }

    #[test]
    fn panels_are_welded_and_connected() {
        let (left, right) = (sheet(2, 2, 0.1), sheet(2, 2, 0.1));
        let vertices: Vec<Vec3> = (left.vertices.iter().copied())
            .chain(right.vertices.iter().map(|&v| v + Vec3::X * 0.2))
            .collect();
        let moved = right.faces.iter().map(|f| f.map(|v| v + 9));
        let faces: Vec<_> = left.faces.iter().copied().chain(moved).collect();
        assert_eq!(components(18, &faces).count, 2);
        let first_at = weld(&vertices);
        assert_eq!(
            first_at
                .iter()
                .enumerate()
                .filter(|(i, f)| **f as usize != *i)
                .count(),
            3
        );
        assert_eq!([first_at[9], first_at[12], first_at[15]], [2, 5, 8]);
        let welded: Vec<_> = faces.iter().map(|f| f.map(|v| first_at[v as usize])).collect();
        // The three duplicates have no faces left.
        assert_eq!(components(18, &welded).count, 1 + 3);
    }

    proptest! {
        #[test]
        fn welding_does_not_depend_on_the_grid(places in vec(point(2.0), 1..50), shift in point(3e-7)) {
            let count = places.len();
            let twice: Vec<Vec3> = places.iter().copied()
                .chain(places.iter().map(|&p| p + shift)).collect();
            let first_at = weld(&twice);
            for i in 0..count {
                let expected = (0..i).find(|&j| places[i].distance(places[j]) <= WELD_DISTANCE);
                prop_assert_eq!(first_at[i] as usize, expected.unwrap_or(i));
                prop_assert_eq!(first_at[count + i], first_at[i]);
            }
        }
    }

    #[test]
    fn welding_many_identical_points_is_quick() {
        assert!(weld(&[Vec3::ONE; 100_000]).iter().all(|&i| i == 0));
        assert_eq!(weld(&[Vec3::NAN, Vec3::NAN]), [0, 1]);
    }
}
