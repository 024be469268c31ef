//! Contract: valid cloth is built from meshes as users have them, with split seams and degenerate
//! or duplicated faces, and invalid descriptions are errors.

use super::*;
use proptest::prelude::*;

fn triangle() -> TriMesh {
    TriMesh::new(vec![Vec3::ZERO, Vec3::X * 0.1, Vec3::Y * 0.1], vec![[0, 1, 2]]).unwrap()
}

#[test]
fn each_corner_gets_a_third_of_density_times_area() {
    let cloth = Cloth::new(&ClothSpec::new(triangle(), Material::DENIM)).unwrap();
    for &mass in cloth.masses() {
        assert!((mass - 0.4 * 0.005 / 3.0).abs() < 1e-9);
    }
}

#[test]
fn panels_are_merged_where_vertices_coincide() {
    let corners = [
        [0.0, 0.0],
        [0.1, 0.0],
        [0.0, 0.1],
        [0.1, 0.0],
        [0.1, 0.1],
        [0.0, 0.1],
    ];
    let vertices = corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
    let mesh = TriMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
    let cloth = Cloth::new(&ClothSpec::new(mesh, Material::COTTON)).unwrap();
    assert_eq!((cloth.vertex_count(), cloth.particle_count()), (6, 4));
    let expected = ConstraintCounts {
        triangles: 2,
        hinges: 1,
        long_range: 0,
    };
    assert_eq!(cloth.constraint_counts(), expected);
    let mut vertices = Vec::new();
    cloth.vertex_positions(&cloth.rest().vertices, &mut vertices);
    assert_eq!((vertices[1], vertices[2]), (vertices[3], vertices[5]));
}

#[test]
fn degenerate_and_duplicated_faces_are_accepted() {
    let mut mesh = triangle();
    mesh.vertices.push(Vec3::X * 0.05);
    mesh.faces.extend([[0, 1, 3], [0, 0, 1], [2, 1, 0], [0, 1, 2]]);
    let cloth = Cloth::new(&ClothSpec::new(mesh, Material::SILK)).unwrap();
    assert!(cloth.masses().iter().all(|m| m.is_finite() && *m > 0.0));
}

#[test]
fn invalid_descriptions_are_errors() {
    let refused = |change: fn(&mut ClothSpec)| {
        let mut spec = ClothSpec::new(triangle(), Material::SILK);
        change(&mut spec);
        Cloth::new(&spec).map(|_| ()).unwrap_err()
    };
    assert!(matches!(refused(|s| s.rest.faces.clear()), ClothError::Empty));
    assert!(matches!(refused(|s| s.rest.faces[0][0] = 9), ClothError::Mesh(_)));
    assert!(matches!(
        refused(|s| s.pins.push(3)),
        ClothError::Vertex {
            vertex: 3,
            vertices: 3
        }
    ));
    assert!(matches!(
        refused(|s| s.face_materials = vec![0; 2]),
        ClothError::FaceMaterials { .. }
    ));
    assert!(matches!(
        refused(|s| s.face_materials.push(1)),
        ClothError::NoMaterial { .. }
    ));
    assert!(matches!(
        refused(|s| s.materials.clear()),
        ClothError::NoMaterial { .. }
    ));
    assert!(matches!(
        refused(|s| s.materials[0].thickness = f32::NAN),
        ClothError::Material { .. }
    ));
    let no_uvs = |s: &mut ClothSpec| s.rest.uvs = Some(Default::default());
    assert_eq!(refused(no_uvs), ClothError::Uvs { face: 0 });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_triangle_soup_makes_cloth_with_positive_masses(
        places in proptest::collection::vec((0i8..5, 0i8..5, 0i8..3), 3..40),
        faces in proptest::collection::vec((0usize..40, 0usize..40, 0usize..40), 1..60),
    ) {
        // On a coarse grid: welded vertices, degenerate faces, edges of many faces.
        let vertices: Vec<Vec3> = (places.iter())
            .map(|&(x, y, z)| Vec3::new(x.into(), y.into(), z.into()) * 0.02)
            .collect();
        let count = vertices.len();
        let faces = (faces.iter()).map(|&(a, b, c)| [a, b, c].map(|v| (v % count) as u32));
        let mesh = TriMesh::new(vertices, faces.collect()).unwrap();
        match Cloth::new(&ClothSpec::new(mesh, Material::TULLE)) {
            Ok(cloth) => prop_assert!(cloth.masses().iter().all(|m| m.is_finite() && *m > 0.0)),
            Err(error) => prop_assert_eq!(error, ClothError::Empty),
        }
    }
}
