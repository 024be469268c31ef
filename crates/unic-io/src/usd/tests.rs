use super::*;
use glam::Vec2;
use unic_core::mesh::Uvs;

fn triangle() -> TriMesh {
    TriMesh {
        vertices: vec![Vec3::ZERO; 3],
        faces: vec![[0, 1, 2]],
        uvs: Some(Uvs {
            coordinates: vec![Vec2::ZERO, Vec2::new(0.25, 1.0)],
            faces: vec![[0, 1, 1]],
        }),
    }
}

fn written(name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mesh = triangle();
    let mut writer = UsdWriter::create(&path, &[("garment", &mesh), ("body", &mesh)], 24.0).unwrap();
    let frames = [[Vec3::X, Vec3::Y, Vec3::Z], [Vec3::ONE, Vec3::Y, Vec3::NEG_Z]];
    writer.push(&[&frames[0], &frames[1]]).unwrap();
    writer.push(&[&frames[1], &frames[0]]).unwrap();
    assert!(!path.exists());
    writer.finish().unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
fn the_text_lists_every_frame_of_every_mesh() {
    let text = String::from_utf8(written("a.usda")).unwrap();
    assert!(text.starts_with("#usda 1.0\n"));
    for part in [
        "framesPerSecond = 24",
        "timeCodesPerSecond = 24",
        "endTimeCode = 1",
        "upAxis = \"Y\"",
        "point3f[] points.timeSamples = {\n            0: [(1, 0, 0), (0, 1, 0), (0, 0, 1)],\n            1: [(1, 1, 1), (0, 1, 0), (0, 0, -1)],",
        "point3f[] points.timeSamples = {\n            0: [(1, 1, 1), (0, 1, 0), (0, 0, -1)],",
        "float3[] extent.timeSamples = {\n            0: [(0, 0, 0), (1, 1, 1)],",
        "texCoord2f[] primvars:st = [(0, 0), (0.25, 1)] (",
        "int[] primvars:st:indices = [0, 1, 1]",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_eq!(text.matches("def Mesh").count(), 2);
}

#[test]
fn refusals_name_the_file_and_leave_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = triangle();
    for name in ["a.usda", "a.usdc"] {
        let path = folder.path().join(name);
        for meshes in [
            &[("a", &mesh), ("a", &mesh)][..],
            &[("1a", &mesh)],
            &[("", &mesh)],
            &[("a b", &mesh)],
        ] {
            let error = UsdWriter::create(&path, meshes, 24.0).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("identifiers"), "{error}");
        }
        assert!(UsdWriter::create(&path, &[("a", &mesh)], f32::NAN).is_err());
        let mut writer = UsdWriter::create(&path, &[("a", &mesh)], 24.0).unwrap();
        assert!(writer.push(&[]).is_err() && writer.push(&[&[Vec3::X]]).is_err());
        let error = writer
            .push(&[&[Vec3::X, Vec3::NAN, Vec3::Y]])
            .unwrap_err()
            .to_string();
        assert!(error.contains("finite positions, found vertex 1"), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
