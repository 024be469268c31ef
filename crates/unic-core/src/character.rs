//! Character and garment: the two assets that a model is made for.
//!
//! For tools that import and make characters; a model holds both.

use crate::{
    mesh::{MeshError, TriMesh, check_faces},
    skeleton::Skeleton,
    skinning::SkinningWeights,
};
use glam::Vec3;
use std::borrow::Cow;

/// Skinned body.
#[derive(Clone, Debug, PartialEq)]
pub struct Character {
    /// Body in its bind pose.
    pub body: TriMesh,
    /// Tree of joints.
    pub skeleton: Skeleton,
    /// Skinning weights, one row for each body vertex.
    pub weights: SkinningWeights,
    /// Order of the vertices in the body's file, if the body has welded ones; exports have it.
    pub file_mesh: Option<FileMesh>,
}

/// Mesh of a file that repeats vertices along the seams of its texture, as glTF does.
///
/// The body has one vertex where the file has several at one place with equal weights.
#[derive(Clone, Debug, PartialEq)]
pub struct FileMesh {
    /// Index of the body's vertex for each vertex of the file.
    pub body_vertices: Vec<u32>,
    /// Indices of the file's vertices, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

impl FileMesh {
    /// Checks the indices, for a body of `vertices` vertices.
    ///
    /// # Errors
    /// A vertex of the file that names none of the body; a face that names none of the file.
    pub fn check(&self, vertices: usize) -> Result<(), MeshError> {
        let mut indices = self.body_vertices.iter().enumerate();
        if let Some((vertex, &index)) = indices.find(|(_, index)| **index as usize >= vertices) {
            return Err(MeshError::FileVertex {
                vertex,
                index,
                vertices,
            });
        }
        check_faces(&self.faces, self.body_vertices.len())
    }

    /// Copies values of the body's vertices into `out`, one for each vertex of the file.
    ///
    /// # Panics
    /// If `body` has fewer vertices than the mesh was checked with.
    pub fn expand(&self, body: &[Vec3], out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.body_vertices.iter().map(|&v| body[v as usize]));
    }
}

impl Character {
    /// Returns the character with the vertices and faces of its file, itself if nothing was welded.
    ///
    /// For exports. Contact and sampling need the welded body, whose surface is closed.
    ///
    /// # Panics
    /// If the mesh of the file names vertices that the body has not; [`FileMesh::check`] finds it.
    pub fn in_file_order(&self) -> Cow<'_, Self> {
        let Some(mesh) = &self.file_mesh else {
            return Cow::Borrowed(self);
        };
        let mut vertices = Vec::new();
        mesh.expand(&self.body.vertices, &mut vertices);
        let rows = mesh.body_vertices.iter().map(|&v| v as usize);
        Cow::Owned(Self {
            body: TriMesh {
                vertices,
                faces: mesh.faces.clone(),
                uvs: None,
            },
            skeleton: self.skeleton.clone(),
            weights: self.weights.gathered(rows),
            file_mesh: None,
        })
    }

    /// Finds the joint that moves each face of the body most, by the sum of the weights of its
    /// corners. Of several the lowest index is taken.
    pub fn joints_of_faces(&self) -> Vec<usize> {
        let mut sums = vec![0.0f32; self.skeleton.len()];
        let mut heaviest = |face: &[u32; 3]| {
            sums.fill(0.0);
            let entries = face.iter().flat_map(|&v| self.weights.row(v as usize));
            entries.for_each(|(joint, weight)| sums[joint] += weight);
            // A strict comparison keeps the lowest index of equal sums.
            let larger = |best: usize, joint: usize| if sums[joint] > sums[best] { joint } else { best };
            (0..sums.len()).fold(0, larger)
        };
        self.body.faces.iter().map(&mut heaviest).collect()
    }
}

/// Garment in its rest shape, in the character's bind-pose space.
#[derive(Clone, Debug, PartialEq)]
pub struct Garment {
    /// Rest shape: defines the rest lengths, and may cut into the body.
    pub rest: TriMesh,
    /// Skinning weights over the character's joints, one row for each garment vertex.
    pub weights: SkinningWeights,
    /// Skinning weights of the capture where `weights` are others, one row for each garment vertex.
    /// They carry the garment around the body: they say what parts of the body push a vertex, and
    /// where intersection handling finds a way out of a limb. None: those of `weights`.
    pub carriers: Option<SkinningWeights>,
    /// Weight of the model's displacement at each vertex, in [0, 1]: at 0 the vertex is where
    /// skinning puts the rest shape. None means 1 everywhere.
    pub mask: Option<Vec<f32>>,
}

impl Garment {
    /// Makes a garment without a mask and without carriers of its own.
    pub fn new(rest: TriMesh, weights: SkinningWeights) -> Self {
        Self {
            rest,
            weights,
            carriers: None,
            mask: None,
        }
    }

    /// Returns the weights that carry the garment around the body, one row for each garment vertex.
    pub fn carriers(&self) -> &SkinningWeights {
        self.carriers.as_ref().unwrap_or(&self.weights)
    }

    /// Mask at one vertex; 1 without a mask.
    pub fn share(&self, vertex: usize) -> f32 {
        self.mask.as_ref().map_or(1.0, |mask| mask[vertex])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::SkeletonParts;

    /// Two triangles that share an edge, whose file repeats one end of it.
    fn square() -> Character {
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        let rows = [0.25f32, 0.5, 0.75, 1.0].map(|w| [(0, w), (1, 1.0 - w)].into_iter());
        let parts = SkeletonParts {
            parents: vec![-1, 0],
            joints: vec![Vec3::ZERO, Vec3::Y],
            ..SkeletonParts::default()
        };
        Character {
            body: TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap(),
            skeleton: Skeleton::new(parts).unwrap(),
            weights: SkinningWeights::from_rows(2, rows.into_iter()).unwrap(),
            file_mesh: Some(FileMesh {
                body_vertices: vec![3, 0, 1, 2, 0],
                faces: vec![[1, 2, 3], [4, 3, 0]],
            }),
        }
    }

    #[test]
    fn exports_have_the_vertices_of_the_file_in_its_order() {
        let character = square();
        let mesh = character.file_mesh.as_ref().unwrap();
        mesh.check(4).unwrap();
        let file = character.in_file_order();
        let (body, welded) = (&file.body, &character.body);
        body.check().unwrap();
        assert_eq!(body.vertices, [3, 0, 1, 2, 0].map(|v: usize| welded.vertices[v]));
        for (v, &of_body) in mesh.body_vertices.iter().enumerate() {
            let row = |weights: &SkinningWeights, v: usize| weights.row(v).collect::<Vec<_>>();
            assert_eq!(row(&file.weights, v), row(&character.weights, of_body as usize));
        }
        assert_eq!(file.in_file_order(), file, "a second time changes nothing");
    }

    #[test]
    fn indices_out_of_range_are_found() {
        let mesh = square().file_mesh.unwrap();
        let found = mesh.check(3);
        let expected = MeshError::FileVertex {
            vertex: 0,
            index: 3,
            vertices: 3,
        };
        assert_eq!(found, Err(expected));
        let short = FileMesh {
            body_vertices: mesh.body_vertices[..4].to_vec(),
            ..mesh
        };
        let found = short.check(4);
        let expected = MeshError::Index {
            face: 1,
            index: 4,
            vertices: 4,
        };
        assert_eq!(found, Err(expected));
    }
}
