//! Merging of vertices into particles, and the order of particles in memory.

use glam::{UVec3, Vec3};
use unic_core::{closest::ClosestVertex, topology::weld};

/// Mapping from the vertices of a mesh to the particles of the solver.
pub(super) struct ParticleOrder {
    /// Particle of each vertex.
    pub(super) particle_of_vertex: Vec<u32>,
    /// Rest position of each particle, metres.
    pub(super) positions: Vec<Vec3>,
}

impl ParticleOrder {
    /// Merges vertices at the same position into particles and sorts these along a space-filling
    /// curve.
    ///
    /// Only corners of faces with three different positions make particles. Each of the other
    /// vertices is mapped to the nearest particle.
    pub(super) fn new(vertices: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let first_at = weld(vertices);
        let mut is_used = vec![false; vertices.len()];
        for corners in faces.iter().map(|f| f.map(|v| first_at[v as usize])) {
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                corners.iter().for_each(|&v| is_used[v as usize] = true);
            }
        }
        let mut used: Vec<u32> = (0..vertices.len() as u32)
            .filter(|&v| is_used[v as usize])
            .collect();
        sort_along_curve(&mut used, vertices);
        let positions: Vec<Vec3> = used.iter().map(|&v| vertices[v as usize]).collect();
        let mut particle = vec![u32::MAX; vertices.len()];
        for (p, &vertex) in used.iter().enumerate() {
            particle[vertex as usize] = p as u32;
        }
        let nearest = ClosestVertex::build(&positions);
        let of_vertex = |v: usize| {
            let first = first_at[v] as usize;
            match particle[first] {
                u32::MAX => nearest.nearest(vertices[v]).map_or(0, |(p, _)| p as u32),
                found => found,
            }
        };
        Self {
            particle_of_vertex: (0..vertices.len()).map(of_vertex).collect(),
            positions,
        }
    }
}

/// Sorts vertices by the Morton code of their position in the bounding box, then by coordinates.
fn sort_along_curve(used: &mut [u32], vertices: &[Vec3]) {
    let position = |v: u32| vertices[v as usize];
    let low = used.iter().fold(Vec3::INFINITY, |low, &v| low.min(position(v)));
    let high = (used.iter()).fold(Vec3::NEG_INFINITY, |high, &v| high.max(position(v)));
    // Ten bits per axis. A garment of one point has no extent to divide by.
    let cells_per_metre = 1023.0 / (high - low).max_element().max(f32::MIN_POSITIVE);
    let key = |v: u32| {
        let p = position(v);
        let code = morton(((p - low) * cells_per_metre).as_uvec3());
        // The coordinates break ties within a cell. No two vertices are at the same position, so
        // that the order does not depend on the numbering of the input.
        (code, p.to_array().map(f32::to_bits))
    };
    used.sort_by_cached_key(|&v| key(v));
}

/// Interleaves the lowest ten bits of three numbers.
fn morton(cell: UVec3) -> u32 {
    let spread = |mut x: u32| {
        x &= 0x3ff;
        x = (x | (x << 16)) & 0x0300_00ff;
        x = (x | (x << 8)) & 0x0300_f00f;
        x = (x | (x << 4)) & 0x030c_30c3;
        (x | (x << 2)) & 0x0924_9249
    };
    spread(cell.x) | (spread(cell.y) << 1) | (spread(cell.z) << 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seam_vertices_are_merged_and_unused_vertices_follow_the_nearest_particle() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X, Vec3::X * 1.4];
        let order = ParticleOrder::new(&corners, &[[0, 1, 2], [0, 3, 2]]);
        let particle = order.particle_of_vertex;
        assert_eq!(order.positions.len(), 3);
        assert_eq!(particle[1], particle[3]);
        assert_eq!(particle[4], particle[1]);
        assert_eq!(order.positions[particle[2] as usize], Vec3::Y);
    }

    #[test]
    fn morton_codes_interleave() {
        assert_eq!(morton(UVec3::new(1, 0, 1)), 0b101);
        assert_eq!(morton(UVec3::new(2, 1, 0)), 0b1010);
        assert_eq!(morton(UVec3::splat(1023)), (1 << 30) - 1);
    }
}
