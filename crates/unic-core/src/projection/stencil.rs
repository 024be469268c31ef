//! Stencils of the quadratic bending energy.

use glam::Vec3;
use std::collections::HashMap;

/// Largest |cotangent| of an angle in a stencil, that of about three degrees. A sliver's would
/// outweigh everything around it.
const MAX_COTANGENT: f32 = 20.0;

/// Factor of the strength along free edges. Hinges smooth a vertex inside the cloth from all sides,
/// a free edge from one side alone, so that it frays where this is 1.
const ROD_STRENGTH: f32 = 3.0;

/// Four vertices x_i with coefficients k_i. Σ k_i x_i is zero where the surface or its edge is
/// straight, and grows with its curvature.
#[derive(Clone, Copy, Debug)]
pub(super) struct BendingStencil {
    /// Distinct vertices.
    pub(super) vertices: [u32; 4],
    /// Coefficients, which sum to zero.
    pub(super) coefficients: [f32; 4],
    /// Factor of the configured strength.
    pub(super) strength: f32,
}

/// Lists the stencils of all hinges and of the free edges of a mesh, given its sorted `edges`.
pub(super) fn bending_stencils(rest: &[Vec3], faces: &[[u32; 3]], edges: &[[u32; 2]]) -> Vec<BendingStencil> {
    let mut opposite: Vec<Vec<u32>> = vec![Vec::new(); edges.len()];
    for &[a, b, c] in faces {
        for (ends, corner) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            // Faces with a repeated vertex have edges that are not in the list.
            if let Ok(edge) = edges.binary_search(&ends) {
                opposite[edge].push(corner);
            }
        }
    }
    let hinges = edges
        .iter()
        .zip(&opposite)
        .filter_map(|(&ends, corners)| match corners[..] {
            [c, d] if c != d => Some(hinge(rest, [ends[0], ends[1], c, d])),
            _ => None,
        });
    let free = edges
        .iter()
        .zip(&opposite)
        .filter(|(_, corners)| corners.len() == 1);
    let free: Vec<[u32; 2]> = free.map(|(&ends, _)| ends).collect();
    hinges.chain(rods(&free)).collect()
}

/// Returns the stencil of an edge (0, 1) and the corners opposite to it (Bergou et al. 2006, "A
/// quadratic bending model for inextensible surfaces", eq. 5).
fn hinge(rest: &[Vec3], vertices: [u32; 4]) -> BendingStencil {
    let [a, b, c, d] = vertices.map(|v| rest[v as usize]);
    let at_a = [cotangent(a, b, c), cotangent(a, b, d)];
    let at_b = [cotangent(b, a, c), cotangent(b, a, d)];
    BendingStencil {
        vertices,
        coefficients: [
            at_b[0] + at_b[1],
            at_a[0] + at_a[1],
            -(at_a[0] + at_b[0]),
            -(at_a[1] + at_b[1]),
        ],
        strength: 1.0,
    }
}

/// Returns the cotangent of the angle at `corner` between the directions to two points.
fn cotangent(corner: Vec3, p: Vec3, q: Vec3) -> f32 {
    let (u, v) = (p - corner, q - corner);
    let cotangent = u.dot(v) / u.cross(v).length();
    // A corner without an angle gives 0 / 0 or a quotient by zero.
    match cotangent.is_nan() {
        true => 0.0,
        false => cotangent.clamp(-MAX_COTANGENT, MAX_COTANGENT),
    }
}

/// Lists the stencils of neighbouring free edges: second differences along them.
fn rods(free: &[[u32; 2]]) -> Vec<BendingStencil> {
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    for &[a, b] in free {
        neighbours.entry(a).or_default().push(b);
        neighbours.entry(b).or_default().push(a);
    }
    // In the order of the edges: that of a hash map changes from run to run.
    let mut middles: Vec<u32> = free.iter().flatten().copied().collect();
    middles.sort_unstable();
    middles.dedup();
    let rod = |middle: &u32| match neighbours[middle][..] {
        // A second difference has three vertices. The fourth repeats the middle without effect.
        [before, after] => Some(BendingStencil {
            vertices: [*middle, before, after, *middle],
            coefficients: [1.0, -0.5, -0.5, 0.0],
            strength: ROD_STRENGTH,
        }),
        _ => None,
    };
    middles.iter().filter_map(rod).collect()
}
