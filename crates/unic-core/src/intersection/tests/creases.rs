//! Contract of the robust handling in creases: cloth between two walls ends outside both of them.

use super::*;

/// Two walls that face each other, from 4 mm to 44 mm apart: only the narrow end is a fold.
fn wedge() -> TriMesh {
    let wall = |narrow: f32, wide: f32, faces: [[u32; 3]; 2]| {
        let corners = [
            (0.0, -0.2, narrow),
            (0.4, -0.2, wide),
            (0.0, 0.2, narrow),
            (0.4, 0.2, wide),
        ];
        let corners = corners.map(|(x, z, y)| Vec3::new(x, y, z));
        TriMesh::new(corners.to_vec(), faces.to_vec()).unwrap()
    };
    joined(
        wall(0.0, 0.0, [[0, 2, 1], [1, 2, 3]]),
        wall(0.004, 0.044, [[0, 1, 2], [1, 3, 2]]),
    )
}

/// Cloth in the narrow end, of which some is in one of the walls.
fn strip() -> TriMesh {
    let places = [
        (0.002, 0.0055),
        (0.004, 0.001),
        (0.01, 0.006),
        (0.01, -0.002),
        (0.015, 0.007),
    ];
    let places = places.map(|(x, y)| Vec3::new(x, y, 0.01));
    TriMesh::new(places.to_vec(), vec![[0, 1, 2], [1, 3, 2], [2, 3, 4]]).unwrap()
}

#[test]
fn cloth_between_two_walls_stays_outside_both() {
    let (body, garment) = on_one_joint(wedge(), strip());
    for p in &garment.rest.vertices {
        let out = corrected(&body, *p).unwrap();
        let height_m = body.surface().closest(out).unwrap().signed_distance;
        assert!(
            height_m > 0.0015,
            "{p} goes to {out}, {height_m} m over the nearer wall"
        );
    }
    assert_packets_agree_with_single_vertices(&body, &garment).unwrap();
}

#[test]
fn a_vertex_over_a_face_that_is_partly_in_a_fold_is_pushed() {
    let mesh = wedge();
    let mut folds = crate::folds::Folds::default();
    folds.find(&Surface::build(&mesh));
    let corners: Vec<usize> = (0..4).map(|face| folds.folded_corners(face)).collect();
    assert!(corners.iter().all(|n| [1, 2].contains(n)), "{corners:?}");
    assert_eq!(folds.folded_corners(4), 0);
    let (body, _) = on_one_joint(mesh, cube());
    assert!(corrected(&body, Vec3::new(0.1, 0.02, 0.0)).is_some());
}
