//! The animated body between two poses.

use glam::Vec3;
use unic_core::{
    mesh::{TriMesh, vertex_normals},
    topology::weld,
};

/// A skinned body over one interval of time, a frame or a part of one: its vertices at both ends,
/// in between on straight lines. World space, metres; `fraction` runs from 0 at the start to 1.
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
    first_at: Vec<u32>,
    welded: Vec<[u32; 3]>,
    start: PosedBody,
    end: PosedBody,
}

/// A body at one moment: positions in metres and unit normals, one a vertex.
///
/// Vertices at the same place in the bind pose share their normal, so that normals interpolated over
/// faces turn smoothly across seams.
#[derive(Clone, Debug, Default)]
pub(crate) struct PosedBody {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
}

impl BodyInterval {
    /// A body that stays in its bind pose.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] tells.
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

    /// Places the body: it stands still with these vertices.
    ///
    /// # Panics
    /// When the number of vertices is not the bind pose's.
    pub fn reset(&mut self, vertices: &[Vec3]) {
        self.advance(vertices);
        self.start.clone_from(&self.end);
    }

    /// Goes on to the next interval: the end becomes the start, and `end` the new end.
    ///
    /// # Panics
    /// When the number of vertices is not the bind pose's.
    pub fn advance(&mut self, end: &[Vec3]) {
        assert_eq!(end.len(), self.first_at.len(), "vertices of the body");
        std::mem::swap(&mut self.start, &mut self.end);
        let PosedBody { positions, normals } = &mut self.end;
        positions.clear();
        positions.extend_from_slice(end);
        vertex_normals(end, &self.welded, normals);
        for (vertex, &first) in self.first_at.iter().enumerate() {
            normals[vertex] = normals[first as usize];
        }
    }

    /// Faces of the body: three vertices each.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Vertices at the start, metres.
    pub fn start(&self) -> &[Vec3] {
        &self.start.positions
    }

    /// Vertices at the end, metres.
    pub fn end(&self) -> &[Vec3] {
        &self.end.positions
    }

    /// A point of the surface, metres: a face and the weights of its corners.
    ///
    /// # Panics
    /// When there is no such face.
    pub fn point(&self, face: u32, barycentric: Vec3, fraction: f32) -> Vec3 {
        let at = |body: &PosedBody| blend(&body.positions, self.faces[face as usize], barycentric);
        at(&self.start).lerp(at(&self.end), fraction)
    }

    /// Velocity of a point of the surface in an interval of `seconds`, m/s: the same throughout.
    ///
    /// # Panics
    /// When there is no such face.
    pub fn velocity(&self, face: u32, barycentric: Vec3, seconds: f32) -> Vec3 {
        (self.point(face, barycentric, 1.0) - self.point(face, barycentric, 0.0)) / seconds
    }

    /// The mean way of the vertices, metres: what the body as a whole travels.
    pub fn drift(&self) -> Vec3 {
        let ways = self.start().iter().zip(self.end()).map(|(a, b)| b - a);
        ways.sum::<Vec3>() / self.start().len().max(1) as f32
    }

    /// The farthest way of any vertex beside a drift, metres.
    pub(crate) fn travel_m(&self, drift: Vec3) -> f32 {
        let ways = self.start().iter().zip(self.end()).map(|(a, b)| b - a);
        let squared = ways.map(|way| way.distance_squared(drift));
        squared.fold(0.0, f32::max).sqrt()
    }

    /// The body at `fraction`, into `out`.
    pub(crate) fn pose_at(&self, fraction: f32, out: &mut PosedBody) {
        let between = |start: &[Vec3], end: &[Vec3], out: &mut Vec<Vec3>| {
            out.clear();
            out.extend(start.iter().zip(end).map(|(a, b)| a.lerp(*b, fraction)));
        };
        between(&self.start.positions, &self.end.positions, &mut out.positions);
        between(&self.start.normals, &self.end.normals, &mut out.normals);
    }
}

/// Σ weightₖ · valueₖ over the corners of a face.
#[inline]
pub(crate) fn blend(values: &[Vec3], face: [u32; 3], weights: Vec3) -> Vec3 {
    let [a, b, c] = corners_of(values, face);
    a * weights.x + b * weights.y + c * weights.z
}

/// Values at the corners of a face. Written out: `map` over an array of three is not always inlined.
#[inline]
pub(crate) fn corners_of(values: &[Vec3], face: [u32; 3]) -> [Vec3; 3] {
    let [a, b, c] = face;
    [values[a as usize], values[b as usize], values[c as usize]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_begins_where_the_last_one_ended() {
        let body = TriMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]]).unwrap();
        let mut interval = BodyInterval::new(&body);
        assert_eq!(interval.drift(), Vec3::ZERO);
        let moved = |by: f32| -> Vec<Vec3> { body.vertices.iter().map(|v| v + Vec3::X * by).collect() };
        interval.advance(&moved(1.0));
        interval.advance(&moved(3.0));
        assert_eq!(
            (interval.start(), interval.end()),
            (&moved(1.0)[..], &moved(3.0)[..])
        );
        assert_eq!(
            (interval.drift(), interval.travel_m(Vec3::X)),
            (Vec3::X * 2.0, 1.0)
        );
        let centre = Vec3::splat(1.0 / 3.0);
        assert_eq!(interval.velocity(0, centre, 0.5), Vec3::X * 4.0);
        let mut posed = PosedBody::default();
        interval.pose_at(0.25, &mut posed);
        assert_eq!((posed.positions[0].x, posed.normals[0]), (1.5, Vec3::Y));
        interval.reset(&moved(7.0));
        assert_eq!(interval.drift(), Vec3::ZERO);
    }
}
