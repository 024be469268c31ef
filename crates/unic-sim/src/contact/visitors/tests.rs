//! Limbs of a body made of cubes.

use super::*;
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Four cubes in a row along x, 10 cm thick and 20 cm apart: trunk, upper arm, forearm, hand.
pub(in crate::contact) fn cubes() -> Character {
    let corner = |i: u32| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 - 0.5)) * 0.1;
    let squares = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let (mut vertices, mut faces, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for joint in 0..4 {
        let first = vertices.len() as u32;
        let centre = Vec3::X * 0.2 * joint as f32;
        vertices.extend((0..8).map(|i| corner(i) + centre));
        let triangles = squares.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        faces.extend(triangles.map(|f: [u32; 3]| f.map(|v| v + first)));
        rows.extend([(joint, 1.0); 8].map(std::iter::once));
    }
    let parts = SkeletonParts {
        parents: vec![-1, 0, 1, 2],
        joints: (0..4).map(|j| Vec3::X * 0.2 * j as f32).collect(),
        ..Default::default()
    };
    Character {
        body: TriMesh::new(vertices, faces).unwrap(),
        skeleton: Skeleton::new(parts).unwrap(),
        weights: SkinningWeights::from_rows(4, rows.into_iter()).unwrap(),
    }
}

/// A patch of cloth over each of these places, facing up.
pub(in crate::contact) fn patches<const N: usize>(places: [Vec3; N]) -> TriMesh {
    let corners = [-Vec3::ONE, Vec3::Z, Vec3::X].map(|p| p.with_y(0.0) * 0.01);
    let vertices = places.iter().flat_map(|&p| corners.map(|corner| p + corner));
    let face = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    TriMesh::new(vertices.collect(), (0..N as u32).map(face).collect()).unwrap()
}

/// A patch on the trunk, particles 0 to 2, and one on the upper arm.
fn shirt() -> TriMesh {
    patches([Vec3::Y * 0.06, Vec3::new(0.2, 0.06, 0.0)])
}

/// For the cubes with the last one moved.
fn find_with_hand_moved(visitors: &mut Visitors, character: &Character, cloth: &TriMesh, way: Vec3) {
    let mut posed = character.body.vertices.clone();
    let hand = posed.len() / 4 * 3;
    posed[hand..].iter_mut().for_each(|v| *v += way);
    let mut surface = Surface::build(&character.body);
    surface.refit(&posed);
    let mut folds = Folds::default();
    folds.find(&surface);
    visitors.find(&surface, &folds, &posed, &cloth.vertices);
}

#[test]
fn a_limb_begins_where_the_garment_ends() {
    let limbs = Limbs::new(&cubes(), &shirt());
    let faces = limbs.of_face.len() / 4;
    let bits: Vec<u32> = limbs.of_face.iter().step_by(faces).copied().collect();
    assert_eq!(bits, [0, 0, 1, 1], "forearm and hand are one limb");
    assert_eq!(
        limbs.felt,
        [0, 0, 0, 1, 1, 1],
        "the sleeve feels the forearm that it ends at"
    );
    let gloves = Limbs::new(&cubes(), &patches([Vec3::X * 0.66]));
    assert!(
        gloves.of_face.iter().all(|&bit| bit == 0),
        "what carries the garment is no limb"
    );
}

#[test]
fn a_hand_at_the_trunk_passes_through_the_shirt_and_one_beside_it_does_not() {
    let character = cubes();
    let cloth = shirt();
    let mut visitors = Visitors::new(Limbs::new(&character, &cloth));
    let hand_face = (character.body.faces.len() / 4 * 3) as u32;
    let mut passes = |gap: f32| {
        find_with_hand_moved(&mut visitors, &character, &cloth, Vec3::new(-0.6, 0.0, 0.1 + gap));
        let (trunk, sleeve) = (visitors.pass(0, hand_face), visitors.pass(3, hand_face));
        assert!(
            !visitors.pass(0, 0) && !visitors.pass(0, u32::MAX),
            "the trunk stays solid"
        );
        (trunk, sleeve)
    };
    assert_eq!(passes(0.03), (false, false));
    assert_eq!(passes(0.002), (true, false));
    assert_eq!(passes(-0.02), (true, false));
    assert_eq!(passes(0.5), (false, false));
}

#[test]
fn what_the_garment_does_not_cover_touches_its_outer_side_alone() {
    let character = cubes();
    let (cloth, surface) = (shirt(), Surface::build(&character.body));
    let mut folds = Folds::default();
    folds.find(&surface);
    let limbs = Limbs::new(&character, &cloth);
    assert_eq!(limbs.outer, 1);
    let mut visitors = Visitors::new(limbs);
    let hand = (character.body.faces.len() / 4 * 3) as u32;
    let faces = surface.faces()[hand as usize..].iter().zip(hand..);
    let facing = |way: Vec3| {
        let looks = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| character.body.vertices[v as usize]);
            (b - a).cross(c - a).dot(way) > 1e-6
        };
        faces.clone().find(|(face, _)| looks(face)).unwrap().1
    };
    visitors.find(&surface, &folds, &character.body.vertices, &cloth.vertices);
    let passes = |particle, way| visitors.pass(particle, facing(way));
    assert!(passes(0, Vec3::Y), "the top of a hand under the cloth");
    assert!(!passes(0, -Vec3::Y), "the palm of one upon it");
    assert!(!passes(3, Vec3::Y), "the sleeve feels it always");
    // The same shirt, sewn inside out.
    let mut reversed = cloth.clone();
    reversed.faces.iter_mut().for_each(|face| face.swap(0, 1));
    let mut visitors = Visitors::new(Limbs::new(&character, &reversed));
    visitors.find(&surface, &folds, &character.body.vertices, &cloth.vertices);
    assert!(visitors.pass(0, facing(Vec3::Y)) && !visitors.pass(0, facing(-Vec3::Y)));
}

#[test]
fn a_hand_half_through_the_cloth_passes_whole() {
    let character = cubes();
    // Cloth 25 cm over the trunk: nothing but the cloth is near a hand under it.
    let cloth = patches([Vec3::Y * 0.3, Vec3::new(0.2, 0.06, 0.0)]);
    let mut visitors = Visitors::new(Limbs::new(&character, &cloth));
    let side = (character.body.faces.len() / 4 * 3 + 2) as u32;
    let mut passes = |corner_y: f32| {
        // One corner of the hand comes to lie on the vertical through the cloth.
        let way = Vec3::new(-0.65, corner_y - 0.05, -0.05);
        find_with_hand_moved(&mut visitors, &character, &cloth, way);
        visitors.pass(0, side)
    };
    assert!(passes(0.295), "5 mm under the cloth");
    assert!(!passes(0.27), "3 cm under it");
    assert!(!passes(0.305), "through it and beyond");
}

#[test]
fn legs_below_a_hem_touch_it_from_within() {
    // Cloth of the trunk that reaches over the arm, as a skirt does over both shins.
    let limbs = Limbs::new(
        &cubes(),
        &patches([Vec3::new(0.09, 0.08, 0.0), Vec3::new(0.2, 0.06, 0.0)]),
    );
    assert_eq!(limbs.felt, [0, 0, 0, 1, 1, 1]);
    assert_eq!(limbs.outer, 0);
}
