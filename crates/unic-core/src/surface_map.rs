//! Carrying quantities from the vertices of one mesh to other points.

use crate::{
    mesh::TriMesh,
    skinning::{SkinningWeights, WeightsError},
    surface::{Surface, SurfacePoint},
};
use glam::Vec3;
use thiserror::Error;

/// Where points lie on a mesh: for each the vertices of a face and their shares, by closest point.
///
/// Found once, on rest shapes; it then carries anything that the vertices have (displacements,
/// skinning weights, colours) by linear interpolation over the face.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMap {
    vertex_count: usize,
    samples: Vec<Sample>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    corners: [u32; 3],
    barycentric: Vec3,
    distance: f32,
}

/// Why points cannot be placed on a mesh.
#[derive(Debug, Error, PartialEq)]
pub enum SurfaceMapError {
    /// Nothing to be near to.
    #[error("surface map: the mesh has no faces")]
    NoFaces,
    /// NaN or infinity.
    #[error("surface map: point {point} is not finite")]
    NotFinite {
        /// The point.
        point: usize,
    },
    /// A field with another number of values than the mesh has vertices.
    #[error("surface map: expected {expected} values (one a vertex), found {found}")]
    Length {
        /// Vertices of the mesh.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// Weights that cannot be carried over.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

impl SurfaceMap {
    /// Places `points` on `mesh`, both in one space, metres.
    ///
    /// # Errors
    /// A mesh without faces, points that are not finite.
    pub fn new(mesh: &TriMesh, points: &[Vec3]) -> Result<Self, SurfaceMapError> {
        if mesh.faces.is_empty() {
            return Err(SurfaceMapError::NoFaces);
        }
        let surface = Surface::build(mesh);
        let place = |(point, &p): (usize, &Vec3)| match surface.closest(p) {
            Some(hit) => Ok(Sample::new(mesh, &hit)),
            None => Err(SurfaceMapError::NotFinite { point }),
        };
        Ok(Self {
            vertex_count: mesh.vertices.len(),
            samples: points.iter().enumerate().map(place).collect::<Result<_, _>>()?,
        })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// No points.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Distance of each point from the mesh, metres: how far a map stretches.
    pub fn distances(&self) -> impl ExactSizeIterator<Item = f32> {
        self.samples.iter().map(|s| s.distance)
    }

    /// The vertices that point `i` interpolates, with their shares.
    ///
    /// # Panics
    /// When there is no point `i`.
    pub fn sample(&self, i: usize) -> ([u32; 3], Vec3) {
        (self.samples[i].corners, self.samples[i].barycentric)
    }

    /// Interpolates a vector field, one value a vertex of the mesh, into one a point.
    ///
    /// # Errors
    /// Another number of values than vertices; `out` is then left alone.
    pub fn vectors(&self, field: &[Vec3], out: &mut Vec<Vec3>) -> Result<(), SurfaceMapError> {
        self.check_length(field.len())?;
        out.clear();
        out.extend(self.samples.iter().map(|s| {
            let [a, b, c] = s.corners.map(|v| field[v as usize]);
            a * s.barycentric.x + b * s.barycentric.y + c * s.barycentric.z
        }));
        Ok(())
    }

    /// Interpolates one number a vertex of the mesh into one a point.
    ///
    /// # Errors
    /// Another number of values than vertices.
    pub fn numbers(&self, field: &[f32]) -> Result<Vec<f32>, SurfaceMapError> {
        self.check_length(field.len())?;
        let at = |sample: &Sample| {
            let corners = sample.corners.map(|v| field[v as usize]);
            let [low, high] = [f32::min, f32::max].map(|f| corners.into_iter().fold(corners[0], f));
            // Shares that sum to one but for rounding must not lead out of the range of the corners.
            Vec3::from_array(corners).dot(sample.barycentric).clamp(low, high)
        };
        Ok(self.samples.iter().map(at).collect())
    }

    /// Interpolates skinning weights.
    ///
    /// # Errors
    /// Weights of another number of vertices.
    pub fn weights(&self, weights: &SkinningWeights) -> Result<SkinningWeights, SurfaceMapError> {
        self.check_length(weights.len())?;
        let mut dense = vec![0.0; weights.joint_count()];
        let rows = self.samples.iter().map(|sample| {
            dense.fill(0.0);
            for (v, share) in sample.corners.iter().zip(sample.barycentric.to_array()) {
                weights.row(*v as usize).for_each(|(j, w)| dense[j] += share * w);
            }
            let kept = dense.iter().copied().enumerate().filter(|(_, w)| *w > 0.0);
            kept.collect::<Vec<_>>().into_iter()
        });
        Ok(SkinningWeights::from_rows(weights.joint_count(), rows)?)
    }

    fn check_length(&self, found: usize) -> Result<(), SurfaceMapError> {
        if found == self.vertex_count {
            return Ok(());
        }
        Err(SurfaceMapError::Length {
            expected: self.vertex_count,
            found,
        })
    }
}

impl Sample {
    fn new(mesh: &TriMesh, hit: &SurfacePoint) -> Self {
        Self {
            corners: mesh.faces[hit.face as usize],
            barycentric: hit.barycentric,
            distance: hit.distance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{point, sheet, sphere};
    use proptest::{collection::vec, prelude::*};

    proptest! {
        #[test]
        fn linear_fields_on_a_plane_are_reproduced(
            points in vec((0.0f32..1.0, -0.2f32..0.2, 0.0f32..1.0), 1..50), slope in point(2.0),
        ) {
            let mesh = sheet(4, 4, 0.25);
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
            let map = SurfaceMap::new(&mesh, &points).unwrap();
            let value = |p: Vec3| slope * (1.0 + 2.0 * p.x - 3.0 * p.z);
            let field: Vec<Vec3> = mesh.vertices.iter().map(|&v| value(v)).collect();
            let mut out = Vec::new();
            map.vectors(&field, &mut out).unwrap();
            for ((p, found), distance) in points.iter().zip(&out).zip(map.distances()) {
                // Where faces meet, squared distances tell places apart to √ε of the distance.
                let misplaced = 1e-6 + distance * f32::EPSILON.sqrt();
                let gradient = slope.length() * 13f32.sqrt();
                prop_assert!((*found - value(p.with_y(0.0))).length() < gradient * misplaced + 1e-5);
                prop_assert!((distance - p.y.abs()).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn the_vertices_themselves_keep_their_weights() {
        let mesh = sphere(2, 0.3);
        let row = |v: &Vec3| [v.x.abs(), v.y.abs() + 0.01, v.z.abs()];
        let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
        let weights = SkinningWeights::from_dense(&dense, mesh.vertices.len(), 3).unwrap();
        let map = SurfaceMap::new(&mesh, &mesh.vertices).unwrap();
        let carried = map.weights(&weights).unwrap();
        for (a, b) in carried.to_dense().iter().zip(weights.to_dense()) {
            assert!((a - b).abs() < 1e-6);
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let mesh = sheet(1, 1, 1.0);
        let found = SurfaceMap::new(&mesh, &[Vec3::ZERO, Vec3::NAN]);
        assert_eq!(found, Err(SurfaceMapError::NotFinite { point: 1 }));
        let found = SurfaceMap::new(&TriMesh::default(), &[]);
        assert_eq!(found, Err(SurfaceMapError::NoFaces));
        let map = SurfaceMap::new(&mesh, &[]).unwrap();
        let (expected, found) = (4, 1);
        let error = Err(SurfaceMapError::Length { expected, found });
        assert_eq!(map.vectors(&[Vec3::X], &mut Vec::new()), error);
    }
}
