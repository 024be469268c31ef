//! Prior: the expected displacements of the garment in a given motion.
//!
//! For training and tools. The field adds its displacements to those of the prior.

mod components;

pub use components::Components;

use crate::{
    network::{Linear, apply},
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
    /// Components φ, K for each vertex. The first are principal components of the displacements. With
    /// a replay, the last ones may be shapes of fine wrinkles.
    pub components: Components,
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
            components: Components::default(),
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
        out.resize(self.len(), 0.0);
        apply(&self.map, pair, out);
    }

    /// Length of the recurrence's state; 0 without a recurrence.
    pub fn state_len(&self) -> usize {
        self.recurrence.as_ref().map_or(0, Recurrence::state_len)
    }

    /// Returns the displacement of one vertex in its own rotated frame, metres. The last components may
    /// lack coefficients, which are then zero.
    pub fn displacement(&self, vertex: usize, coefficients: &[f32]) -> Vec3 {
        let (mut scaled, mut displacement) = (Vec::new(), [Vec3::ZERO]);
        self.components.scale(coefficients, &mut scaled);
        self.displacements(vertex, &scaled, &mut displacement);
        displacement[0]
    }

    /// Computes the displacements of the vertices from `first` on, each in its own rotated frame,
    /// metres. The coefficients are [scaled](Components::scale).
    ///
    /// # Panics
    /// With fewer scaled coefficients than components.
    pub fn displacements(&self, first: usize, scaled: &[f32], displacements: &mut [Vec3]) {
        displacements.copy_from_slice(&self.mean[first..][..displacements.len()]);
        self.components.add_to(first, scaled, displacements);
    }

    /// Appends components that the motion does not move: V × R vectors in metres, those of a vertex
    /// adjacent. A [`Replay`] moves them.
    ///
    /// # Panics
    /// When there is not a whole number of vectors for each vertex.
    pub fn append_components(&mut self, shapes: &[Vec3]) {
        let vertices = self.mean.len().max(1);
        assert!(shapes.len().is_multiple_of(vertices));
        let added = Components::of_vectors(shapes, shapes.len() / vertices);
        self.components = self.components.joined(&added);
        self.extend_maps();
    }

    /// Appends zero rows to map and recurrence, for components that the motion does not move.
    pub fn extend_maps(&mut self) {
        let count = self.components.len();
        self.map.append_zero_outputs(count);
        if let Some(recurrence) = &mut self.recurrence {
            recurrence.head.append_zero_outputs(count);
        }
    }

    /// The prior without its replay, and without the last components that nothing else moves.
    pub fn without_replay(&self) -> Self {
        let kept = self.len() - self.replayed_len();
        let mut prior = Self {
            mean: self.mean.clone(),
            components: self.components.truncated(kept),
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
        let (count, vertices) = (self.len(), self.mean.len());
        let mut mean = Vec::new();
        map.interpolate_vectors(&self.mean, &mut mean)?;
        let mut vectors = vec![Vec3::ZERO; count * mean.len()];
        let mut moved = Vec::new();
        for k in 0..count {
            let component: Vec<Vec3> = (0..vertices).map(|v| self.components.vector(v, k)).collect();
            map.interpolate_vectors(&component, &mut moved)?;
            for (vertex, vector) in moved.iter().enumerate() {
                vectors[vertex * count + k] = *vector;
            }
        }
        Ok(Self {
            mean,
            components: Components::of_vectors(&vectors, count),
            map: self.map.clone(),
            recurrence: self.recurrence.clone(),
            replay: self.replay.clone(),
        })
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
            components: Components::of_vectors(
                &[Vec3::X, Vec3::Y, Vec3::Z, Vec3::X, Vec3::ONE, Vec3::ZERO],
                2,
            ),
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
        for lacking in 0..3 {
            let given = &coefficients[..lacking];
            let zeros = [given, &[0.0; 3][lacking..]].concat();
            assert_eq!(extended.displacement(1, given), extended.displacement(1, &zeros));
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
