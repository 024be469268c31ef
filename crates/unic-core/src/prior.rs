//! Prior: the expected displacements of the garment in a given motion.
//!
//! For training and tools. The field adds its displacements to those of the prior.

use crate::{
    network::Linear,
    recurrence::Recurrence,
    replay::Replay,
    surface_map::{SurfaceMap, SurfaceMapError},
};
use glam::Vec3;

/// Mean and principal components of the displacements, with coefficients predicted from the motion.
///
/// The displacement of vertex i, in its own rotated frame, is u_i = ū_i + Σ_k a_k φ_{k,i} in
/// metres. A ridge regression predicts the coefficients a = B (c_{t−1}, c_t) + b from a pair of
/// motion vectors. A [`Recurrence`], which remembers earlier motion, adds to them. Training has
/// scaled the weights of both by their shares of the blend.
///
/// The field learns the remainder. A linear map with few outputs overfits less than a network, so
/// that the state of a vertex stays near zero in motions unlike those of training.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// Mean displacement ū of each vertex, metres.
    pub mean: Vec<Vec3>,
    /// Components φ, V × K vectors in metres; the K components of a vertex are adjacent. The first
    /// are principal components of the displacements. With a replay, the last ones may be shapes of
    /// fine wrinkles.
    pub components: Vec<Vec3>,
    /// Map (B, b) from a normalised pair of motion vectors, 2 D numbers, to K coefficients.
    pub map: Linear,
    /// Recurrent unit that adds to the K coefficients, if the model has one.
    pub recurrence: Option<Recurrence>,
    /// Residuals of training clips that are added to the last of the K coefficients, if the model
    /// has some.
    pub replay: Option<Replay>,
}

impl Prior {
    /// Makes a prior of the mean displacement alone; `inputs` is the length of a pair of motion
    /// vectors.
    pub fn constant(mean: Vec<Vec3>, inputs: usize) -> Self {
        let map = Linear {
            inputs,
            outputs: 0,
            weight: Vec::new(),
            bias: Vec::new(),
        };
        Self {
            mean,
            components: Vec::new(),
            map,
            recurrence: None,
            replay: None,
        }
    }

    /// Number of components K.
    pub fn len(&self) -> usize {
        self.map.outputs
    }

    /// Returns true if the prior is the mean displacement alone.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the linear map's coefficients for a normalised pair of motion vectors.
    ///
    /// The recurrence, if there is one, adds its part by [`Recurrence::add_to`].
    pub fn coefficients(&self, pair: &[f32], out: &mut Vec<f32>) {
        out.clear();
        if self.is_empty() {
            return;
        }
        let rows = self.map.weight.chunks_exact(self.map.inputs).zip(&self.map.bias);
        out.extend(rows.map(|(row, b)| b + row.iter().zip(pair).map(|(w, x)| w * x).sum::<f32>()));
    }

    /// Length of the recurrence's state; 0 without a recurrence.
    pub fn state_len(&self) -> usize {
        self.recurrence.as_ref().map_or(0, Recurrence::state_len)
    }

    /// Returns the displacement of one vertex in its own rotated frame, metres.
    pub fn displacement(&self, vertex: usize, coefficients: &[f32]) -> Vec3 {
        // A frame needs all components of a vertex, which are therefore adjacent.
        let components = &self.components[vertex * self.len()..(vertex + 1) * self.len()];
        components
            .iter()
            .zip(coefficients)
            .fold(self.mean[vertex], |sum, (component, &a)| sum + *component * a)
    }

    /// Appends components that the motion does not move: V × R vectors in metres, those of a vertex
    /// adjacent. A [`Replay`] moves them.
    ///
    /// # Panics
    /// When there is not a whole number of vectors for each vertex.
    pub fn append_components(&mut self, shapes: &[Vec3]) {
        let (vertices, count) = (self.mean.len(), self.len());
        assert!(shapes.len().is_multiple_of(vertices.max(1)));
        let added = shapes.len() / vertices.max(1);
        let [old, new] = [(&self.components[..], count), (shapes, added)];
        let of_vertex = |(vectors, n): (&[Vec3], usize), v: usize| vectors[v * n..(v + 1) * n].to_vec();
        self.components = (0..vertices)
            .flat_map(|v| [of_vertex(old, v), of_vertex(new, v)].concat())
            .collect();
        self.extend_maps();
    }

    /// Appends zero rows to map and recurrence, for components that the motion does not move.
    pub fn extend_maps(&mut self) {
        let count = self.components.len() / self.mean.len().max(1);
        self.map.append_zero_outputs(count);
        if let Some(recurrence) = &mut self.recurrence {
            recurrence.head.append_zero_outputs(count);
        }
    }

    /// The prior without its replay, and without the last components that nothing else moves.
    pub fn without_replay(&self) -> Self {
        let kept = self.len() - self.replayed_len();
        let of_vertices = self.components.chunks_exact(self.len().max(1));
        let mut prior = Self {
            mean: self.mean.clone(),
            components: of_vertices.flat_map(|c| &c[..kept]).copied().collect(),
            map: self.map.clone(),
            recurrence: self.recurrence.clone(),
            replay: None,
        };
        prior.map.truncate_outputs(kept);
        if let Some(recurrence) = &mut prior.recurrence {
            recurrence.head.truncate_outputs(kept);
        }
        prior
    }

    /// Number of the last components that nothing but the replay moves: their rows are zero.
    pub fn replayed_len(&self) -> usize {
        let replayed = self.replay.as_ref().map_or(0, |r| r.library().coefficients());
        let is_moved = |k: usize| {
            let maps = [Some(&self.map), self.recurrence.as_ref().map(|r| &r.head)];
            (maps.into_iter().flatten()).any(|map| map.row(k).iter().any(|w| *w != 0.0) || map.bias[k] != 0.0)
        };
        (1..=replayed).take_while(|k| !is_moved(self.len() - k)).count()
    }

    /// Transfers the prior to another mesh of the garment.
    ///
    /// # Errors
    /// A map from a mesh with another number of vertices.
    pub fn on_mesh(&self, map: &SurfaceMap) -> Result<Self, SurfaceMapError> {
        let mut moved = Self {
            mean: Vec::new(),
            components: Vec::new(),
            map: self.map.clone(),
            recurrence: self.recurrence.clone(),
            replay: self.replay.clone(),
        };
        map.interpolate_vectors(&self.mean, &mut moved.mean)?;
        let (count, vertices) = (self.len(), moved.mean.len());
        moved.components.resize(count * vertices, Vec3::ZERO);
        let mut component = Vec::new();
        for k in 0..count {
            let from: Vec<Vec3> = self.components.iter().skip(k).step_by(count).copied().collect();
            map.interpolate_vectors(&from, &mut component)?;
            for (vertex, value) in component.iter().enumerate() {
                moved.components[vertex * count + k] = *value;
            }
        }
        Ok(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::TriMesh,
        replay::{FEATURES, KEY, KeyMap, Library},
    };

    fn prior() -> Prior {
        Prior {
            mean: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            components: [[Vec3::X, Vec3::Y], [Vec3::Z, Vec3::X], [Vec3::ONE, Vec3::ZERO]].concat(),
            map: Linear {
                inputs: 2,
                outputs: 2,
                weight: vec![1.0, 2.0, 0.0, -1.0],
                bias: vec![0.5, 0.0],
            },
            recurrence: None,
            replay: None,
        }
    }

    #[test]
    fn components_add_to_the_mean_by_linear_coefficients() {
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
    fn still_components_follow_the_others_and_stay_at_zero() {
        let mut extended = prior();
        extended.append_components(&[Vec3::Z, Vec3::X, Vec3::Y]);
        let mut coefficients = Vec::new();
        extended.coefficients(&[1.0, 3.0], &mut coefficients);
        assert_eq!(coefficients, [7.5, -3.0, 0.0]);
        for v in 0..3 {
            assert_eq!(
                extended.displacement(v, &coefficients),
                prior().displacement(v, &coefficients)
            );
        }
        coefficients[2] = 4.0;
        let moved = extended.displacement(1, &coefficients) - prior().displacement(1, &coefficients);
        assert_eq!(moved, Vec3::X * 4.0);
    }

    #[test]
    fn without_its_replay_a_prior_has_the_components_that_the_motion_moves() {
        let replay = |coefficients: usize| {
            let features = Linear {
                inputs: 1,
                outputs: FEATURES,
                weight: vec![1.0; FEATURES],
                bias: vec![0.0; FEATURES],
            };
            let library = Library::new(
                vec![1],
                vec![[0; KEY]],
                vec![1; coefficients],
                vec![1.0; coefficients],
            );
            Replay::new(KeyMap::new(features).unwrap(), library.unwrap())
        };
        let mut extended = prior();
        extended.append_components(&[Vec3::Z, Vec3::X, Vec3::Y]);
        extended.replay = Some(replay(1));
        assert_eq!(extended.without_replay(), prior());
        // The motion moves all of these.
        let mut moved = prior();
        moved.replay = Some(replay(2));
        assert_eq!(moved.without_replay(), prior());
        assert_eq!(prior().without_replay(), prior());
    }

    #[test]
    fn another_mesh_gets_the_components_at_its_points() {
        let mesh = TriMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let map = SurfaceMap::new(&mesh, &[Vec3::X, Vec3::X * 0.5]).unwrap();
        let moved = prior().on_mesh(&map).unwrap();
        let a = [2.0, 1.0];
        assert!((moved.displacement(0, &a) - prior().displacement(1, &a)).length() < 1e-6);
        let middle = (prior().displacement(0, &a) + prior().displacement(1, &a)) / 2.0;
        assert!((moved.displacement(1, &a) - middle).length() < 1e-6);
    }
}
