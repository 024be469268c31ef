//! Local closest-point search: from the last known face over adjacent faces.

use crate::body::{corners_of, interpolate};
use glam::Vec3;
use unic_core::{
    mesh::TriMesh,
    surface::{Feature, Triangle},
    topology::weld,
};

/// Largest number of faces that one walk crosses. Cloth slides over a face or two in an interval;
/// the limit bounds the cost of outliers.
const MAX_HOPS: usize = 4;

/// Value of a face index that stands for no face.
pub(super) const NO_FACE: u32 = u32::MAX;

/// Adjacency of the body's faces. Vertices at the same bind-pose position are welded, so that walks
/// cross seams.
#[derive(Clone, Debug)]
pub(super) struct FaceAdjacency {
    pub(super) faces: Vec<[u32; 3]>,
    /// Faces over welded vertices.
    welded: Vec<[u32; 3]>,
    /// Row starts of `around`: the faces around welded vertex i are
    /// `around[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

/// The closest point of a face to a query point.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceProjection {
    pub(super) face: u32,
    /// Weights of the face's corners.
    pub(super) barycentric: Vec3,
    /// Squared distance from the query point, m².
    squared_distance: f32,
    /// Part of the face that the point lies on.
    feature: Feature,
}

impl FaceProjection {
    /// Returns the distance of the query point, metres.
    pub(super) fn distance_m(&self) -> f32 {
        self.squared_distance.sqrt()
    }
}

impl FaceAdjacency {
    pub(super) fn new(bind: &TriMesh) -> Self {
        let first_at = weld(&bind.vertices);
        let welded: Vec<[u32; 3]> = (bind.faces.iter())
            .map(|f| f.map(|v| first_at[v as usize]))
            .collect();
        let mut pairs: Vec<(u32, u32)> = (welded.iter().enumerate())
            .flat_map(|(face, corners)| corners.map(|v| (v, face as u32)))
            .collect();
        pairs.sort_unstable();
        let row = |v: u32| pairs.partition_point(|&(at, _)| at < v) as u32;
        Self {
            faces: bind.faces.clone(),
            starts: (0..=bind.vertices.len() as u32).map(row).collect(),
            around: pairs.into_iter().map(|(_, face)| face).collect(),
            welded,
        }
    }

    /// Returns the unit normal of a face; zero when it is degenerate.
    pub(super) fn normal(&self, positions: &[Vec3], face: u32) -> Vec3 {
        let [a, b, c] = corners_of(positions, self.faces[face as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Finds a local minimum of the distance to `p`: walks from `face` to adjacent faces while one
    /// is closer.
    ///
    /// The walk never goes from inside the body to a face with an opposite normal. Through a thin
    /// limb the far side is closer, but `p` has not entered there.
    pub(super) fn walk(&self, positions: &[Vec3], face: u32, p: Vec3) -> FaceProjection {
        let mut best = self.project(positions, face, p);
        for _ in 0..MAX_HOPS {
            let Some(closer) = self.step(positions, &best, p) else {
                break;
            };
            best = closer;
        }
        best
    }

    /// Returns the closest projection onto a face adjacent to the feature of `from`, if it is
    /// closer.
    fn step(&self, positions: &[Vec3], from: &FaceProjection, p: Vec3) -> Option<FaceProjection> {
        let corners = self.welded[from.face as usize];
        let corner = |k: u8| corners[usize::from(k % 3)];
        let (pivot, other) = match from.feature {
            // A perpendicular projection inside a face is a local minimum of the distance.
            Feature::Face => return None,
            Feature::Edge(k) => (corner(k), corner(k + 1)),
            Feature::Vertex(k) => (corner(k), corner(k)),
        };
        let row = self.starts[pivot as usize] as usize..self.starts[pivot as usize + 1] as usize;
        // Faces at an edge contain both its ends. At a vertex both are the same.
        let touching = (self.around[row].iter().copied())
            .filter(|&f| f != from.face && self.welded[f as usize].contains(&other));
        let mut best: Option<FaceProjection> = None;
        // Strictly closer: ties keep the current face, so that a walk cannot go in circles.
        for projection in touching.map(|f| self.project(positions, f, p)) {
            if projection.squared_distance < best.unwrap_or(*from).squared_distance {
                best = Some(projection);
            }
        }
        best.filter(|projection| !self.turns_away(positions, from, projection, p))
    }

    /// Returns whether `p` is inside the body and the face of `to` has a normal opposite to that of
    /// `from`.
    fn turns_away(&self, positions: &[Vec3], from: &FaceProjection, to: &FaceProjection, p: Vec3) -> bool {
        // Normals are computed when they are needed: few walks leave their face, and the body's
        // vertices move in every substep.
        let side = self.normal(positions, from.face);
        let is_inside = (p - self.point(positions, from)).dot(side) < 0.0;
        is_inside && side.dot(self.normal(positions, to.face)) < 0.0
    }

    /// Projects `p` onto a face.
    fn project(&self, positions: &[Vec3], face: u32, p: Vec3) -> FaceProjection {
        let corners = corners_of(positions, self.faces[face as usize]);
        let hit = Triangle::new(corners).closest(p);
        FaceProjection {
            face,
            barycentric: hit.barycentric,
            squared_distance: hit.squared_distance,
            feature: hit.feature,
        }
    }

    /// Returns the position of a projection, metres.
    pub(super) fn point(&self, positions: &[Vec3], projection: &FaceProjection) -> Vec3 {
        interpolate(
            positions,
            self.faces[projection.face as usize],
            projection.barycentric,
        )
    }
}
