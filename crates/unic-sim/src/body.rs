//! The animated body during an interval.

use glam::Vec3;
use unic_core::{
    mesh::{TriMesh, vertex_normals},
    topology::weld,
};

/// A skinned body during one interval, which is a frame or a part of one.
///
/// Vertices move on straight lines between their positions at the two ends, in world space, in
/// metres. A `fraction` of the interval is 0 at its start and 1 at its end.
///
/// ```
/// use glam::Vec3;
/// use unic_core::mesh::TriMesh;
/// use unic_sim::body::BodyInterval;
///
/// let body = TriMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]])?;
/// let mut interval = BodyInterval::new(&body);
/// let lifted: Vec<Vec3> = body.vertices.iter().map(|v| v + Vec3::Y).collect();
/// interval.advance(&lifted);
/// let corner = Vec3::new(1.0, 0.0, 0.0);
/// assert_eq!(interval.point(0, corner, 0.5), Vec3::new(0.0, 0.5, 0.0));
/// assert_eq!(interval.velocity(0, corner, 0.1), Vec3::Y * 10.0);
/// # Ok::<(), unic_core::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct BodyInterval {
    faces: Vec<[u32; 3]>,
    /// Lowest vertex at the bind-pose position of each vertex.
    first_at: Vec<u32>,
    /// Faces over the vertices in `first_at`, so that normals are averaged across seams.
    welded: Vec<[u32; 3]>,
    start: PosedBody,
    end: PosedBody,
}

/// A body at one moment: the position in metres and the unit normal of each vertex.
///
/// Vertices at the same position in the bind pose share their normal, so that normals interpolated
/// over faces are continuous across seams.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedBody {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
}

impl BodyInterval {
    /// Creates an interval in which the body rests in its bind pose.
    ///
    /// # Panics
    /// Panics when a face names a vertex that does not exist; see [`TriMesh::check`].
    pub fn new(bind: &TriMesh) -> Self {
        let first_at = weld(&bind.vertices);
        let welded = bind.faces.iter().map(|f| f.map(|v| first_at[v as usize]));
        let mut interval = Self {
            faces: bind.faces.clone(),
            welded: welded.collect(),
            first_at,
            start: PosedBody::default(),
            end: PosedBody::default(),
        };
        interval.reset(&bind.vertices);
        interval
    }

    /// Places the body at rest, with the given vertex positions in metres.
    ///
    /// # Panics
    /// Panics when the number of vertices differs from the bind pose's.
    pub fn reset(&mut self, vertices: &[Vec3]) {
        self.advance(vertices);
        self.start.clone_from(&self.end);
    }

    /// Moves on to the next interval: the current end becomes the start, and `end` holds the vertex
    /// positions at the new end, in metres.
    ///
    /// # Panics
    /// Panics when the number of vertices differs from the bind pose's.
    pub fn advance(&mut self, end: &[Vec3]) {
        assert_eq!(end.len(), self.first_at.len(), "vertices of the body");
        // Swapped instead of copied: the old start's buffers are overwritten.
        std::mem::swap(&mut self.start, &mut self.end);
        let PosedBody { positions, normals } = &mut self.end;
        positions.clear();
        positions.extend_from_slice(end);
        // Welded faces give normals to the lowest vertex of each seam, which the others copy.
        vertex_normals(end, &self.welded, normals);
        for (vertex, &first) in self.first_at.iter().enumerate() {
            normals[vertex] = normals[first as usize];
        }
    }

    /// Returns the faces of the body, as three vertex indices each.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Returns the vertex positions at the start, metres.
    pub fn start(&self) -> &[Vec3] {
        &self.start.positions
    }

    /// Returns the vertex positions at the end, metres.
    pub fn end(&self) -> &[Vec3] {
        &self.end.positions
    }

    /// Returns a point of the surface at a fraction of the interval, metres. The point is given by
    /// a face and its barycentric weights.
    ///
    /// # Panics
    /// Panics when the face does not exist.
    pub fn point(&self, face: u32, barycentric: Vec3, fraction: f32) -> Vec3 {
        let at = |body: &PosedBody| interpolate(&body.positions, self.faces[face as usize], barycentric);
        at(&self.start).lerp(at(&self.end), fraction)
    }

    /// Returns the velocity of a point of the surface, m/s, if the interval lasts `seconds`. The
    /// velocity is constant within the interval.
    ///
    /// # Panics
    /// Panics when the face does not exist.
    pub fn velocity(&self, face: u32, barycentric: Vec3, seconds: f32) -> Vec3 {
        (self.point(face, barycentric, 1.0) - self.point(face, barycentric, 0.0)) / seconds
    }

    /// Returns the mean displacement of the vertices in the interval, metres.
    pub fn mean_displacement(&self) -> Vec3 {
        let displacements = self.start().iter().zip(self.end()).map(|(a, b)| b - a);
        displacements.sum::<Vec3>() / self.start().len().max(1) as f32
    }

    /// Returns the largest displacement of any vertex relative to `mean`, metres.
    pub(crate) fn max_relative_displacement_m(&self, mean: Vec3) -> f32 {
        let displacements = self.start().iter().zip(self.end()).map(|(a, b)| b - a);
        let squared = displacements.map(|d| d.distance_squared(mean));
        squared.fold(0.0, f32::max).sqrt()
    }

    /// Writes the body at `fraction` of the interval to `out`. Normals are interpolated linearly
    /// and not normalised.
    pub(crate) fn pose_at(&self, fraction: f32, out: &mut PosedBody) {
        let between = |start: &[Vec3], end: &[Vec3], out: &mut Vec<Vec3>| {
            out.clear();
            out.extend(start.iter().zip(end).map(|(a, b)| a.lerp(*b, fraction)));
        };
        between(&self.start.positions, &self.end.positions, &mut out.positions);
        between(&self.start.normals, &self.end.normals, &mut out.normals);
    }
}

/// Interpolates vertex values at a point of a face: Σ weightₖ · valueₖ over its corners.
#[inline]
pub(crate) fn interpolate(values: &[Vec3], face: [u32; 3], weights: Vec3) -> Vec3 {
    let [a, b, c] = corners_of(values, face);
    a * weights.x + b * weights.y + c * weights.z
}

/// Returns the vertex values at the corners of a face.
#[inline]
pub(crate) fn corners_of(values: &[Vec3], face: [u32; 3]) -> [Vec3; 3] {
    // Written out, because `map` over an array of three is not always inlined.
    let [a, b, c] = face;
    [values[a as usize], values[b as usize], values[c as usize]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_begins_where_the_previous_one_ended() {
        let body = TriMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]]).unwrap();
        let mut interval = BodyInterval::new(&body);
        assert_eq!(interval.mean_displacement(), Vec3::ZERO);
        let moved = |by: f32| -> Vec<Vec3> { body.vertices.iter().map(|v| v + Vec3::X * by).collect() };
        interval.advance(&moved(1.0));
        interval.advance(&moved(3.0));
        assert_eq!(
            (interval.start(), interval.end()),
            (&moved(1.0)[..], &moved(3.0)[..])
        );
        assert_eq!(
            (
                interval.mean_displacement(),
                interval.max_relative_displacement_m(Vec3::X)
            ),
            (Vec3::X * 2.0, 1.0)
        );
        let centre = Vec3::splat(1.0 / 3.0);
        assert_eq!(interval.velocity(0, centre, 0.5), Vec3::X * 4.0);
        let mut posed = PosedBody::default();
        interval.pose_at(0.25, &mut posed);
        assert_eq!((posed.positions[0].x, posed.normals[0]), (1.5, Vec3::Y));
        interval.reset(&moved(7.0));
        assert_eq!(interval.mean_displacement(), Vec3::ZERO);
    }
}
