//! Writing Alembic files.

use super::with_path;
use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use glam::Vec3;
use ogawa::{ArchiveWriter, Attribute, Faces, FrameTiming, MeshDescription, MeshId, Scope};
use std::path::{Path, PathBuf};
use unic_core::mesh::{SeamlessNormals, TriMesh, Uvs};

/// Writer of an Alembic file, one frame at a time: positions and normals. The file appears when it is complete.
///
/// Memory holds one frame and the places of all others.
#[derive(Debug)]
pub struct AlembicWriter {
    path: PathBuf,
    archive: ArchiveWriter<AtomicFile>,
    meshes: Vec<AlembicMesh>,
    normals: Vec<Vec3>,
}

#[derive(Debug)]
struct AlembicMesh {
    id: MeshId,
    normals: SeamlessNormals,
}

impl AlembicWriter {
    /// Starts a file of named meshes, whose own positions are not written.
    ///
    /// # Errors
    /// A frame rate that is not positive; a name that occurs twice; a mesh with indices out of
    /// range; a folder that cannot be written to.
    pub fn create(path: &Path, meshes: &[(&str, &TriMesh)], fps: f32) -> Result<Self> {
        let timing = FrameTiming {
            fps: f64::from(fps),
            start: 0.0,
        };
        let file = AtomicFile::create(path)?;
        let mut archive = ArchiveWriter::new(file, timing).map_err(with_path(path))?;
        let mut add = |&(name, mesh): &(&str, &TriMesh)| {
            let id = archive.add_mesh(&MeshDescription {
                name,
                vertices: mesh.vertices.len(),
                faces: &Faces::triangles(&mesh.faces),
                uvs: mesh.uvs.as_ref().map(uvs_by_corner).as_ref(),
            })?;
            Ok(AlembicMesh {
                id,
                // The archive has checked the faces.
                normals: SeamlessNormals::new(mesh),
            })
        };
        let meshes = meshes.iter().map(&mut add).collect::<ogawa::Result<Vec<_>>>();
        Ok(Self {
            path: path.to_path_buf(),
            meshes: meshes.map_err(with_path(path))?,
            archive,
            normals: Vec::new(),
        })
    }

    /// Adds a frame: the positions of each mesh, in the order of the meshes.
    ///
    /// # Errors
    /// Another number of meshes or vertices; positions that are not finite; a full disk.
    pub fn push(&mut self, frame: &[&[Vec3]]) -> Result<()> {
        if frame.len() != self.meshes.len() {
            let expected = format!("positions of {} meshes", self.meshes.len());
            return Err(Error::content(&self.path, expected, frame.len().to_string()));
        }
        for (mesh, positions) in self.meshes.iter().zip(frame) {
            // Another number of positions is refused below, but has no normals.
            if positions.len() == mesh.normals.len() {
                mesh.normals.compute(positions, &mut self.normals);
            }
            let [positions, normals] = [positions, self.normals.as_slice()].map(bytemuck::cast_slice);
            let pushed = self.archive.push_with_normals(mesh.id, positions, normals);
            pushed.map_err(with_path(&self.path))?;
        }
        Ok(())
    }

    /// Completes the file and gives it its final name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> Result<()> {
        let file = self.archive.finish().map_err(with_path(&self.path))?;
        file.finish()
    }
}

fn uvs_by_corner(uvs: &Uvs) -> Attribute<2> {
    Attribute {
        scope: Scope::Corner,
        values: uvs.coordinates.iter().map(|uv| uv.to_array()).collect(),
        indices: Some(uvs.faces.as_flattened().to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn triangle() -> TriMesh {
        TriMesh {
            vertices: vec![Vec3::ZERO; 3],
            faces: vec![[0, 1, 2]],
            uvs: Some(Uvs {
                coordinates: vec![Vec2::ZERO, Vec2::ONE],
                faces: vec![[0, 1, 1]],
            }),
        }
    }

    #[test]
    fn two_meshes_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.abc");
        let mesh = triangle();
        let mut writer = AlembicWriter::create(&path, &[("garment", &mesh), ("body", &mesh)], 30.0).unwrap();
        let frames = [[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::ONE, Vec3::Y, Vec3::NEG_Z]];
        writer.push(&[&frames[0], &frames[1]]).unwrap();
        writer.push(&[&frames[1], &frames[0]]).unwrap();
        assert!(!path.exists());
        writer.finish().unwrap();
        let mut archive = ogawa::Archive::open(&path).unwrap();
        let meshes = archive.meshes().unwrap();
        let mut positions = Vec::new();
        for (mesh, expected) in meshes.iter().zip([&frames, &[frames[1], frames[0]]]) {
            for (frame, expected) in (0..).zip(expected) {
                mesh.world_positions(&mut archive, frame, &mut positions).unwrap();
                assert_eq!(positions, expected.map(|p| p.to_array()));
            }
            // The triangle of the first frame has the corners X, Y and Z or their like.
            let normals = mesh.normals(&mut archive, 0).unwrap().unwrap();
            assert_eq!(normals.values.len(), 3);
            let uvs = mesh.uvs(&mut archive, 0).unwrap().unwrap();
            assert_eq!(uvs.indices, Some(vec![0, 1, 1]));
            assert_eq!(
                mesh.faces(&mut archive, 1).unwrap(),
                Faces::triangles(&[[0, 1, 2]])
            );
        }
        assert_eq!(archive.full_name(meshes[1].object()), "/body/bodyShape");
        assert!((meshes[0].time(&archive, 1) - 1.0 / 30.0).abs() < 1e-9);
    }

    #[test]
    fn refusals_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.abc");
        let mesh = triangle();
        let error = AlembicWriter::create(&path, &[("a", &mesh), ("a", &mesh)], 30.0).unwrap_err();
        let expected = format!("{}: expected name: one for each mesh, found a", path.display());
        assert_eq!(error.to_string(), expected);
        let mut writer = AlembicWriter::create(&path, &[("a", &mesh)], 30.0).unwrap();
        assert!(writer.push(&[]).is_err());
        let error = writer.push(&[&[Vec3::NAN; 3]]).unwrap_err().to_string();
        assert!(
            error.ends_with("expected positions: finite numbers, found vertex 0 without one"),
            "{error}"
        );
        drop(writer);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
