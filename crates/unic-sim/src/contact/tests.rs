//! Cloth and limbs of a body made of cubes.

use super::{
    visitors::tests::{cubes, patches},
    *,
};
use glam::Vec3;

/// Where a particle of the trunk's cloth and its previous position end after 30 ms beside a hand that
/// has been moved to the trunk, 2 mm off.
fn beside_a_hand_at_the_trunk(start: Vec3) -> [Vec3; 2] {
    let character = cubes();
    let cloth = patches([Vec3::Y * 0.06, Vec3::new(0.2, 0.06, 0.0)]);
    let mut body = character.body.clone();
    let hand = body.vertices.len() / 4 * 3;
    body.vertices[hand..]
        .iter_mut()
        .for_each(|v| *v += Vec3::new(-0.6, 0.0, 0.102));
    let mut positions = vec![Vec3::Y * 9.0; cloth.vertices.len()];
    positions[0] = start;
    let mut particles = Particles {
        previous: positions.clone(),
        velocities: vec![Vec3::ZERO; positions.len()],
        inverse_masses: vec![1.0; positions.len()],
        positions,
    };
    let interval = BodyInterval::new(&body);
    let limbs = Limbs::new(&character, &cloth);
    let mut contacts = BodyContacts::new(&character.body, 6, ContactSettings::default()).with_limbs(limbs);
    for _ in 0..3 {
        contacts.begin_interval(&interval, &particles, 0.01);
        contacts.project(&interval, 0.0, 1.0, &mut particles);
    }
    [particles.positions[0], particles.previous[0]]
}

#[test]
fn cloth_inside_a_limb_that_passes_sinks_to_the_trunk() {
    // The hand reaches from 5.2 to 15.2 cm, the trunk to 5 cm.
    let [position, previous] = beside_a_hand_at_the_trunk(Vec3::Z * 0.09);
    let thickness = ContactSettings::default().thickness_m;
    assert!(
        (position - Vec3::Z * (0.05 + thickness)).length() < 1e-4,
        "{position}"
    );
    assert_eq!(position, previous, "sinking is no motion");
    let beyond = Vec3::Z * 0.2;
    assert_eq!(beside_a_hand_at_the_trunk(beyond), [beyond; 2]);
}
