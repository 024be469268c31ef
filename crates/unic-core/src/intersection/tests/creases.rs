//! Where a body leaves cloth little room.

use super::*;

/// Two walls that face each other, from 4 mm to 44 mm apart: at the narrow end alone there is a fold.
fn wedge() -> TriMesh {
    let wall = |heights: [f32; 2], faces: [[u32; 3]; 2]| {
        let [narrow, wide] = heights;
        let corners = [
            (0.0, -0.2, narrow),
            (0.4, -0.2, wide),
            (0.0, 0.2, narrow),
            (0.4, 0.2, wide),
        ];
        let corners = corners.map(|(x, z, y)| Vec3::new(x, y, z));
        TriMesh::new(corners.to_vec(), faces.to_vec()).unwrap()
    };
    two(
        wall([0.0, 0.0], [[0, 2, 1], [1, 2, 3]]),
        wall([0.004, 0.044], [[0, 1, 2], [1, 3, 2]]),
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
fn between_two_walls_cloth_stays_outside_both() {
    let (body, garment) = rigid(wedge(), strip());
    for p in &garment.rest.vertices {
        let out = corrected(&body, *p).unwrap();
        let height_m = body.surface().closest(out).unwrap().signed_distance;
        assert!(
            height_m > 0.0015,
            "{p} goes to {out}, {height_m} m over the nearer wall"
        );
    }
    assert_together_as_alone(&body, &garment).unwrap();
}

#[test]
fn a_place_between_corners_in_and_out_of_a_fold_is_not_left_alone() {
    let mesh = wedge();
    let mut folds = crate::folds::Folds::default();
    folds.find(&Surface::build(&mesh));
    let corners: Vec<usize> = (0..4).map(|face| folds.corners_of_face(face)).collect();
    assert!(corners.iter().all(|n| [1, 2].contains(n)), "{corners:?}");
    assert_eq!(folds.corners_of_face(4), 0);
    let (body, _) = rigid(mesh, cube());
    assert!(corrected(&body, Vec3::new(0.1, 0.02, 0.0)).is_some());
}
