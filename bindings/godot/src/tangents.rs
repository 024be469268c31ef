//! Tangents, which normal maps need.

use crate::surface::Surface;
use glam::Vec3;

/// Tangents of a surface in motion, along the texture's u.
#[derive(Clone, Debug)]
pub struct Tangents {
    /// Differences of texture coordinates along the first two edges of each triangle, with v upwards,
    /// so that the tangent is `a * first edge + b * second edge`; empty without texture coordinates.
    weights: Vec<[f32; 2]>,
    /// Sign of the binormal, `sign * normal x tangent`, which points along the texture's v, upwards.
    signs: Vec<f32>,
    /// Tangents of the last frame, before they are perpendicular to the normals.
    sums: Vec<Vec3>,
}

impl Tangents {
    /// Prepares the tangents of a surface.
    pub fn new(surface: &Surface) -> Self {
        let count = surface.sources.len();
        let mut turns = vec![0.0; count];
        let mut weights = Vec::new();
        if let Some(uvs) = &surface.uvs {
            for corners in surface.indices.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|corner| uvs[corner as usize]);
                // Texture coordinates begin at the upper left corner.
                let (u1, v1) = (b[0] - a[0], a[1] - b[1]);
                let (u2, v2) = (c[0] - a[0], a[1] - c[1]);
                let area = u1 * v2 - u2 * v1;
                weights.push([v2 * area.signum(), -v1 * area.signum()]);
                // The corners are clockwise.
                corners.iter().for_each(|&corner| turns[corner as usize] -= area);
            }
        }
        let sign = |turn: f32| if turn < 0.0 { -1.0 } else { 1.0 };
        Self {
            weights,
            signs: turns.into_iter().map(sign).collect(),
            sums: vec![Vec3::ZERO; count],
        }
    }

    /// Computes the tangents of a frame: unit vectors perpendicular to the normals, and the signs of
    /// the binormals, one a vertex of the surface. `positions` and `normals` are the model's.
    pub fn update<'a>(
        &'a mut self,
        surface: &'a Surface,
        positions: &[Vec3],
        normals: &'a [Vec3],
    ) -> impl Iterator<Item = (Vec3, f32)> + 'a {
        self.sums.fill(Vec3::ZERO);
        let triangles = surface.indices.as_chunks::<3>().0;
        for (corners, [first, second]) in triangles.iter().zip(&self.weights) {
            let [a, b, c] = corners.map(|corner| positions[surface.sources[corner as usize] as usize]);
            let tangent = *first * (b - a) + *second * (c - a);
            corners
                .iter()
                .for_each(|&corner| self.sums[corner as usize] += tangent);
        }
        let tangent = |(sum, normal): (&Vec3, Vec3)| {
            let along = (*sum - normal * sum.dot(normal)).try_normalize();
            along.unwrap_or_else(|| normal.try_normalize().unwrap_or(Vec3::Z).any_orthonormal_vector())
        };
        let tangents = self.sums.iter().zip(surface.spread(normals)).map(tangent);
        tangents.zip(self.signs.iter().copied())
    }
}
