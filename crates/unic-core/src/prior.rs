//! Where the garment hangs in a given motion, before the field moves its vertices.

use crate::{
    network::Linear,
    recurrence::Recurrence,
    surface_map::{SurfaceMap, SurfaceMapError},
};
use glam::Vec3;

/// A few displacement shapes, u ≈ ū_i + Σ_k a_k φ_{k,i} in the vertices' rotated frames, metres,
/// with a = B (c_{t−1}, c_t) + b by ridge regression from a pair of motion vectors, and what a
/// [`Recurrence`] that remembers the motion adds to it: both are shares of one blend.
///
/// The field learns what remains. A linear map of few shapes cannot overfit as a network can, so
/// that the state is zero where nothing better is known than where the garment usually hangs.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// ū, one a vertex.
    pub mean: Vec<Vec3>,
    /// φ: V × K, the shapes of one vertex side by side.
    pub shapes: Vec<Vec3>,
    /// B and b: normalised pairs (2 D numbers) to K coefficients; beside a recurrence, its share of the blend.
    pub map: Linear,
    /// Adds its share to the K coefficients; none leaves them linear.
    pub recurrence: Option<Recurrence>,
}

impl Prior {
    /// The mean alone, without shapes; `inputs` is twice the length of the motion vector.
    pub fn constant(mean: Vec<Vec3>, inputs: usize) -> Self {
        let map = Linear {
            inputs,
            outputs: 0,
            weight: Vec::new(),
            bias: Vec::new(),
        };
        Self {
            mean,
            shapes: Vec::new(),
            map,
            recurrence: None,
        }
    }

    /// Number of shapes K.
    pub fn len(&self) -> usize {
        self.map.outputs
    }

    /// Is it the mean alone?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Coefficients a of a normalised pair of motion vectors by the linear map: all of them
    /// without a recurrence, else its share.
    pub fn coefficients(&self, pair: &[f32], out: &mut Vec<f32>) {
        out.clear();
        if self.is_empty() {
            return;
        }
        let rows = self.map.weight.chunks_exact(self.map.inputs).zip(&self.map.bias);
        out.extend(rows.map(|(row, b)| b + row.iter().zip(pair).map(|(w, x)| w * x).sum::<f32>()));
    }

    /// Numbers that it remembers of the motion.
    pub fn state_len(&self) -> usize {
        self.recurrence.as_ref().map_or(0, Recurrence::state_len)
    }

    /// Displacement of one vertex.
    pub fn displacement(&self, vertex: usize, coefficients: &[f32]) -> Vec3 {
        let shapes = &self.shapes[vertex * self.len()..(vertex + 1) * self.len()];
        shapes
            .iter()
            .zip(coefficients)
            .fold(self.mean[vertex], |sum, (s, &a)| sum + *s * a)
    }

    /// The same prior on another mesh of the garment.
    ///
    /// # Errors
    /// A map of another mesh.
    pub fn on_mesh(&self, map: &SurfaceMap) -> Result<Self, SurfaceMapError> {
        let mut moved = Self {
            mean: Vec::new(),
            shapes: Vec::new(),
            map: self.map.clone(),
            recurrence: self.recurrence.clone(),
        };
        map.vectors(&self.mean, &mut moved.mean)?;
        let (count, vertices) = (self.len(), moved.mean.len());
        moved.shapes.resize(count * vertices, Vec3::ZERO);
        let mut shape = Vec::new();
        for k in 0..count {
            let from: Vec<Vec3> = self.shapes.iter().skip(k).step_by(count).copied().collect();
            map.vectors(&from, &mut shape)?;
            for (vertex, value) in shape.iter().enumerate() {
                moved.shapes[vertex * count + k] = *value;
            }
        }
        Ok(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;

    fn prior() -> Prior {
        Prior {
            mean: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            shapes: [[Vec3::X, Vec3::Y], [Vec3::Z, Vec3::X], [Vec3::ONE, Vec3::ZERO]].concat(),
            map: Linear {
                inputs: 2,
                outputs: 2,
                weight: vec![1.0, 2.0, 0.0, -1.0],
                bias: vec![0.5, 0.0],
            },
            recurrence: None,
        }
    }

    #[test]
    fn shapes_add_to_the_mean_by_linear_coefficients() {
        let mut coefficients = Vec::new();
        prior().coefficients(&[1.0, 3.0], &mut coefficients);
        assert_eq!(coefficients, [7.5, -3.0]);
        assert_eq!(prior().displacement(1, &coefficients), Vec3::new(-2.0, 0.0, 7.5));
        Prior::constant(vec![Vec3::Y], 4).coefficients(&[0.0; 4], &mut coefficients);
        assert!(coefficients.is_empty());
        assert_eq!(
            Prior::constant(vec![Vec3::Y], 4).displacement(0, &coefficients),
            Vec3::Y
        );
    }

    #[test]
    fn another_mesh_gets_the_shapes_of_its_points() {
        let mesh = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let map = SurfaceMap::new(&mesh, &[Vec3::X, Vec3::X * 0.5]).unwrap();
        let moved = prior().on_mesh(&map).unwrap();
        let a = [2.0, 1.0];
        assert!((moved.displacement(0, &a) - prior().displacement(1, &a)).length() < 1e-6);
        let middle = (prior().displacement(0, &a) + prior().displacement(1, &a)) / 2.0;
        assert!((moved.displacement(1, &a) - middle).length() < 1e-6);
    }
}
