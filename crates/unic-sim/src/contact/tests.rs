//! Contract: cloth inside an ignored limb moves to the covered part beneath it, without velocity. In
//! a fold, cloth stays outside the part that it lies on.
//! The body is made of cubes.

use super::{
    limb_filter::tests::{bare_limbs, cubes, patches},
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
    let limbs = bare_limbs(&character, &cloth);
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

/// Distance of the arm's left side from its place in the bind pose to 3 cm inside the trunk,
/// metres.
const PRESS_M: f32 = 0.13;

/// An arm that presses a particle of its sleeve into the trunk, and is lifted again.
struct Press {
    contacts: BodyContacts,
    interval: BodyInterval,
    particles: Particles,
    /// The body in its bind pose.
    body: TriMesh,
    /// Way of the arm from its bind pose to the left, metres.
    way_m: f32,
}

impl Press {
    fn new() -> Self {
        let body = cubes().body;
        let start = Vec3::new(0.146, 0.01, 0.01);
        let sleeve = TriMesh::new(vec![start], Vec::new()).unwrap();
        Self {
            contacts: BodyContacts::new(&body, 1, ContactSettings::default())
                .with_fold_filter(FoldFilter::new(&body, &hits_in_bind_pose(&body, &sleeve))),
            interval: BodyInterval::new(&body),
            particles: Particles {
                previous: vec![start],
                velocities: vec![Vec3::ZERO],
                inverse_masses: vec![1.0],
                positions: vec![start],
            },
            body,
            way_m: 0.0,
        }
    }

    /// Moves the arm by 4 mm in a 120th of a second until it is `way_m` from its place. The cloth
    /// around the particle pulls it by `pull` of the way.
    fn move_arm_to(&mut self, way_m: f32, pull: f32) {
        let arm = self.body.vertices.len() / 4;
        while self.way_m != way_m {
            let step_m = (way_m - self.way_m).clamp(-0.004, 0.004);
            self.way_m += step_m;
            let mut posed = self.body.vertices.clone();
            // Beside the middle, so that a corner of each cube lies in the other one.
            let offset = Vec3::new(-self.way_m, 0.02, 0.02);
            posed[arm..2 * arm].iter_mut().for_each(|v| *v += offset);
            self.interval.advance(&posed);
            self.particles.previous.clone_from(&self.particles.positions);
            let seconds = 1.0 / 120.0;
            self.contacts
                .begin_interval(&self.interval, &self.particles, seconds);
            self.particles.positions[0].x -= pull * step_m;
            self.contacts
                .project(&self.interval, 0.0, 1.0, &mut self.particles);
        }
    }

    /// Gap between the arm's left side and the particle, metres; negative for a particle inside.
    fn gap_m(&self) -> f32 {
        0.15 - self.way_m - self.particles.positions[0].x
    }
}

#[test]
fn a_sleeve_stays_outside_its_arm_where_the_arm_passes_into_the_trunk() {
    let mut press = Press::new();
    press.move_arm_to(PRESS_M, 0.0);
    assert!(press.gap_m() > 0.002, "gap {}", press.gap_m());
    // The cloth comes back with the arm and collides with both parts again.
    press.move_arm_to(0.06, 1.0);
    assert!((0.002..0.01).contains(&press.gap_m()), "gap {}", press.gap_m());
    press.particles.positions[0].x = 0.056;
    press.move_arm_to(0.055, 0.0);
    press.move_arm_to(0.06, -3.0);
    let x = press.particles.positions[0].x;
    assert!(x > 0.0525, "x {x}: the trunk ends at 0.05");
}

#[test]
fn cloth_that_has_come_to_another_part_stays_outside_that_one() {
    let mut press = Press::new();
    press.particles.positions[0].x = 0.056;
    press.move_arm_to(PRESS_M, 0.0);
    let x = press.particles.positions[0].x;
    assert!((0.0525..0.06).contains(&x), "x {x}: the trunk ends at 0.05");
}
