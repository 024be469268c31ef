//! Sampling: state on a few well-spread vertices, from which all others are interpolated.
//!
//! For tools: an engine calls [`Model::with_sampling`](crate::Model::with_sampling).
//!
//! The neural field is smooth in space, so it need not be evaluated at every vertex.

mod farthest_points;
mod interpolation;

use crate::mesh::TriMesh;
use farthest_points::farthest_point_samples;
use interpolation::Neighbourhoods;
use thiserror::Error;

/// Largest number of samples from which a vertex is interpolated.
pub const NEIGHBOURS: usize = 8;

/// Samples, the vertices that carry the state, and the weights that interpolate all vertices from
/// them.
///
/// The rest shape determines the weights: moving least squares (Lancaster and Salkauskas 1981) over
/// the samples that are fewest edges away. So displacements that are linear functions of the rest
/// position are reproduced. Displacements are in the vertices' own rotated frames: interpolated in
/// the world, they would shear where the garment bends.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    samples: Vec<u32>,
    rows: Vec<InterpolationRow>,
}

/// Interpolation of one vertex from its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InterpolationRow {
    /// Places in the list of samples.
    pub samples: [u32; NEIGHBOURS],
    /// Weights of the samples, which sum to one. Unused entries are zero.
    pub weights: [f32; NEIGHBOURS],
}

/// Error of samples that are not valid.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SamplingError {
    /// Share of vertices that is not above 0 and up to 1.
    #[error("sampling: expected a share above 0 and up to 1, found {found}")]
    Share {
        /// Share that was given.
        found: f32,
    },
    /// Samples that are empty, beyond the vertices or repeated.
    #[error("sampling: expected distinct vertices below {vertices}, found {found}")]
    Vertices {
        /// Number of vertices of the mesh.
        vertices: usize,
        /// Description of the samples that were given.
        found: String,
    },
}

impl Sampling {
    /// Takes `share` of the vertices as samples by farthest-point sampling.
    ///
    /// Each sample is the vertex farthest from those before, in every connected component of the
    /// garment by itself.
    ///
    /// # Errors
    /// Fails on a share that is not above 0 and up to 1.
    pub fn of_share(rest: &TriMesh, share: f32) -> Result<Self, SamplingError> {
        // Written so that NaN fails.
        if !(share > 0.0 && share <= 1.0) {
            return Err(SamplingError::Share { found: share });
        }
        Self::new(rest, farthest_point_samples(rest, share))
    }

    /// Takes the given vertices as samples.
    ///
    /// # Errors
    /// Fails on no samples, on a sample beyond the vertices, and on one that is given twice.
    pub fn new(rest: &TriMesh, samples: Vec<u32>) -> Result<Self, SamplingError> {
        let vertices = rest.vertices.len();
        let mut is_sample = vec![false; vertices];
        let refused = |found: String| SamplingError::Vertices { vertices, found };
        if samples.is_empty() {
            return Err(refused("none".into()));
        }
        for &vertex in &samples {
            match is_sample.get_mut(vertex as usize) {
                Some(slot @ false) => *slot = true,
                Some(true) => return Err(refused(format!("{vertex} twice"))),
                None => return Err(refused(vertex.to_string())),
            }
        }
        let rows = Neighbourhoods::new(rest, &samples).rows();
        Ok(Self { samples, rows })
    }

    /// Vertices that carry the state.
    pub fn samples(&self) -> &[u32] {
        &self.samples
    }

    /// Number of samples as a share of all vertices.
    pub fn share(&self) -> f32 {
        self.samples.len() as f32 / self.rows.len() as f32
    }

    /// Takes the interpolation of each vertex.
    pub(crate) fn into_rows(self) -> Vec<InterpolationRow> {
        self.rows
    }

    /// Interpolation of each vertex.
    pub(crate) fn rows(&self) -> &[InterpolationRow] {
        &self.rows
    }
}

/// Interpolation of some vertices of a rest mesh from distinct samples.
pub(crate) fn rows_of(rest: &TriMesh, samples: &[u32], vertices: &[u32]) -> Vec<InterpolationRow> {
    Neighbourhoods::new(rest, samples).rows_of(vertices.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::sheet;
    use glam::Vec3;

    /// Sheet that is bent around a cylinder: a neighbourhood is almost, but not exactly, flat.
    fn bent() -> TriMesh {
        let mut mesh = sheet(40, 30, 0.01);
        for v in &mut mesh.vertices {
            let angle = v.x / 0.3;
            *v = Vec3::new(0.3 * angle.sin(), v.z, 0.3 * angle.cos());
        }
        mesh
    }

    fn interpolated(sampling: &Sampling, function: impl Fn(u32) -> f32) -> Vec<f32> {
        let value = |row: &InterpolationRow| -> f32 {
            let samples = row.samples.iter().zip(row.weights);
            samples
                .map(|(&s, w)| w * function(sampling.samples()[s as usize]))
                .sum()
        };
        sampling.rows().iter().map(value).collect()
    }

    /// Holds everywhere but at a few vertices near corners of the sheet: these are extrapolated,
    /// which weights of limited size cannot do exactly.
    #[test]
    fn linear_functions_are_reproduced() {
        let mesh = bent();
        for share in [0.5, 0.2, 0.05] {
            let sampling = Sampling::of_share(&mesh, share).unwrap();
            assert!((sampling.share() - share).abs() < 0.01, "{}", sampling.share());
            for direction in [Vec3::X, Vec3::Y, Vec3::new(0.3, -0.5, 0.8)] {
                let at = |v: u32| 0.7 + mesh.vertices[v as usize].dot(direction);
                let found = interpolated(&sampling, at).into_iter().enumerate();
                let errors: Vec<f32> = found.map(|(v, x)| (x - at(v as u32)).abs()).collect();
                let largest = errors.iter().copied().fold(0.0, f32::max);
                let beyond = errors.iter().filter(|e| **e > 2e-4).count();
                assert!(
                    largest < 4e-3 && beyond <= 8,
                    "{share}: {beyond} beyond, {largest} m"
                );
            }
        }
    }

    #[test]
    fn weights_are_bounded_and_samples_keep_their_own_value() {
        let mesh = bent();
        let sampling = Sampling::of_share(&mesh, 0.1).unwrap();
        for row in sampling.rows() {
            let (sum, size) = row
                .weights
                .iter()
                .fold((0.0, 0.0), |(s, a), w| (s + w, a + w.abs()));
            assert!((sum - 1.0).abs() < 1e-5 && size < 3.0, "{row:?}");
        }
        for (place, &vertex) in sampling.samples().iter().enumerate() {
            let row = sampling.rows()[vertex as usize];
            assert_eq!((row.samples[0], row.weights[0]), (place as u32, 1.0));
        }
    }

    #[test]
    fn samples_are_well_spread_and_nested() {
        let mesh = bent();
        let [coarse, fine] = [0.05, 0.2].map(|share| Sampling::of_share(&mesh, share).unwrap());
        assert_eq!(fine.samples()[..coarse.samples().len()], *coarse.samples());
        let gap = |v: &Vec3| {
            let to = |&s: &u32| mesh.vertices[s as usize].distance(*v);
            coarse.samples().iter().map(to).fold(f32::INFINITY, f32::min)
        };
        // 60 samples on 0.12 m² of cloth: the spacing of a grid of them is 4.5 cm.
        let widest = mesh.vertices.iter().map(gap).fold(0.0, f32::max);
        assert!(widest < 0.045, "{widest}");
    }

    #[test]
    fn components_are_interpolated_separately() {
        let mut mesh = sheet(10, 10, 0.01);
        let other: Vec<Vec3> = mesh.vertices.iter().map(|v| *v + Vec3::Z * 0.002).collect();
        let count = mesh.vertices.len() as u32;
        let faces: Vec<_> = mesh.faces.iter().map(|f| f.map(|v| v + count)).collect();
        mesh.vertices.extend(other);
        mesh.faces.extend(faces);
        let sampling = Sampling::of_share(&mesh, 0.1).unwrap();
        let layer = |v: u32| f32::from(v >= count);
        for (v, found) in interpolated(&sampling, layer).iter().enumerate() {
            assert!((found - layer(v as u32)).abs() < 1e-5);
        }
    }

    #[test]
    fn copies_of_a_seam_vertex_have_the_same_row() {
        let sewn = bent();
        let corners = || sewn.faces.iter().flatten().map(|&v| sewn.vertices[v as usize]);
        let faces = (0..sewn.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
        let cut = TriMesh::new(corners().collect(), faces.collect()).unwrap();
        let first_at = crate::topology::weld(&cut.vertices);
        for share in [0.02, 0.1, 0.5] {
            let sampling = Sampling::of_share(&cut, share).unwrap();
            for (row, &first) in sampling.rows().iter().zip(&first_at) {
                assert_eq!(*row, sampling.rows()[first as usize]);
            }
        }
    }

    #[test]
    fn invalid_samples_are_refused() {
        let mesh = sheet(2, 2, 0.1);
        for share in [0.0, -1.0, 1.5, f32::NAN] {
            assert!(Sampling::of_share(&mesh, share).is_err());
        }
        for samples in [vec![], vec![9], vec![1, 1]] {
            assert!(Sampling::new(&mesh, samples).is_err());
        }
        // A vertex without faces is a component by itself; without a sample there, the nearest one
        // serves.
        let mut loose = mesh;
        loose.vertices.push(Vec3::X * 3.0);
        assert_eq!(Sampling::of_share(&loose, 0.01).unwrap().samples().len(), 5);
        let one = Sampling::new(&loose, vec![0]).unwrap();
        assert_eq!(interpolated(&one, |_| 2.0), vec![2.0; 10]);
    }
}
