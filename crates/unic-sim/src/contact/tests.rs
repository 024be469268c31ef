//! Contract: cloth inside an ignored limb moves to the covered part beneath it, without velocity.
//! The body is made of cubes.

use super::{
    limb_filter::tests::{cubes, patches},
    *,
};
use glam::Vec3;

/// A particle after a test: its position and its previous position, metres.
#[derive(Debug, PartialEq)]
struct End {
    position: Vec3,
    previous: Vec3,
}

/// Puts a particle of the trunk's cloth at `start`, and the hand 2 mm beside the trunk. Returns the
/// particle after 30 ms.
fn run_with_hand_at_trunk(start: Vec3) -> End {
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
    let limbs = BareLimbs::new(&character, &cloth);
    let mut contacts = BodyContacts::new(&character.body, 6, ContactSettings::default()).with_limbs(limbs);
    for _ in 0..3 {
        contacts.begin_interval(&interval, &particles, 0.01);
        contacts.project(&interval, 0.0, 1.0, &mut particles);
    }
    End {
        position: particles.positions[0],
        previous: particles.previous[0],
    }
}

#[test]
fn cloth_inside_an_ignored_limb_moves_to_the_trunk() {
    // The hand reaches from 5.2 to 15.2 cm, the trunk to 5 cm.
    let End { position, previous } = run_with_hand_at_trunk(Vec3::Z * 0.09);
    let thickness = ContactSettings::default().thickness_m;
    assert!(
        (position - Vec3::Z * (0.05 + thickness)).length() < 1e-4,
        "{position}"
    );
    assert_eq!(position, previous, "the displacement is no velocity");
    let beyond = Vec3::Z * 0.2;
    let unchanged = End {
        position: beyond,
        previous: beyond,
    };
    assert_eq!(run_with_hand_at_trunk(beyond), unchanged);
}
