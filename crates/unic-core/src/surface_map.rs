//! Interpolation of quantities from the vertices of a mesh to other points.
//!
//! For tools that transfer a model or a capture to another mesh.

use crate::{
    mesh::TriMesh,
    skinning::{SkinningWeights, WeightsError},
    surface::{Surface, SurfacePoint},
};
use glam::Vec3;
use thiserror::Error;

/// Closest points of a mesh to other points, as barycentric coordinates in its faces.
///
/// They are found once, on rest shapes. The map then carries any quantity of the vertices
/// (displacements, skinning weights, colours) to the points by linear interpolation over the face.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMap {
    vertex_count: usize,
    points: Vec<MappedPoint>,
}

/// Point of a [`SurfaceMap`] with its closest point on the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPoint {
    /// Vertices of the closest face.
    pub corners: [u32; 3],
    /// Barycentric coordinates of the closest point: no weight is negative, and they sum to one.
    pub barycentric: Vec3,
    /// Distance from the mesh, metres.
    pub distance: f32,
}

/// Error of points that cannot be mapped to a mesh.
#[derive(Debug, Error, PartialEq)]
pub enum SurfaceMapError {
    /// Mesh without faces.
    #[error("surface map: the mesh has no faces")]
    NoFaces,
    /// Point that is NaN or infinite.
    #[error("surface map: point {point} is not finite")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// Number of values that differs from the number of vertices.
    #[error("surface map: expected {expected} values (one a vertex), found {found}")]
    Length {
        /// Number of vertices of the mesh.
        expected: usize,
        /// Number of values that were given.
        found: usize,
    },
    /// Interpolated skinning weights that are not valid.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

impl SurfaceMap {
    /// Maps `points` to `mesh`, both in the same space, metres.
    ///
    /// # Errors
    /// Fails on a mesh without faces and on points that are not finite.
    pub fn new(mesh: &TriMesh, points: &[Vec3]) -> Result<Self, SurfaceMapError> {
        if mesh.faces.is_empty() {
            return Err(SurfaceMapError::NoFaces);
        }
        let surface = Surface::build(mesh);
        let place = |(point, &p): (usize, &Vec3)| match surface.closest(p) {
            Some(hit) => Ok(MappedPoint::new(mesh, &hit)),
            None => Err(SurfaceMapError::NotFinite { point }),
        };
        Ok(Self {
            vertex_count: mesh.vertices.len(),
            points: points.iter().enumerate().map(place).collect::<Result<_, _>>()?,
        })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Points with their closest points on the mesh.
    pub fn points(&self) -> &[MappedPoint] {
        &self.points
    }

    /// Distance of each point from the mesh, metres.
    pub fn distances(&self) -> impl ExactSizeIterator<Item = f32> {
        self.points.iter().map(|point| point.distance)
    }

    /// Interpolates vectors from the vertices of the mesh to the points, into `out`.
    ///
    /// # Errors
    /// Fails when the number of values is not the number of vertices; `out` then stays as it was.
    pub fn interpolate_vectors(&self, field: &[Vec3], out: &mut Vec<Vec3>) -> Result<(), SurfaceMapError> {
        self.check_length(field.len())?;
        out.clear();
        out.extend(self.points.iter().map(|point| {
            let [a, b, c] = point.corners.map(|v| field[v as usize]);
            a * point.barycentric.x + b * point.barycentric.y + c * point.barycentric.z
        }));
        Ok(())
    }

    /// Interpolates numbers from the vertices of the mesh to the points.
    ///
    /// # Errors
    /// Fails when the number of values is not the number of vertices.
    pub fn interpolate_scalars(&self, field: &[f32]) -> Result<Vec<f32>, SurfaceMapError> {
        self.check_length(field.len())?;
        let at = |point: &MappedPoint| {
            let corners = point.corners.map(|v| field[v as usize]);
            let [low, high] = [f32::min, f32::max].map(|f| corners.into_iter().fold(corners[0], f));
            // Barycentric coordinates sum to one but for rounding, which must not lead out of the
            // range of the corners: a mask of ones stays ones.
            Vec3::from_array(corners).dot(point.barycentric).clamp(low, high)
        };
        Ok(self.points.iter().map(at).collect())
    }

    /// Interpolates skinning weights from the vertices of the mesh to the points.
    ///
    /// # Errors
    /// Fails when the number of rows is not the number of vertices.
    pub fn interpolate_weights(&self, weights: &SkinningWeights) -> Result<SkinningWeights, SurfaceMapError> {
        self.check_length(weights.len())?;
        let mut dense = vec![0.0; weights.joint_count()];
        let rows = self.points.iter().map(|point| {
            dense.fill(0.0);
            for (v, share) in point.corners.iter().zip(point.barycentric.to_array()) {
                weights.row(*v as usize).for_each(|(j, w)| dense[j] += share * w);
            }
            // Most joints do not move the point; they are left out of the row.
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

impl MappedPoint {
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
    use crate::test_meshes::{point, sheet, sphere};
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
            map.interpolate_vectors(&field, &mut out).unwrap();
            for ((p, found), distance) in points.iter().zip(&out).zip(map.distances()) {
                // Across an edge squared distances resolve places to √ε of the distance.
                let misplaced = 1e-6 + distance * f32::EPSILON.sqrt();
                let gradient = slope.length() * 13f32.sqrt();
                prop_assert!((*found - value(p.with_y(0.0))).length() < gradient * misplaced + 1e-5);
                prop_assert!((distance - p.y.abs()).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn points_at_vertices_keep_their_weights() {
        let mesh = sphere(2, 0.3);
        let row = |v: &Vec3| [v.x.abs(), v.y.abs() + 0.01, v.z.abs()];
        let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
        let weights = SkinningWeights::from_dense(&dense, mesh.vertices.len(), 3).unwrap();
        let map = SurfaceMap::new(&mesh, &mesh.vertices).unwrap();
        let carried = map.interpolate_weights(&weights).unwrap();
        for (a, b) in carried.to_dense().iter().zip(weights.to_dense()) {
            assert!((a - b).abs() < 1e-6);
        }
    }

    #[test]
    fn invalid_points_meshes_and_lengths_are_refused() {
        let mesh = sheet(1, 1, 1.0);
        let found = SurfaceMap::new(&mesh, &[Vec3::ZERO, Vec3::NAN]);
        assert_eq!(found, Err(SurfaceMapError::NotFinite { point: 1 }));
        let found = SurfaceMap::new(&TriMesh::default(), &[]);
        assert_eq!(found, Err(SurfaceMapError::NoFaces));
        let map = SurfaceMap::new(&mesh, &[]).unwrap();
        let (expected, found) = (4, 1);
        let error = Err(SurfaceMapError::Length { expected, found });
        assert_eq!(map.interpolate_vectors(&[Vec3::X], &mut Vec::new()), error);
    }
}
