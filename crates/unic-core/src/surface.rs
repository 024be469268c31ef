//! Closest-point queries on a triangle mesh, with signed distances.
//!
//! For simulation, metrics and tools.

use crate::{
    aabb_tree::{AabbTree, BranchUpdate, GroupMask},
    mesh::TriMesh,
    simd::Instructions,
    topology::weld,
};
use glam::Vec3;

mod packet;
mod ray;

pub use crate::triangle::{Feature, Triangle, TrianglePoint};
pub use ray::RayHit;

/// Posed triangle mesh that answers closest-point and ray queries.
///
/// The tree and the connectivity are made once, over the bind pose; [`Surface::refit`] follows the
/// pose without allocating. Faces with a corner that is not finite are never the answer.
///
/// The sign of a distance comes from the angle-weighted pseudonormal of the feature hit: face, edge
/// or vertex (Bærentzen & Aanæs 2005, "Signed distance computation using the angle weighted
/// pseudonormal"). It is exact for closed meshes without self-intersection. Where a body folds into
/// itself, or beside the rim of an open mesh, it is the side of the nearest sheet.
///
/// ```
/// use glam::Vec3;
/// use unic_core::{mesh::TriMesh, surface::Surface};
///
/// let corners = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
/// let floor = Surface::build(&TriMesh::new(corners, vec![[0, 1, 2]])?);
/// let hit = floor.closest(Vec3::new(0.25, -0.5, 0.25)).unwrap();
/// assert_eq!(hit.signed_distance, -0.5);
/// assert_eq!(hit.normal, Vec3::Y);
/// # Ok::<(), unic_core::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Surface {
    /// Tree over `triangles`.
    tree: AabbTree,
    /// Posed faces in the order of the tree. The triangles of a leaf are adjacent in memory, whose
    /// latency bounds the searches.
    triangles: Vec<Triangle>,
    /// Index of the face of each triangle.
    face_of_triangle: Vec<u32>,
    /// Index of the triangle of each face.
    triangle_of_face: Vec<u32>,
    /// Vertices of each triangle.
    corners_of_triangles: Vec<[u32; 3]>,
    /// Collision groups of each triangle; empty where faces have none.
    groups_of_triangles: Vec<GroupMask>,
    faces: Vec<[u32; 3]>,
    /// `faces` by welded vertices: a seam whose vertices are split has two sides to average.
    welded_faces: Vec<[u32; 3]>,
    /// First vertex at the place of each vertex in the bind pose.
    welded_vertices: Vec<u32>,
    /// Starts of the rows of `around`: those of welded vertex i are `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    /// Faces around each welded vertex, in compressed rows.
    around: Vec<u32>,
    vertex_count: usize,
    instructions: Instructions,
}

/// Point of a [`Surface`] that is closest to a query point p.
///
/// Faces are compared by squared distances in f32. These resolve two places on the surface that are
/// about 3e-4 · `distance` apart, which is the accuracy of `point` across an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the face; the lowest among faces at exactly the same distance.
    pub face: u32,
    /// Barycentric coordinates in the face: no weight is negative, and they sum to one.
    pub barycentric: Vec3,
    /// Position, metres.
    pub point: Vec3,
    /// Unit pseudonormal of the feature hit, outwards; zero where all faces around are degenerate.
    pub normal: Vec3,
    /// |p − point|, metres.
    pub distance: f32,
    /// `distance`, negative when p is on the inner side of `normal`.
    pub signed_distance: f32,
    /// Part of the face on which `point` lies.
    pub feature: Feature,
}

/// Best face found so far in a search.
#[derive(Clone, Copy)]
struct Candidate {
    face: u32,
    hit: TrianglePoint,
}

/// Filter on the faces of a search, in two steps: a bit mask that skips subtrees, and a predicate.
#[derive(Clone, Copy)]
pub(crate) struct FaceFilter<Accepts> {
    /// Collision groups of the faces, see [`Surface::set_groups`].
    pub(crate) groups: GroupMask,
    /// Predicate on the index of a face in one of these groups.
    pub(crate) accepts: Accepts,
}

impl<Accepts: Fn(u32) -> bool> FaceFilter<Accepts> {
    /// Filter by the predicate alone.
    pub(crate) fn new(accepts: Accepts) -> Self {
        let groups = GroupMask::ALL;
        Self { groups, accepts }
    }
}

impl Surface {
    /// Builds the tree over a mesh in its bind pose.
    ///
    /// # Panics
    /// When a face names a vertex that does not exist; [`TriMesh::check`] finds it.
    pub fn build(bind: &TriMesh) -> Self {
        let corners = |f: &[u32; 3]| f.map(|v| bind.vertices[v as usize]);
        let centres: Vec<Vec3> = (bind.faces.iter())
            .map(|f| corners(f).iter().sum::<Vec3>() / 3.0)
            .collect();
        let welded_vertices = weld(&bind.vertices);
        let welded_faces: Vec<_> = bind
            .faces
            .iter()
            .map(|f| f.map(|v| welded_vertices[v as usize]))
            .collect();
        let (starts, around) = faces_around(bind.vertices.len(), &welded_faces);
        let mut tree = AabbTree::build(&centres);
        let face_of_triangle = tree.renumber_in_tree_order();
        let mut triangle_of_face = vec![0; face_of_triangle.len()];
        for (triangle, &face) in face_of_triangle.iter().enumerate() {
            triangle_of_face[face as usize] = triangle as u32;
        }
        let corners_of_triangles = face_of_triangle.iter().map(|&face| bind.faces[face as usize]);
        // Welding uses the bind pose alone: vertices that meet in another pose stay separate.
        let mut surface = Self {
            tree,
            corners_of_triangles: corners_of_triangles.collect(),
            triangles: vec![Triangle::default(); bind.faces.len()],
            face_of_triangle,
            triangle_of_face,
            groups_of_triangles: Vec::new(),
            faces: bind.faces.clone(),
            welded_faces,
            welded_vertices,
            starts,
            around,
            vertex_count: bind.vertices.len(),
            instructions: Instructions::best(),
        };
        surface.refit(&bind.vertices);
        surface
    }

    /// Assigns collision groups to the faces, by which searches can skip subtrees.
    pub(crate) fn set_groups(&mut self, groups_of_face: impl Fn(u32) -> GroupMask) {
        let faces = &self.face_of_triangle;
        self.tree
            .set_groups(|triangle| groups_of_face(faces[triangle as usize]));
        self.groups_of_triangles = faces.iter().map(|&face| groups_of_face(face)).collect();
    }

    /// Poses the mesh: new positions for the vertices of the bind pose, metres.
    ///
    /// # Panics
    /// When the number of vertices differs from the bind pose's.
    pub fn refit(&mut self, vertices: &[Vec3]) {
        assert_eq!(vertices.len(), self.vertex_count, "vertices to refit");
        let (corners, instructions) = (&self.corners_of_triangles, self.instructions);
        let pose = |_, first: usize, triangles: &mut [Triangle]| {
            instructions.run(
                #[inline(always)]
                || {
                    for (triangle, &[a, b, c]) in triangles.iter_mut().zip(&corners[first..]) {
                        let at = |vertex: u32| vertices[vertex as usize];
                        triangle.pose([at(a), at(b), at(c)]);
                    }
                },
            );
            BranchUpdate::Moved
        };
        let box_of = |_, triangle: &Triangle| triangle.bounds();
        self.tree.refit_branches(&mut self.triangles, pose, box_of);
    }

    /// Returns whether a triangle is in one of these groups.
    #[inline(always)]
    fn is_in_groups(&self, triangle: usize, groups: GroupMask) -> bool {
        (self.groups_of_triangles.get(triangle)).is_none_or(|own| own.intersects(groups))
    }

    /// Posed triangle of a face; none for an index beyond the faces.
    fn triangle(&self, face: u32) -> Option<&Triangle> {
        let &triangle = self.triangle_of_face.get(face as usize)?;
        self.triangles.get(triangle as usize)
    }

    /// Posed triangle of an existing face.
    fn face(&self, face: u32) -> &Triangle {
        &self.triangles[self.triangle_of_face[face as usize] as usize]
    }

    /// Faces of the mesh: three vertices each.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Returns the point closest to `p`.
    ///
    /// None when there is no finite face, or when `p` is not finite or so far away that its squared
    /// distance is not.
    pub fn closest(&self, p: Vec3) -> Option<SurfacePoint> {
        self.search(p, f32::INFINITY, None, FaceFilter::new(|_| true))
    }

    /// Returns the same answer as [`Surface::closest`], to the bit, and sooner when `seed` is a
    /// face near it, such as last frame's. A seed beyond the faces is ignored.
    pub fn closest_from(&self, p: Vec3, seed: u32) -> Option<SurfacePoint> {
        self.closest_among(p, f32::INFINITY, seed, |_| true)
    }

    /// Returns the point closest to `p` among the faces that `accepts` names, if it is at most
    /// `radius` metres away.
    ///
    /// A `seed` near the answer shortens the search; one that `accepts` refuses is ignored. The
    /// normal is that of the surface with all its faces.
    pub fn closest_among(
        &self,
        p: Vec3,
        radius: f32,
        seed: u32,
        accepts: impl Fn(u32) -> bool,
    ) -> Option<SurfacePoint> {
        self.closest_filtered(p, radius, seed, FaceFilter::new(accepts))
    }

    /// Does what [`Surface::closest_among`] does, with a filter that may skip subtrees.
    pub(crate) fn closest_filtered(
        &self,
        p: Vec3,
        radius: f32,
        seed: u32,
        filter: FaceFilter<impl Fn(u32) -> bool>,
    ) -> Option<SurfacePoint> {
        let squared = radius * radius;
        let triangle = self.triangle_of_face.get(seed as usize);
        let triangle =
            triangle.filter(|&&t| self.is_in_groups(t as usize, filter.groups) && (filter.accepts)(seed));
        let start = triangle.map(|&triangle| &self.triangles[triangle as usize]);
        let start = start.map(|triangle| Candidate {
            face: seed,
            hit: triangle.closest(p),
        });
        // A NaN distance, of a seed that is not finite, would make every later comparison false.
        let start = start.filter(|c| c.hit.squared_distance.is_finite() && c.hit.squared_distance <= squared);
        let found = self.search(p, squared, start, filter);
        // The square of the radius is rounded.
        found.filter(|hit| hit.distance <= radius)
    }

    /// Returns the point closest to `p` if it is at most `radius` metres away. A small radius ends
    /// the search for a far point early.
    pub fn closest_within(&self, p: Vec3, radius: f32) -> Option<SurfacePoint> {
        self.closest_where(p, radius, |_| true)
    }

    /// Returns the point closest to `p` among the faces that `accepts` names, if it is at most
    /// `radius` metres away.
    ///
    /// The normal and the sign are those of the surface with all its faces.
    pub fn closest_where(&self, p: Vec3, radius: f32, accepts: impl Fn(u32) -> bool) -> Option<SurfacePoint> {
        self.closest_among(p, radius, u32::MAX, accepts)
    }

    /// Searches from a candidate on, within the squared distance `bound`, m².
    fn search(
        &self,
        p: Vec3,
        bound: f32,
        start: Option<Candidate>,
        FaceFilter { groups, accepts }: FaceFilter<impl Fn(u32) -> bool>,
    ) -> Option<SurfacePoint> {
        if !p.is_finite() {
            return None;
        }
        let mut best = start;
        let bound = start.map_or(bound, |c| c.hit.squared_distance);
        self.tree
            .visit_nearest_in_groups(p, bound, groups, |triangles, mut bound| {
                for triangle in triangles.iter().map(|&triangle| triangle as usize) {
                    if !self.is_in_groups(triangle, groups) {
                        continue;
                    }
                    let face = self.face_of_triangle[triangle];
                    let hit = self.triangles[triangle].closest(p);
                    let found = hit.squared_distance;
                    // Ties go to the lowest index, whatever the order of the tree or the seed.
                    let is_lower = best.is_none_or(|best| face < best.face);
                    if (found < bound || (found == bound && is_lower)) && accepts(face) {
                        best = Some(Candidate { face, hit });
                        bound = found;
                    }
                }
                bound
            });
        // Squared distances beyond f32's range are infinite, and say nothing about which face is
        // nearest.
        best.filter(|best| best.hit.squared_distance.is_finite())
            .map(|best| self.surface_point(best))
    }

    fn surface_point(&self, Candidate { face, hit }: Candidate) -> SurfacePoint {
        let [a, b, c] = self.face(face).corners();
        let weights = hit.barycentric;
        let normal = self.pseudonormal(face, hit.feature);
        let distance = hit.squared_distance.sqrt();
        // The sign uses the offset and not `point`, whose rounding grows with the distance to the
        // origin. `offset` points from p to the surface, so along the normal when p is inside.
        let inside = hit.offset.dot(normal) > 0.0;
        SurfacePoint {
            face,
            barycentric: weights,
            point: a * weights.x + b * weights.y + c * weights.z,
            normal,
            distance,
            signed_distance: if inside { -distance } else { distance },
            feature: hit.feature,
        }
    }

    /// Returns the closest point of one face; none for an index beyond the faces or a `p` that is
    /// not finite.
    pub(crate) fn point_on(&self, face: u32, p: Vec3) -> Option<SurfacePoint> {
        let hit = self.triangle(face)?.closest(p);
        (hit.squared_distance.is_finite()).then(|| self.surface_point(Candidate { face, hit }))
    }

    /// Returns whether a point is on the outer side of a face's plane.
    pub(crate) fn is_above(&self, face: u32, p: Vec3) -> bool {
        let above = |t: &Triangle| (p - t.corners()[0]).dot(t.area_normal()) > 0.0;
        self.triangle(face).is_some_and(above)
    }

    /// Unit pseudonormal: the sum of the unit normals of the faces that share the feature. At a
    /// vertex each is weighted by its angle there.
    fn pseudonormal(&self, face: u32, feature: Feature) -> Vec3 {
        let corner = |k: u8| self.welded_faces[face as usize][usize::from(k % 3)];
        // Of the faces at one end of an edge, those that contain the other end share the edge.
        let sum: Vec3 = match feature {
            Feature::Face => self.face_normal(face),
            Feature::Edge(k) => self
                .faces_at(corner(k))
                .filter(|&f| self.welded_faces[f as usize].contains(&corner(k + 1)))
                .map(|f| self.face_normal(f))
                .sum(),
            Feature::Vertex(k) => self
                .faces_at(corner(k))
                .map(|f| self.face_normal(f) * self.angle_at(f, corner(k)))
                .sum(),
        };
        sum.normalize_or_zero()
    }

    /// First vertex at the place of a vertex in the bind pose: the one that stands for all of them.
    pub(crate) fn welded_vertex(&self, vertex: u32) -> u32 {
        self.welded_vertices[vertex as usize]
    }

    /// Unit normal at a vertex: the area-weighted mean of the faces around it; zero where they are
    /// all degenerate.
    pub(crate) fn vertex_normal(&self, vertex: u32) -> Vec3 {
        let around = self.faces_at(self.welded_vertex(vertex));
        let sum: Vec3 = around.map(|face| self.face(face).area_normal()).sum();
        sum.normalize_or_zero()
    }

    /// Faces around a welded vertex.
    fn faces_at(&self, welded: u32) -> impl Iterator<Item = u32> {
        let at = |i: u32| self.starts[i as usize] as usize;
        self.around[at(welded)..at(welded + 1)].iter().copied()
    }

    fn face_normal(&self, face: u32) -> Vec3 {
        self.face(face).normal()
    }

    /// Angle of a face at one of its welded vertices, radians.
    fn angle_at(&self, face: u32, welded: u32) -> f32 {
        let corners = self.face(face).corners();
        let at = self.welded_faces[face as usize]
            .iter()
            .position(|&v| v == welded)
            .unwrap_or(0);
        let (u, v) = (
            corners[(at + 1) % 3] - corners[at],
            corners[(at + 2) % 3] - corners[at],
        );
        // The arc cosine of a normalised dot product loses half of the digits at small angles.
        u.cross(v).length().atan2(u.dot(v))
    }
}

/// Starts of rows and faces around each vertex, in compressed rows. A face that names a vertex
/// twice is listed once.
fn faces_around(vertex_count: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut pairs: Vec<(u32, u32)> = (faces.iter().enumerate())
        .flat_map(|(face, corners)| corners.map(|v| (v, face as u32)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    let starts = (0..=vertex_count as u32)
        .map(|v| pairs.partition_point(|&(at, _)| at < v) as u32)
        .collect();
    (starts, pairs.into_iter().map(|(_, face)| face).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::{cube, point, sphere, winding_number};
    use proptest::{collection::vec, prelude::*};

    fn brute_force_nearest(mesh: &TriMesh, p: Vec3) -> (u32, f32) {
        let corners = |f: &[u32; 3]| f.map(|v| mesh.vertices[v as usize]);
        let hit = |f: &[u32; 3]| Triangle::new(corners(f)).closest(p);
        (mesh.faces.iter().enumerate())
            .map(|(i, f)| (i as u32, hit(f).squared_distance))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
            .map(|(i, squared)| (i, squared.sqrt()))
            .unwrap()
    }

    /// A closed, star-shaped, very uneven surface: many reflex edges and saddle vertices.
    fn bumpy(radii: &[f32]) -> TriMesh {
        let mut mesh = sphere(1, 1.0);
        mesh.vertices
            .iter_mut()
            .zip(radii.iter().cycle())
            .for_each(|(v, r)| *v *= *r);
        mesh
    }

    proptest! {
        #[test]
        fn closest_points_agree_with_brute_force(
            corners in vec(point(1.0), 3..240), moved in vec(point(1.0), 240), p in point(1.5),
        ) {
            let faces = (0..corners.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
            let mut mesh = TriMesh::new(corners, faces.collect()).unwrap();
            let mut surface = Surface::build(&mesh);
            for _ in 0..2 {
                let hit = surface.closest(p).unwrap();
                prop_assert_eq!((hit.face, hit.distance), brute_force_nearest(&mesh, p));
                prop_assert!(((hit.point - p).length() - hit.distance).abs() < 1e-5);
                for seed in (0..mesh.faces.len() as u32).step_by(7).chain([u32::MAX]) {
                    prop_assert_eq!(surface.closest_from(p, seed), Some(hit));
                }
                let (short, enough) = (hit.distance * 0.999, hit.distance * 1.001 + 1e-6);
                prop_assert_eq!(surface.closest_within(p, enough), Some(hit));
                prop_assert_eq!(surface.closest_within(p, short).is_some(), hit.distance == 0.0);
                let count = mesh.vertices.len();
                mesh.vertices.copy_from_slice(&moved[..count]);
                surface.refit(&mesh.vertices);
            }
        }

        #[test]
        fn the_side_is_that_of_the_winding_number(
            radii in vec(0.4f32..1.6, 42), directions in vec(point(1.0), 40), scale in -3..2,
        ) {
            let mut mesh = bumpy(&radii);
            let scale = 10f32.powi(scale);
            mesh.vertices.iter_mut().for_each(|v| *v *= scale);
            let surface = Surface::build(&mesh);
            for direction in directions {
                let p = direction * 1.7 * scale;
                let hit = surface.closest(p).unwrap();
                if hit.distance > 1e-4 * scale {
                    let inside = winding_number(&mesh, p) > 0.5;
                    prop_assert_eq!(hit.signed_distance < 0.0, inside, "{:?} at {}", hit, p);
                }
            }
        }

        #[test]
        fn the_side_is_right_next_to_edges_and_vertices(
            radii in vec(0.4f32..1.6, 42), face in 0usize..80, t in 0.0f32..1.0, offset in point(1e-3),
        ) {
            let mesh = bumpy(&radii);
            let surface = Surface::build(&mesh);
            let [a, b, _] = mesh.faces[face].map(|v| mesh.vertices[v as usize]);
            for p in [a + offset, a.lerp(b, t) + offset] {
                let hit = surface.closest(p).unwrap();
                if hit.distance > 2e-6 {
                    let inside = winding_number(&mesh, p) > 0.5;
                    prop_assert_eq!(hit.signed_distance < 0.0, inside, "{:?} at {}", hit, p);
                }
            }
        }
    }

    #[test]
    fn distances_to_a_cube_have_closed_forms() {
        let cube = Surface::build(&cube());
        for (p, signed, normal) in [
            (Vec3::new(0.1, 0.2, 1.5), 0.5, Vec3::Z),
            (Vec3::new(0.1, 0.2, 0.75), -0.25, Vec3::Z),
            (
                Vec3::new(2.0, 2.0, 0.1),
                2f32.sqrt(),
                Vec3::new(1.0, 1.0, 0.0).normalize(),
            ),
            (Vec3::splat(-2.0), 3f32.sqrt(), -Vec3::ONE.normalize()),
        ] {
            let hit = cube.closest(p).unwrap();
            assert!((hit.signed_distance - signed).abs() < 1e-6, "{hit:?}");
            assert!((hit.normal - normal).length() < 1e-6, "{hit:?}");
        }
    }

    #[test]
    fn split_seams_do_not_change_the_normals() {
        let welded = cube();
        let vertices = welded
            .faces
            .iter()
            .flatten()
            .map(|&v| welded.vertices[v as usize])
            .collect();
        let faces = (0..welded.faces.len() as u32)
            .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
            .collect();
        let (whole, split) = (
            Surface::build(&welded),
            Surface::build(&TriMesh::new(vertices, faces).unwrap()),
        );
        for p in [
            Vec3::splat(2.0),
            Vec3::new(2.0, -2.0, 0.1),
            Vec3::new(0.0, 0.1, -0.9),
        ] {
            assert_eq!(whole.closest(p), split.closest(p));
        }
    }

    #[test]
    fn a_sphere_is_round_to_within_its_facets() {
        let sphere = Surface::build(&sphere(4, 0.3));
        for i in 0..500 {
            let t = i as f32;
            let p = Vec3::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 2.1).sin()) * 0.4;
            let hit = sphere.closest(p).unwrap();
            assert!((hit.signed_distance - (p.length() - 0.3)).abs() < 1e-3);
        }
    }

    #[test]
    fn faces_and_points_that_are_not_finite_have_no_answer() {
        let mut mesh = cube();
        let mut surface = Surface::build(&mesh);
        assert_eq!(surface.closest(Vec3::new(f32::NAN, 0.0, 0.0)), None);
        assert_eq!(surface.closest_from(Vec3::INFINITY, 0), None);
        mesh.vertices[0] = Vec3::new(f32::NAN, 0.0, 0.0);
        surface.refit(&mesh.vertices);
        let hit = surface.closest(Vec3::NEG_X).unwrap();
        assert!(hit.point.is_finite() && !mesh.faces[hit.face as usize].contains(&0));
        surface.refit(&[Vec3::NAN; 8]);
        assert_eq!(surface.closest(Vec3::ZERO), None);
        assert_eq!(Surface::build(&TriMesh::default()).closest(Vec3::ZERO), None);
    }

    #[test]
    fn a_degenerate_face_among_sound_ones_changes_no_answer() {
        let sound = cube();
        let mut broken = sound.clone();
        broken.faces.extend([[0, 1, 1], [2, 2, 2]]);
        let (sound, broken) = (Surface::build(&sound), Surface::build(&broken));
        for i in 0..200 {
            let t = i as f32;
            let p = Vec3::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 2.1).sin()) * 1.6;
            assert_eq!(sound.closest(p), broken.closest(p));
        }
    }
}
