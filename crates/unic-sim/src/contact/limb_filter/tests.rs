//! Contract: the filter finds the bare limbs of a body, ignores them where they are close to
//! covered parts or beneath the cloth, and leaves all other contacts alone. The body is made of
//! cubes.

use super::*;
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// A body of four cubes in a row along x, 10 cm wide and 20 cm apart: trunk, upper arm, forearm,
/// hand.
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
        file_mesh: None,
    }
}

/// Triangles of cloth around these positions, facing up.
pub(in crate::contact) fn patches<const N: usize>(positions: [Vec3; N]) -> TriMesh {
    let corners = [-Vec3::ONE, Vec3::Z, Vec3::X].map(|p| p.with_y(0.0) * 0.01);
    let vertices = positions.iter().flat_map(|&p| corners.map(|corner| p + corner));
    let face = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    TriMesh::new(vertices.collect(), (0..N as u32).map(face).collect()).unwrap()
}

/// The bare limbs of a body in this garment.
pub(in crate::contact) fn bare_limbs(character: &Character, rest: &TriMesh) -> BareLimbs {
    BareLimbs::new(character, rest, &hits_in_bind_pose(&character.body, rest))
}

/// Cloth on the trunk, particles 0 to 2, and on the upper arm, particles 3 to 5.
fn shirt() -> TriMesh {
    patches([Vec3::Y * 0.06, Vec3::new(0.2, 0.06, 0.0)])
}

/// Updates the filter for the cubes with the hand displaced by `offset`.
fn update_with_hand_moved(
    limb_filter: &mut LimbFilter,
    character: &Character,
    cloth: &TriMesh,
    offset: Vec3,
) {
    let mut posed = character.body.vertices.clone();
    let hand = posed.len() / 4 * 3;
    posed[hand..].iter_mut().for_each(|v| *v += offset);
    let mut surface = Surface::build(&character.body);
    surface.refit(&posed);
    let mut folds = Folds::default();
    folds.find(&surface);
    limb_filter.update(&surface, &folds, &posed, &cloth.vertices);
}

#[test]
fn a_limb_begins_where_the_garment_ends() {
    let limbs = bare_limbs(&cubes(), &shirt());
    let faces = limbs.limb_of_face.len() / 4;
    let bits: Vec<u32> = limbs.limb_of_face.iter().step_by(faces).copied().collect();
    assert_eq!(bits, [0, 0, 1, 1], "forearm and hand are one limb");
    assert_eq!(
        limbs.never_ignored,
        [0, 0, 0, 1, 1, 1],
        "the sleeve collides with the forearm that it ends at"
    );
    let gloves = bare_limbs(&cubes(), &patches([Vec3::X * 0.66]));
    assert!(
        gloves.limb_of_face.iter().all(|&bit| bit == 0),
        "a part that carries the garment is no limb"
    );
}

#[test]
fn a_hand_close_to_the_trunk_is_ignored_and_one_farther_away_is_not() {
    let character = cubes();
    let cloth = shirt();
    let mut limb_filter = LimbFilter::new(bare_limbs(&character, &cloth));
    let hand_face = (character.body.faces.len() / 4 * 3) as u32;
    let mut ignored = |gap: f32| {
        update_with_hand_moved(
            &mut limb_filter,
            &character,
            &cloth,
            Vec3::new(-0.6, 0.0, 0.1 + gap),
        );
        let (trunk, sleeve) = (
            limb_filter.ignores(0, hand_face),
            limb_filter.ignores(3, hand_face),
        );
        assert!(
            !limb_filter.ignores(0, 0) && !limb_filter.ignores(0, u32::MAX),
            "the trunk stays solid"
        );
        (trunk, sleeve)
    };
    assert_eq!(ignored(0.03), (false, false));
    assert_eq!(ignored(0.002), (true, false));
    assert_eq!(ignored(-0.02), (true, false));
    assert_eq!(ignored(0.5), (false, false));
}

#[test]
fn outside_limbs_collide_with_the_outer_side_of_the_cloth_only() {
    let character = cubes();
    let (cloth, surface) = (shirt(), Surface::build(&character.body));
    let mut folds = Folds::default();
    folds.find(&surface);
    let limbs = bare_limbs(&character, &cloth);
    assert_eq!(limbs.outside_limbs, 1);
    let mut limb_filter = LimbFilter::new(limbs);
    let hand = (character.body.faces.len() / 4 * 3) as u32;
    let faces = surface.faces()[hand as usize..].iter().zip(hand..);
    let facing = |direction: Vec3| {
        let is_facing = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| character.body.vertices[v as usize]);
            (b - a).cross(c - a).dot(direction) > 1e-6
        };
        faces.clone().find(|(face, _)| is_facing(face)).unwrap().1
    };
    limb_filter.update(&surface, &folds, &character.body.vertices, &cloth.vertices);
    let ignored = |particle, direction| limb_filter.ignores(particle, facing(direction));
    assert!(ignored(0, Vec3::Y), "the top of a hand beneath the cloth");
    assert!(!ignored(0, -Vec3::Y), "the palm of a hand on the cloth");
    assert!(!ignored(3, Vec3::Y), "the sleeve always collides with it");
    // The same shirt with reversed faces.
    let mut reversed = cloth.clone();
    reversed.faces.iter_mut().for_each(|face| face.swap(0, 1));
    let mut limb_filter = LimbFilter::new(bare_limbs(&character, &reversed));
    limb_filter.update(&surface, &folds, &character.body.vertices, &cloth.vertices);
    assert!(limb_filter.ignores(0, facing(Vec3::Y)) && !limb_filter.ignores(0, facing(-Vec3::Y)));
}

#[test]
fn all_of_a_hand_is_ignored_while_it_is_half_beneath_the_cloth() {
    let character = cubes();
    // Cloth 25 cm over the trunk: nothing but the cloth is near a hand beneath it.
    let cloth = patches([Vec3::Y * 0.3, Vec3::new(0.2, 0.06, 0.0)]);
    let mut limb_filter = LimbFilter::new(bare_limbs(&character, &cloth));
    let side = (character.body.faces.len() / 4 * 3 + 2) as u32;
    let mut ignored = |corner_y: f32| {
        // One corner of the hand lies on the vertical through the cloth.
        let offset = Vec3::new(-0.65, corner_y - 0.05, -0.05);
        update_with_hand_moved(&mut limb_filter, &character, &cloth, offset);
        limb_filter.ignores(0, side)
    };
    assert!(ignored(0.295), "5 mm beneath the cloth");
    assert!(!ignored(0.27), "3 cm beneath it");
    assert!(!ignored(0.305), "5 mm above it");
}

#[test]
fn legs_below_a_hem_are_not_outside_limbs() {
    // Cloth of the trunk that encloses the arm, as a skirt encloses both shins.
    let limbs = bare_limbs(
        &cubes(),
        &patches([Vec3::new(0.09, 0.08, 0.0), Vec3::new(0.2, 0.06, 0.0)]),
    );
    assert_eq!(limbs.never_ignored, [0, 0, 0, 1, 1, 1]);
    assert_eq!(limbs.outside_limbs, 0);
}
